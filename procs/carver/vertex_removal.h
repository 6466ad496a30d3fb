// Takes an inner vertex out of a Delaunay triangulation, several times faster than CGAL does.
//
// The cells around the vertex leave a hole that is filled facet by facet: of the vertices around
// it, the one whose sphere through the facet is empty makes the next cell. It is chosen in floating
// point; what came out is then proven exactly, before anything is changed:
//   · every new cell is positively oriented and all facets match, so together they cover the hole
//     once (the boundary of their sum is the boundary of the hole),
//   · every facet, also the hole's, is locally Delaunay, so the triangulation is Delaunay.
// With CGAL's symbolic perturbation it is unique, hence the same that CGAL would have made.
//
// Source: the idea of filling the star of the vertex by its link: Devillers and Teillaud,
// "Perturbations for Delaunay and weighted Delaunay 3D triangulations", 2011.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "procs/carver/cgal_delaunay.h"

namespace foresight::carving {

class VertexRemoval {
 public:
  /// `star`: all cells at the vertex, none of them infinite. Returns whether the vertex is gone; if
  /// not (rounding misled the choice, or the star is huge) nothing has changed and CGAL's own
  /// removal must do it.
  bool remove(Triangulation& triangulation, VertexHandle vertex, std::span<const CellHandle> star);

 private:
  static constexpr size_t kMaxCorners = 1000;  // packed in 10 bits

  /// A vertex around the hole, by its place in corners_.
  using CornerIndex = Id<struct HoleCornerTag>;
  using Triangle = std::array<CornerIndex, 3>;
  using HoleCell = std::array<CornerIndex, 4>;

  // A facet that has a cell on one side only; `corners` are counter-clockwise for who looks from
  // that cell, so that the wanted vertex is on their positive side.
  struct OpenFacet {
    Triangle corners{};
    int side = 0;  // the facet's number, see below
  };
  struct Corner {
    VertexHandle vertex;
    std::array<double, 3> at{};  // relative to the vertex that goes
  };
  // Facets by number: 4 · new cell + index, or −1 − (place in border_).
  struct BorderFacet {
    CellHandle outer;
    int index = 0;
  };

  void collect_border(VertexHandle vertex, std::span<const CellHandle> star);
  CornerIndex corner_of(VertexHandle vertex, const Kernel::Point_3& origin);
  bool fill(const Triangulation& triangulation);
  bool close_facets(int cell);
  bool close_or_open(const Triangle& corners, int side);
  CornerIndex apex_over(const Triangulation& triangulation, const Triangle& facet);
  CornerIndex best_of_close(const Triangulation& triangulation, const Triangle& facet) const;
  bool proven(const Triangulation& triangulation) const;
  bool locally_delaunay(const Triangulation& triangulation, int cell, int index) const;
  void commit(Triangulation& triangulation, VertexHandle vertex, std::span<const CellHandle> star);
  void pair(int side, int other);
  const Kernel::Point_3& point(CornerIndex corner) const {
    return corners_[corner].vertex->point();
  }

  IdVector<CornerIndex, Corner> corners_;
  IdVector<VertexIndex, CornerIndex> corner_by_vertex_;  // none outside of remove()
  std::vector<BorderFacet> border_;
  std::vector<OpenFacet> open_;
  std::vector<uint32_t> open_keys_;  // parallel: the corners without their order
  std::vector<HoleCell> cells_;
  std::vector<int> mates_;          // by side: the facet's number on the other side
  std::vector<CornerIndex> close_;  // scratch: candidates that floating point cannot tell apart
};

}  // namespace foresight::carving
