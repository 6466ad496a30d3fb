// A triangle mesh in map coordinates (mesher → renderer, message mesh_t) and what is asked of it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/carving_delta.h"

namespace foresight {

struct Mesh {
  std::vector<Eigen::Vector3f> vertices_in_map;
  /// Indices into vertices. Counter-clockwise seen from free space: the normal
  /// (v1−v0)×(v2−v0) points into carved space.
  std::vector<std::array<int32_t, 3>> triangles;
  /// The carving's vertex behind each: geometry that touches a corner of the bounding hull is a
  /// guess, not a measurement. Several vertices may share an id; one that was put in the middle of
  /// an edge carries the smaller id of the two. Same length as vertices_in_map.
  std::vector<VertexId> vertex_ids;
  /// 0…1: how sure the depth of each vertex is, from the number and spread of the observations
  /// behind it (procs/mesher/confidence.h); hull corners 0. Same length as vertices_in_map.
  std::vector<float> confidences;
};

/// Invariants of a mesh that bounds a volume. Edges are undirected pairs of vertices.
struct MeshDefects {
  int64_t bad_indices = 0;         // triangles with an index out of range or repeated
  int64_t boundary_edges = 0;      // edges passed in one direction only: the mesh is not closed
  int64_t non_manifold_edges = 0;  // edges with more than two triangles
  int64_t misoriented_edges = 0;   // edges passed repeatedly one way, less often the other
  bool closed_and_oriented() const {
    return bad_indices == 0 && boundary_edges == 0 && misoriented_edges == 0;
  }
};

/// Checks closedness and orientation. O(n log n).
MeshDefects find_defects(const Mesh& mesh);

/// Writes binary little-endian PLY with per-vertex `id` and `confidence`. Returns an error line, or
/// nothing on success.
[[nodiscard]] std::optional<std::string> write_ply(const Mesh& mesh, const std::string& path);

}  // namespace foresight
