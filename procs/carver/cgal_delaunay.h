// CGAL's Delaunay triangulation as the carver uses it: vertices and cells bear our numbers.
#pragma once

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "procs/carver/tetrahedra.h"

namespace foresight::carving {

inline constexpr CellId kUnnumbered{};
inline constexpr CellId kOutside{-2};  // infinite cells; they never change: all points are inside

struct CellNumber {
  CellId id = kUnnumbered;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<VertexIndex, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<CellNumber, Kernel,
                                              CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Structure = CGAL::Triangulation_data_structure_3<VertexBase, CellBase>;

class Triangulation : public CGAL::Delaunay_triangulation_3<Kernel, Structure> {
 public:
  /// Whether `p` is inside the sphere through the four corners of a positively oriented cell.
  /// Never undecided: where five points are cospherical, CGAL's symbolic perturbation decides.
  bool in_sphere(const Point& a, const Point& b, const Point& c, const Point& d,
                 const Point& p) const {
    return side_of_oriented_sphere(a, b, c, d, p, true) == CGAL::ON_POSITIVE_SIDE;
  }
};

using CellHandle = Triangulation::Cell_handle;
using VertexHandle = Triangulation::Vertex_handle;

}  // namespace foresight::carving
