#include "common/params.h"

#include <algorithm>
#include <cmath>
#include <fstream>

namespace foresight {

ParamSource ParamSource::from_file(const std::string& path) {
  // A folder can be opened, but has nothing to read.
  std::ifstream file(path);
  if (!file || (file.peek(), file.bad())) throw ConfigError(path + ": cannot be read");
  try {
    return from_map(YAML::LoadFile(path), path);
  } catch (const YAML::Exception& e) {
    throw ConfigError(path + ": not YAML: " + e.what());
  }
}

ParamSource ParamSource::from_map(const YAML::Node& map, const std::string& name) {
  ParamSource source;
  if (!map || map.IsNull()) return source;
  if (!map.IsMap()) throw ConfigError(name + ": must be a map of 'key: value' lines");
  for (const auto& item : map) {
    const auto key = item.first.as<std::string>();
    for (const Entry& e : source.entries_) {
      if (e.key == key) throw ConfigError(name + ": " + key + ": given twice");
    }
    source.set(key, item.second, name);
  }
  return source;
}

void ParamSource::override_with(const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw UsageError("--set " + assignment + ": must be key=value");
  }
  // As it stands, not as YAML: a path may contain ": " or " #".
  const YAML::Node value(assignment.substr(equals + 1));
  set(assignment.substr(0, equals), value, "--set");
}

void ParamSource::set(const std::string& key, const YAML::Node& value, const std::string& origin) {
  for (Entry& e : entries_) {
    if (e.key == key) {
      e = {key, value, origin, false};
      return;
    }
  }
  entries_.push_back({key, value, origin, false});
}

bool ParamSource::take(const std::string& key, YAML::Node* value, std::string* origin) {
  for (Entry& e : entries_) {
    if (e.key != key) continue;
    e.taken = true;
    *value = e.value;
    *origin = e.origin;
    return true;
  }
  return false;
}

void ParamSource::refuse_leftovers(const std::vector<ParamDescription>& known) const {
  for (const Entry& e : entries_) {
    if (e.taken) continue;
    std::string names;
    for (const ParamDescription& d : known) names += (names.empty() ? "" : ", ") + d.key;
    throw ConfigError(e.origin + ": " + e.key +
                      ": unknown parameter; known: " + (names.empty() ? "none" : names));
  }
}

void ParamLoader::refuse(const std::string& origin, const std::string& key,
                         const std::string& what) {
  throw ConfigError((origin.empty() ? "default" : origin) + ": " + key + ": " + what);
}

std::string ParamLoader::text_of(const YAML::Node& node) {
  return node.IsScalar() ? node.Scalar() : YAML::Dump(node);
}

size_t ParamLoader::choice_of(const YAML::Node& node, const std::vector<std::string>& choices,
                              const std::string& key, const std::string& origin) {
  const std::string value = text_of(node);
  const auto at = std::find(choices.begin(), choices.end(), value);
  if (at != choices.end()) return static_cast<size_t>(at - choices.begin());
  std::string names;
  for (const std::string& c : choices) names += (names.empty() ? "" : ", ") + c;
  refuse(origin, key, "'" + value + "' is not one of " + names);
}

std::vector<std::string> ParamLoader::elements_of(const YAML::Node& node, const std::string& key,
                                                  const std::string& origin) {
  std::vector<std::string> elements;
  if (node.IsSequence()) {
    for (const YAML::Node& element : node) {
      if (!element.IsScalar()) refuse(origin, key, "'" + text_of(node) + "' is not a plain list");
      elements.push_back(element.Scalar());
    }
    return elements;
  }
  if (!node.IsScalar()) refuse(origin, key, "'" + text_of(node) + "' is not a list");
  std::string text = node.Scalar();
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  for (std::string word; words >> word;) elements.push_back(word);
  return elements;
}

void ParamLoader::check_range(const std::string& key, double value, const ParamSpec& spec,
                              const std::string& origin) {
  if (std::isfinite(value) && value >= spec.min && value <= spec.max) return;
  const auto text = [](double v) { return YAML::Dump(YAML::Node(v)); };
  refuse(origin, key,
         text(value) + " is outside [" + text(spec.min) + ", " + text(spec.max) + "] " + spec.unit);
}

}  // namespace foresight
