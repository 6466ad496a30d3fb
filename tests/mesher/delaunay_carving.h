// Makes carvings for tests and benchmarks: a Delaunay tetrahedralisation of points that come and
// go, and the CarvingDelta's that a carver would send about it.
#pragma once

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "common/carving_delta.h"

namespace foresight {

class DelaunayCarving {
 public:
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<VertexId, Kernel>;
  struct Count {
    int32_t constraints = 0;
  };
  using CellBase = CGAL::Triangulation_cell_base_with_info_3<Count, Kernel>;
  using Triangulation =
      CGAL::Delaunay_triangulation_3<Kernel,
                                     CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

  /// Vertices −1…−8 at (±half_size, ±half_size, ±half_size).
  void add_hull_corners(float half_size);
  /// Inserts, or moves, a point. Onto a position that is taken already: the point goes away.
  void set_point(VertexId id, const Eigen::Vector3f& position);
  void remove_point(VertexId id);
  void set_point(int32_t id, const Eigen::Vector3f& position) { set_point(VertexId(id), position); }
  void remove_point(int32_t id) { remove_point(VertexId(id)); }

  /// Raises the count of every cell whose interior the segment crosses (bar the few that it meets
  /// in a degenerate way). Lost where the tetrahedralisation changes afterwards.
  void carve_segment(const Eigen::Vector3f& from, const Eigen::Vector3f& to);
  /// Carves about the given share of cells at random; depends on the cells' vertices and the seed.
  void carve_at_random(double share, uint32_t seed);

  /// What changed since the last call, with reused ids; the whole of it the first time.
  CarvingDelta take_delta();
  /// All of it, with ids in a fresh order.
  CarvingDelta snapshot() const;

 private:
  using Corners = std::array<VertexId, 4>;
  struct Sent {
    CellId id;
    int32_t constraints = 0;
    Corners corners{};
    std::array<Eigen::Vector3f, 4> positions;
  };
  static Kernel::Point_3 to_cgal(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }
  Sent describe(Triangulation::Cell_handle cell) const;
  bool still_in_place(const Sent& cell) const;
  CellId take_id();
  void take_vertices(CarvingDelta* delta);

  Triangulation triangulation_;
  std::map<VertexId, Triangulation::Vertex_handle> vertices_;
  std::map<VertexId, Eigen::Vector3f> positions_;
  std::map<VertexId, Eigen::Vector3f> sent_positions_;
  std::map<Corners, Sent> sent_cells_;  // by ascending corners
  std::vector<CellId> free_ids_;
  CellId next_id_{0};
};

/// A lattice of n³ cubes, each cut into six tetrahedra, with constraint counts from `constraints`,
/// called once per cell in order.
template <typename Constraints>
CarvingDelta make_lattice(int32_t n, float spacing, Constraints&& constraints) {
  CarvingDelta delta;
  const auto vertex = [n](int32_t x, int32_t y, int32_t z) {
    return VertexId((z * (n + 1) + y) * (n + 1) + x);
  };
  for (int32_t z = 0; z <= n; ++z) {
    for (int32_t y = 0; y <= n; ++y) {
      for (int32_t x = 0; x <= n; ++x) {
        const Eigen::Vector3f p(static_cast<float>(x), static_cast<float>(y),
                                static_cast<float>(z));
        delta.vertices_set.push_back({vertex(x, y, z), p * spacing});
      }
    }
  }
  // One tetrahedron per order in which the three axes are walked from corner 000 to corner 111.
  constexpr std::array<std::array<int32_t, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int32_t cube = 0; cube < n * n * n; ++cube) {
    for (size_t o = 0; o < kOrders.size(); ++o) {
      std::array<int32_t, 3> at = {cube % n, cube / n % n, cube / n / n};
      CarvingCell cell;
      cell.id = CellId::at(delta.cells_added.size());
      cell.vertices[0] = vertex(at[0], at[1], at[2]);
      for (size_t step = 0; step < 3; ++step) {
        ++at[static_cast<size_t>(kOrders[o][step])];
        cell.vertices[step + 1] = vertex(at[0], at[1], at[2]);
      }
      if (o >= 3) std::swap(cell.vertices[2], cell.vertices[3]);
      cell.constraints = constraints();
      delta.cells_added.push_back(cell);
    }
  }
  return delta;
}

}  // namespace foresight
