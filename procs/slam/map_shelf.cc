#include "procs/slam/map_shelf.h"

#include <algorithm>
#include <filesystem>

#include "common/errors.h"
#include "common/run_identity.h"
#include "procs/slam/map_folder.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLongestName = 64;
// Orders come from a network: they must not be able to fill a disk with maps.
constexpr int kMostMaps = 200;

bool is_ascii_letter_or_digit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

}  // namespace

std::string default_map_root() {
  const std::string data = user_data_folder();
  return data.empty() ? "" : data + "/maps";
}

std::string find_name_trouble(const std::string& name) {
  if (name.empty()) return "needs the name of a map";
  if (name.size() > kLongestName) return "a map's name has at most 64 characters";
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return is_ascii_letter_or_digit(c) || c == '.' || c == '_' || c == '-';
  });
  if (!plain || !is_ascii_letter_or_digit(name[0]) || name.find("..") != std::string::npos) {
    return "a map's name has letters, digits, '.', '_', '-' only, begins with a letter or digit "
           "and "
           "has no '..'";
  }
  return "";
}

MapShelf::MapShelf(const std::string& root) : root_(root.empty() ? default_map_root() : root) {
  if (!root_.empty()) root_ = fs::absolute(root_).lexically_normal().string();
}

void MapShelf::require_root() const {
  if (root_.empty()) throw UnavailableError("no folder for maps: set map_root");
}

void MapShelf::save(const StoredMap& map, const std::string& name) const {
  require_root();
  std::error_code error;
  if (!fs::exists(path(name), error)) {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(root_, error)) {
      count += entry.path().filename().string()[0] != '.';
    }
    if (count >= kMostMaps) {
      throw UnavailableError(root_ + ": holds " + std::to_string(count) + " maps: remove some");
    }
  }
  write_map_folder(map, path(name));
}

StoredMap MapShelf::load(const std::string& name) const {
  require_root();
  return read_map_folder(path(name));
}

}  // namespace foresight
