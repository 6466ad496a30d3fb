#include "common/yaml_reader.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/errors.h"

namespace foresight {

namespace {

std::string find_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error) || std::filesystem::path(path).is_absolute()) {
    return path;
  }
  const std::string in_checkout = std::string(FORESIGHT_CHECKOUT) + "/" + path;
  return std::filesystem::exists(in_checkout, error) ? in_checkout : path;
}

}  // namespace

YamlReader YamlReader::open(const std::string& path) {
  std::ifstream file(find_file(path));
  if (!file) throw ConfigError(path + ": cannot be read");
  std::stringstream text;
  std::string line;
  while (std::getline(file, line)) {
    if (!line.starts_with("%YAML")) text << line << "\n";
  }
  YAML::Node node;
  try {
    node = YAML::Load(text.str());
  } catch (const YAML::Exception& e) {
    throw ConfigError(path + ": not YAML: " + e.what());
  }
  if (!node.IsMap()) throw ConfigError(path + ": must be a map of 'key: value' lines");
  return {node, path};
}

void YamlReader::refuse(const std::string& key, const std::string& what) const {
  throw ConfigError(where_ + ": " + key + ": " + what);
}

bool YamlReader::has(const std::string& key) const { return node_[key].IsDefined(); }

YAML::Node YamlReader::take(const std::string& key) {
  const YAML::Node value = node_[key];
  if (!value.IsDefined()) refuse(key, "missing");
  taken_.insert(key);
  return value;
}

double YamlReader::parse(const YAML::Node& node, const std::string& key, double min,
                         double max) const {
  double value = 0;
  try {
    value = node.as<double>();
  } catch (const YAML::Exception&) {
    refuse(key, "not a number");
  }
  if (!(value >= min && value <= max)) {
    std::ostringstream line;
    line << value << " is outside [" << min << ", " << max << "]";
    refuse(key, line.str());
  }
  return value;
}

double YamlReader::number(const std::string& key, double min, double max) {
  return parse(take(key), key, min, max);
}

double YamlReader::number_or(const std::string& key, double otherwise, double min, double max) {
  return has(key) ? number(key, min, max) : otherwise;
}

std::string YamlReader::text(const std::string& key) {
  const YAML::Node value = take(key);
  if (!value.IsScalar()) refuse(key, "must be one word");
  return value.Scalar();
}

std::vector<double> YamlReader::numbers(const std::string& key, size_t count, double min,
                                        double max) {
  const YAML::Node value = take(key);
  if (!value.IsSequence() || value.size() != count) {
    refuse(key, "must be a list of " + std::to_string(count) + " numbers");
  }
  std::vector<double> numbers;
  for (const YAML::Node& entry : value) numbers.push_back(parse(entry, key, min, max));
  return numbers;
}

std::vector<YamlReader> YamlReader::list(const std::string& key, size_t min_count,
                                         size_t max_count) {
  const YAML::Node value = take(key);
  if (!value.IsSequence() || value.size() < min_count || value.size() > max_count) {
    refuse(key, "must be a list of " + std::to_string(min_count) + " to " +
                    std::to_string(max_count) + " maps");
  }
  std::vector<YamlReader> entries;
  for (const YAML::Node& entry : value) {
    const std::string where = where_ + ": " + key + "[" + std::to_string(entries.size()) + "]";
    if (!entry.IsMap()) refuse(key, "must be a list of maps");
    entries.push_back(YamlReader(entry, where));
  }
  return entries;
}

YamlReader YamlReader::map(const std::string& key) {
  const YAML::Node value = take(key);
  if (!value.IsMap()) refuse(key, "must be a map");
  return {value, where_ + ": " + key};
}

void YamlReader::refuse_leftovers() const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.as<std::string>("?");
    if (!taken_.contains(key)) refuse(key, "unknown key");
  }
}

}  // namespace foresight
