// rgb.txt and depth.txt of a folder in TUM RGB-D layout: 'seconds file' per line.
#pragma once

#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

struct ListedImage {
  Time time;
  std::string path;
};

/// Stamps as parse_stamp() reads them (common/text_lines.h); they must increase. The file's name is
/// the rest of the line, so it may hold blanks, and may stand in quotes; relative names count from
/// the list's folder. Throws ConfigError with list, line and cause; that the images exist is not
/// asked here.
std::vector<ListedImage> load_image_list(const std::string& list);

}  // namespace foresight
