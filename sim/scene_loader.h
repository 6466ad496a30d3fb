// Scenes from files: textured OBJ (with MTL), glTF and GLB, as a Scene for the ray-traced camera.
//
//   Scene shop = load_scene("bookstore/scene.obj");
//   LoadReport report;
//   Scene hall = load_scene("hall.glb", {.scale = 0.01}, &report);   // the file is in centimetres
//   for (const std::string& line : report.warnings) …
//
// World is the arm's base frame, as in lab.h: unless a pose is given, the file's floor comes to
// kFloor_m, and the arm to a free spot with something to look at 0.6 to 2 m in front of it (+x).
// Diffuse textures and colours only; what is nearly transparent is left out; lamps are put under
// the ceiling, or above what has none, and light and shadows are baked. Around it all stands a
// plain pale backdrop, so that windows and missing ceilings are not black. Same file, same scene.
//
// 117 000 triangles: about 4 s and 200 MB. At most 1 million triangles.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/frames.h"
#include "sim/scene.h"

namespace foresight::sim {

/// The coordinates of a scene file, turned z up and in metres.
struct SceneFile {};

struct LoadOptions {
  enum class Up {
    kAuto,  // y for glTF (its standard says so); for OBJ the axis with the larger floor
    kY,
    kZ,
  };
  Up up = Up::kAuto;
  double scale = 1;  // metres per unit of the file
  /// Where the scene stands; absent: chosen as described above.
  std::optional<Pose<World, SceneFile>> world_from_file;
  int max_texture_px = 2048;  // of a side; larger ones are shrunk
  bool bake = true;           // false: evenly lit, at once
};

struct LoadReport {
  int triangles = 0;
  int left_out = 0;  // triangles without area or with coordinates that are not finite, and glass
  int textures = 0;  // read from files
  int missing_textures = 0;
  Pose<World, SceneFile> world_from_file;
  std::vector<std::string> warnings;  // one line each: textures that could not be read
};

/// Throws UnavailableError where the file cannot be read, ConfigError where it is no scene, has no
/// triangle or too many, or an option makes no sense; both say so in one line.
Scene load_scene(const std::string& path, const LoadOptions& options = {},
                 LoadReport* report = nullptr);

}  // namespace foresight::sim
