#include "procs/camera/image_list.h"

#include <algorithm>
#include <filesystem>

#include "common/errors.h"
#include "common/text_lines.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

// Images of one video are not a day apart: then the stamps are no seconds.
constexpr Duration kMaxMedianGap = seconds(1e5);

[[noreturn]] void refuse(const std::string& list, int line, const std::string& why) {
  throw ConfigError(list + ":" + std::to_string(line) + ": " + why +
                    " (must be 'seconds file', with increasing seconds)");
}

std::string unquoted(std::string_view name) {
  const bool quoted = name.size() > 1 && name.front() == '"' && name.back() == '"';
  return std::string(quoted ? name.substr(1, name.size() - 2) : name);
}

// Lists that pair images with depth images have four columns.
void check_columns(const std::string& list, const TextLine& line, const fs::path& folder,
                   std::string_view rest, const std::string& path) {
  std::error_code error;
  if (rest.find_first_of(" \t,;") == std::string_view::npos || fs::exists(path, error)) return;
  std::string_view others = rest;
  const std::string first(take_word(&others));
  if (fs::exists(folder / first, error)) {
    refuse(list, line.number, "'" + std::string(others) + "' is too much after " + first);
  }
}

// 0,1 a.jpg: the comma separates second and fraction, not stamp and name.
void check_decimal_comma(const std::string& list, const TextLine& line, size_t stamp_size,
                         std::string_view rest, const std::string& path) {
  std::error_code error;
  const size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  const bool looks_so = stamp_size < line.text.size() && line.text[stamp_size] == ',' &&
                        digits > 0 && digits < rest.size() && rest[digits] == ' ';
  if (looks_so && !fs::exists(path, error)) {
    refuse(list, line.number, "has a decimal comma: write a point");
  }
}

// Names as Windows writes them.
std::string with_slashes(const fs::path& folder, const std::string& name) {
  std::error_code error;
  std::string other = name;
  std::replace(other.begin(), other.end(), '\\', '/');
  const std::string path = (folder / name).string(), turned = (folder / other).string();
  return !fs::exists(path, error) && fs::exists(turned, error) ? turned : path;
}

ListedImage parse(const std::string& list, const TextLine& line, const fs::path& folder) {
  std::string_view rest = line.text;
  const std::string stamp(take_word(&rest));
  const std::optional<Time> time = parse_stamp(stamp);
  if (!time || time->us < 0) refuse(list, line.number, "'" + stamp + "' is no time in seconds");
  if (rest.empty()) refuse(list, line.number, "names no file");
  ListedImage image{*time, with_slashes(folder, unquoted(rest))};
  check_decimal_comma(list, line, stamp.size(), rest, image.path);
  check_columns(list, line, folder, rest, image.path);
  return image;
}

void check_unit(const std::string& list, const std::vector<ListedImage>& images) {
  std::vector<int64_t> gaps_us;
  for (size_t i = 1; i < images.size(); ++i) {
    gaps_us.push_back((images[i].time - images[i - 1].time).us);
  }
  if (gaps_us.empty()) return;
  const auto middle = gaps_us.begin() + static_cast<std::ptrdiff_t>(gaps_us.size() / 2);
  std::nth_element(gaps_us.begin(), middle, gaps_us.end());
  if (*middle <= kMaxMedianGap.us) return;
  throw ConfigError(list + ": its images are " +
                    std::to_string(static_cast<int64_t>(Duration{*middle}.seconds())) +
                    " s apart: are the stamps seconds?");
}

}  // namespace

std::vector<ListedImage> load_image_list(const std::string& list) {
  const fs::path folder = fs::path(list).parent_path();
  std::error_code error;
  if (!fs::is_regular_file(list, error)) {
    throw ConfigError(list +
                      ": cannot be read (a folder needs the TUM layout: rgb.txt with lines " +
                      "'seconds file')");
  }
  std::vector<ListedImage> images;
  for (const TextLine& line : data_lines(list)) {
    const ListedImage image = parse(list, line, folder);
    if (!images.empty() && image.time == images.back().time) {
      refuse(list, line.number, "its time is that of the image above it");
    }
    if (!images.empty() && image.time < images.back().time) {
      refuse(list, line.number, "its time is before that of the image above it");
    }
    images.push_back(image);
  }
  if (images.empty()) throw ConfigError(list + ": lists no frames");
  check_unit(list, images);
  return images;
}

}  // namespace foresight
