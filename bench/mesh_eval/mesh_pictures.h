// What a mesh looks like, for people: rows of views from slam's live poses (the camera's image, the
// mesh lit from the camera, the mesh painted with earlier images, the error of its depth) and the
// whole from outside.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "bench/mesh_eval/mesh_evaluation.h"

namespace foresight {

enum class PictureOf {
  kMeshAndImages,
  kMeshAlone,  // nothing of the sequence's images, which may not be passed on
};

/// BGR. Three rows, spread over the sequence, and one from outside; nothing to see: empty.
cv::Mat draw_mesh(const Sequence& sequence, const MeshEvaluation& evaluation, PictureOf what);

/// The same as a file. Throws UnavailableError if it cannot be written.
void write_mesh_picture(const Sequence& sequence, const MeshEvaluation& evaluation, PictureOf what,
                        const std::string& path);

}  // namespace foresight
