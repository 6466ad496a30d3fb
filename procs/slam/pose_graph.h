// Pose graph over similarities: after a loop is recognised, the drift that it shows (of place, turn
// and scale: a single camera loses all three) is spread over the keyframes between (Strasdat,
// Montiel and Davison, "Scale drift-aware large scale monocular SLAM", RSS 2010).
//
// Vertex k: S_k, cam from map. Edge (a, b): measured b from a, M. Minimised: Σ w ‖log(M S_a
// S_b⁻¹)‖² by Gauss–Newton with sparse Cholesky; translations count in units of the scene's depth.
// A pure function on copied data; the same problem gives the same bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frames.h"
#include "common/id.h"

namespace foresight::slam {

using VertexId = Id<struct VertexTag>;

struct PoseGraphVertex {
  KeyframeId id;
  Similarity<Cam, Map> cam_from_map;
  double depth = 1;  // typical, of its points; mu
  bool fixed = false;
};

struct PoseGraphEdge {
  VertexId a, b;
  Similarity<Cam, Cam> b_from_a;
  double weight = 1;
};

struct PoseGraph {
  IdVector<VertexId, PoseGraphVertex> vertices;
  std::vector<PoseGraphEdge> edges;
};

struct PoseGraphReport {
  bool usable = false;  // false: singular or not finite; the vertices are as they were
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
};
/// Moves the vertices that are not fixed; at least one has to be.
PoseGraphReport optimize_pose_graph(PoseGraph* graph);

}  // namespace foresight::slam
