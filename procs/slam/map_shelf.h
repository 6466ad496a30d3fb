// Where saved maps lie: folders below one root, by name. A message can name nothing outside it.
#pragma once

#include <string>

#include "procs/slam/stored_map.h"

namespace foresight {

/// $XDG_DATA_HOME/foresight/maps, else ~/.local/share/foresight/maps: maps are a person's data, the
/// same whatever checkout or working directory slam runs in. Empty when there is no home.
std::string default_map_root();

/// Why `name` is no name of a map, as one line; empty when it is one: 1 to 64 of A-Z a-z 0-9 . _ -,
/// beginning with a letter or digit, without "..".
std::string find_name_trouble(const std::string& name);

class MapShelf {
 public:
  /// The root need not exist yet; empty: the default.
  explicit MapShelf(const std::string& root);
  const std::string& root() const { return root_; }

  /// Both throw StartupError with one line. `name` must be one (above).
  void save(const StoredMap& map, const std::string& name) const;
  StoredMap load(const std::string& name) const;
  std::string path(const std::string& name) const { return root_ + "/" + name; }

 private:
  void require_root() const;
  std::string root_;
};

}  // namespace foresight
