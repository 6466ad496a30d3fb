// Parameters: a plain struct with defaults that lists its members once, with unit, range and doc.
//
//   struct MesherParams {
//     double lambda = 0.75;
//     template <class V> void visit(V& v) {
//       v("lambda", lambda, {.unit = "1", .min = 0, .max = 100, .doc = "weight of the area"});
//     }
//   };
//
// The same list loads YAML and `--set key=value` (unknown keys, wrong types and values out of range
// are refused with one line), prints --describe, and documents itself.
//
// A choice is an enumeration that says its names, beside it:
//
//   enum class Pace { kReal, kConsumed };
//   constexpr auto names_of(Pace) {
//     return std::array{EnumName{Pace::kReal, "real"}, EnumName{Pace::kConsumed, "consumed"}};
//   }
//
// A std::vector is a YAML list, or its elements in one text, separated by blanks or commas.
#pragma once

#include <yaml-cpp/yaml.h>

#include <array>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/errors.h"

namespace foresight {

template <class Enum>
struct EnumName {
  Enum value;
  const char* name;
};

/// The name of a value of an enumeration that has names_of().
template <class Enum>
constexpr const char* name_of(Enum value) {
  for (const auto& named : names_of(value)) {
    if (named.value == value) return named.name;
  }
  return "?";
}

/// The value of that name, if there is one.
template <class Enum>
constexpr std::optional<Enum> value_named(std::string_view name) {
  for (const auto& named : names_of(Enum{})) {
    if (name == named.name) return named.value;
  }
  return std::nullopt;
}

struct ParamSpec {
  const char* unit = "";
  double min = -std::numeric_limits<double>::infinity();  // of each element of a list
  double max = std::numeric_limits<double>::infinity();
  const char* doc = "";
};

/// One parameter as --describe shows it.
struct ParamDescription {
  std::string key, type, value, unit, doc;
  double min = 0, max = 0;
  std::vector<std::string> choices;
};

/// Values for parameters: from a YAML map, then from key=value overrides. Remembers which were
/// used.
class ParamSource {
 public:
  ParamSource() = default;
  /// Reads a YAML file that holds one map. Throws ConfigError.
  static ParamSource from_file(const std::string& path);
  /// A YAML map in memory; `name` appears in error lines.
  static ParamSource from_map(const YAML::Node& map, const std::string& name);
  /// "key=value"; replaces the file's value. Throws UsageError on bad form.
  void override_with(const std::string& assignment);

  bool take(const std::string& key, YAML::Node* value, std::string* origin);
  /// Throws ConfigError for the first key that no parameter took, naming the known ones.
  void refuse_leftovers(const std::vector<ParamDescription>& known) const;

 private:
  struct Entry {
    std::string key;
    YAML::Node value;
    std::string origin;
    bool taken = false;
  };
  void set(const std::string& key, const YAML::Node& value, const std::string& origin);
  std::vector<Entry> entries_;
};

/// Visitor that fills a parameter struct from a source and collects the descriptions.
class ParamLoader {
 public:
  explicit ParamLoader(ParamSource* source) : source_(source) {}

  template <class T>
  void operator()(const char* key, T& value, const ParamSpec& spec) {
    YAML::Node node;
    std::string origin;
    if (source_->take(key, &node, &origin)) value = parse<T>(node, key, origin);
    check(key, value, spec, origin);
    descriptions_.push_back(describe(key, value, spec));
  }
  const std::vector<ParamDescription>& descriptions() const { return descriptions_; }

 private:
  [[noreturn]] static void refuse(const std::string& origin, const std::string& key,
                                  const std::string& what);
  static std::string text_of(const YAML::Node& node);

  template <class T>
  struct IsList : std::false_type {};
  template <class T>
  struct IsList<std::vector<T>> : std::true_type {};
  /// The elements as texts; throws unless the value is a list of scalars or a text.
  static std::vector<std::string> elements_of(const YAML::Node& node, const std::string& key,
                                              const std::string& origin);

  template <class T>
  static std::string type_name() {
    if constexpr (std::is_same_v<T, bool>)
      return "bool";
    else if constexpr (std::is_integral_v<T>)
      return "int";
    else if constexpr (std::is_floating_point_v<T>)
      return "float";
    else if constexpr (IsList<T>::value)
      return type_name<typename T::value_type>() + " list";
    else
      return "string";
  }
  template <class T>
  static std::vector<std::string> choices_of() {
    std::vector<std::string> choices;
    if constexpr (std::is_enum_v<T>) {
      for (const auto& named : names_of(T{})) choices.emplace_back(named.name);
    }
    return choices;
  }
  template <class T>
  static T parse(const YAML::Node& node, const std::string& key, const std::string& origin) {
    if (node.IsNull()) refuse(origin, key, "has no value ('' is the empty text)");
    if constexpr (std::is_enum_v<T>) {
      const auto names = names_of(T{});
      return names[choice_of(node, choices_of<T>(), key, origin)].value;
    } else if constexpr (IsList<T>::value) {
      T values;
      for (const std::string& text : elements_of(node, key, origin)) {
        values.push_back(parse<typename T::value_type>(YAML::Node(text), key, origin));
      }
      return values;
    } else {
      try {
        return node.as<T>();
      } catch (const YAML::Exception&) {
        refuse(origin, key, "'" + text_of(node) + "' is not a " + type_name<T>());
      }
    }
  }
  template <class T>
  static void check(const std::string& key, const T& value, const ParamSpec& spec,
                    const std::string& origin) {
    if constexpr (IsList<T>::value) {
      for (const auto& element : value) check(key, element, spec, origin);
    } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
      check_range(key, static_cast<double>(value), spec, origin);
    }
  }
  /// Which of `choices` it is; throws when none.
  static size_t choice_of(const YAML::Node& node, const std::vector<std::string>& choices,
                          const std::string& key, const std::string& origin);
  static void check_range(const std::string& key, double value, const ParamSpec& spec,
                          const std::string& origin);
  template <class T>
  static std::string value_text(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      std::ostringstream text;
      text << std::setprecision(9) << value;  // 0.15, not 0.14999999999999999
      return text.str();
    } else if constexpr (std::is_enum_v<T>) {
      return name_of(value);
    } else if constexpr (IsList<T>::value) {
      std::string text;
      for (const auto& element : value) text += (text.empty() ? "" : " ") + value_text(element);
      return text;
    } else {
      return text_of(YAML::Node(value));
    }
  }
  template <class T>
  static ParamDescription describe(const char* key, const T& value, const ParamSpec& spec) {
    return {key,      type_name<T>(), value_text(value), spec.unit,
            spec.doc, spec.min,       spec.max,          choices_of<T>()};
  }

  ParamSource* source_;
  std::vector<ParamDescription> descriptions_;
};

/// A parameter struct filled from `source`; throws ConfigError on anything it does not understand.
template <class Params>
Params load_params(ParamSource source, std::vector<ParamDescription>* descriptions = nullptr) {
  Params params;
  ParamLoader loader(&source);
  params.visit(loader);
  source.refuse_leftovers(loader.descriptions());
  if (descriptions != nullptr) *descriptions = loader.descriptions();
  return params;
}

}  // namespace foresight
