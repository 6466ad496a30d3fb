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
#pragma once

#include <yaml-cpp/yaml.h>

#include <iomanip>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "common/errors.h"

namespace foresight {

struct ParamSpec {
  const char* unit = "";
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> choices = {};  // of a string; empty: free text
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
  static constexpr const char* type_name() {
    if constexpr (std::is_same_v<T, bool>)
      return "bool";
    else if constexpr (std::is_integral_v<T>)
      return "int";
    else if constexpr (std::is_floating_point_v<T>)
      return "float";
    else
      return "string";
  }
  template <class T>
  static T parse(const YAML::Node& node, const std::string& key, const std::string& origin) {
    if (node.IsNull()) refuse(origin, key, "has no value ('' is the empty text)");
    try {
      return node.as<T>();
    } catch (const YAML::Exception&) {
      refuse(origin, key, "'" + text_of(node) + "' is not a " + type_name<T>());
    }
  }
  template <class T>
  static void check(const std::string& key, const T& value, const ParamSpec& spec,
                    const std::string& origin) {
    if constexpr (std::is_same_v<T, std::string>) {
      check_choice(key, value, spec, origin);
    } else if constexpr (!std::is_same_v<T, bool>) {
      check_range(key, static_cast<double>(value), spec, origin);
    }
  }
  static void check_choice(const std::string& key, const std::string& value, const ParamSpec& spec,
                           const std::string& origin);
  static void check_range(const std::string& key, double value, const ParamSpec& spec,
                          const std::string& origin);
  template <class T>
  static std::string value_text(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      std::ostringstream text;
      text << std::setprecision(9) << value;  // 0.15, not 0.14999999999999999
      return text.str();
    } else {
      return text_of(YAML::Node(value));
    }
  }
  template <class T>
  static ParamDescription describe(const char* key, const T& value, const ParamSpec& spec) {
    return {key,      type_name<T>(), value_text(value), spec.unit,
            spec.doc, spec.min,       spec.max,          spec.choices};
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
