// Strict reading of small YAML description files: what is missing, unknown, of the wrong type or
// out of range is refused with one line that names file, key and limit.
//
//   YamlReader file = YamlReader::open(path);       // throws ConfigError
//   const double mass = file.number("mass_kg", 0, 100);
//   for (YamlReader& joint : file.list("joints", 1, 7)) …
//   file.refuse_leftovers();
#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>
#include <vector>

namespace foresight {

class YamlReader {
 public:
  /// A file that holds one map. A relative path that does not exist here is looked for in the
  /// checkout, so that defaults like deploy/arms/wam4.yaml work from every folder. OpenCV's first
  /// line "%YAML:1.0" is passed over.
  static YamlReader open(const std::string& path);

  bool has(const std::string& key) const;
  double number(const std::string& key, double min, double max);
  double number_or(const std::string& key, double otherwise, double min, double max);
  std::string text(const std::string& key);
  /// A list of numbers, `count` of them.
  std::vector<double> numbers(const std::string& key, size_t count, double min, double max);
  /// A list of maps.
  std::vector<YamlReader> list(const std::string& key, size_t min_count, size_t max_count);
  YamlReader map(const std::string& key);
  /// Throws for the first key that nobody asked for.
  void refuse_leftovers() const;
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const;

 private:
  YamlReader(YAML::Node node, std::string where)
      : node_(std::move(node)), where_(std::move(where)) {}
  YAML::Node take(const std::string& key);
  double parse(const YAML::Node& node, const std::string& key, double min, double max) const;

  YAML::Node node_;
  std::string where_;  // file and the path of keys to this map
  std::set<std::string> taken_;
};

}  // namespace foresight
