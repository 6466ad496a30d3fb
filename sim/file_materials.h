// The materials of a scene file as textures of a Scene: pictures from files or from within the
// scene file, shrunk where they are too large, plain colours where there is none.
#pragma once

#include <string>
#include <vector>

#include "sim/scene.h"

struct aiScene;

namespace foresight::sim {

struct FileMaterial {
  int texture = 0;
  bool glass = false;  // hardly to be seen
};

struct FileMaterials {
  std::vector<FileMaterial> materials;  // as in the file
  int textures_read = 0;
  int textures_missing = 0;
  std::vector<std::string> warnings;
};

struct MaterialOptions {
  std::string folder;         // that the file's texture names start from
  int max_texture_px = 2048;  // of a side
  bool linear_colours = false;
};

/// Adds textures to the scene. A picture that cannot be read is a warning; its material gets the
/// plain colour. All textures together take 350 MB at most: once that is used up, they get smaller.
FileMaterials read_materials(const aiScene& file, const MaterialOptions& options, Scene& scene);

}  // namespace foresight::sim
