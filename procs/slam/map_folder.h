// A map as a folder: a COLMAP text model that other tools read, and one file more for what COLMAP
// has no place for.
//
//   cameras.txt, images.txt, points3D.txt   COLMAP (ids + 1; pixels + 0.5; positions in map units)
//   images/<keyframe id>.png                gray, lossless
//   trajectory.txt                          the keyframes' poses in TUM's format (camera to map):
//                                           "time tx ty tz qx qy qz qw", s and map units
//   foresight.txt                           depths, times, levels, sources, histories
//
// Numbers are written so that reading gives the same bits: a map that is loaded tracks as the one
// that was saved.
#pragma once

#include <string>

#include "procs/slam/stored_map.h"

namespace foresight {

/// Writes into a new folder beside it and puts that in the place of `folder`, which must not exist,
/// be empty or be a map folder. Throws UnavailableError that names the file; nothing is lost then.
void write_map_folder(const StoredMap& map, const std::string& folder);

/// Throws ConfigError with file, line and what is wrong: nothing is believed that does not fit
/// together.
StoredMap read_map_folder(const std::string& folder);

}  // namespace foresight
