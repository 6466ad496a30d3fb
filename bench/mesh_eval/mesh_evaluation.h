// Runs slam, carver and mesher over a real image sequence, deterministically, and compares the
// depth of the mesh, seen from slam's live poses, with the sequence's depth images.
//
// One scale for the whole sequence makes them comparable: the median of measured by estimated depth
// of the map's points (depth_check.h). It does not depend on the mesh, so that two energies are
// judged alike, and needs no true poses; the scale that aligns the trajectory with the truth is
// given beside it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/mesh_eval/depth_score.h"
#include "bench/mesh_eval/mesh_follower.h"
#include "bench/slam_eval/evaluation.h"

namespace foresight {

struct MeshEvaluationOptions {
  SlamOptions slam;
  MeshOptions mesh;
  PlayRange play;               // images
  int every = 1;                // of the depth images
  double least_confidence = 0;  // surface with a vertex below it counts as guessed
};

struct MeshEvaluation {
  std::string sequence;
  double least_confidence = 0;                // that was used
  double metres_per_mu = 0;                   // that was used
  std::optional<double> truth_metres_per_mu;  // of the Sim(3) that aligns the live poses
  DepthScore final_mesh;                      // in the end
  DepthScore live_mesh;                       // the newest that had been sent when the image came
  int points = 0, keyframes = 0, triangles = 0;
  int refused_images = 0;            // of the colour images
  std::vector<std::string> remarks;  // on the images: what was odd, and what was refused
  std::string complaint;             // what could not be used; empty if all could
  // For pictures: the last epoch's.
  Mesh mesh;
  std::vector<MapKeyframe> map_keyframes;
  std::map<Time, Pose<Map, Cam>> poses;  // live, at the times of the scored depth images
};

/// Throws UnavailableError if there is nothing to compare with: no depth images, or no map.
MeshEvaluation evaluate_mesh(const Sequence& sequence, const MeshEvaluationOptions& options);

}  // namespace foresight
