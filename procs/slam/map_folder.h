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

#include <filesystem>
#include <map>
#include <string>

#include "procs/slam/folder_swap.h"
#include "procs/slam/stored_map.h"

namespace foresight {

/// Writes into a new folder beside it and puts that in the place of `folder`, which must not exist,
/// be empty or be a map folder in which nobody else has put anything. Throws UnavailableError that
/// names the file; nothing is lost then.
void write_map_folder(const StoredMap& map, const std::string& folder);

/// Throws ConfigError with file, line and what is wrong: nothing is believed that does not fit
/// together.
StoredMap read_map_folder(const std::string& folder);

/// The files of a map folder: those that its foresight.txt names.
IsOwn own_map_files(const std::filesystem::path& folder);

/// Images that lie in a folder already: they are linked instead of written again. A keyframe's id
/// and time name its image.
struct WrittenImages {
  std::string folder;
  std::map<KeyframeId, Time> times;  // by keyframe
};
WrittenImages written_images(const StoredMap& map, const std::string& folder);

/// Only what read_map_folder() needs, into a folder that is there.
void write_core_files(const StoredMap& map, const std::filesystem::path& part,
                      const WrittenImages& earlier);

}  // namespace foresight
