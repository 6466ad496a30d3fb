// Carver::validate: an independent, slow check of every invariant.
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <algorithm>

#include "procs/carver/carver_impl.h"

namespace foresight {
namespace {

using carving::Cell;
using carving::CellState;
using carving::ConstraintIndex;
using carving::Entry;
using carving::Point3;
using Exact = CGAL::Exact_predicates_exact_constructions_kernel::FT;

// det[b−a, c−a, d−a], exactly.
Exact volume(const std::array<const Point3*, 4>& corners) {
  std::array<std::array<Exact, 3>, 3> rows;
  for (size_t r = 0; r < 3; ++r) {
    for (size_t i = 0; i < 3; ++i) {
      rows[r][i] = Exact((*corners[r + 1])[i]) - Exact((*corners[0])[i]);
    }
  }
  return CGAL::determinant(rows[0][0], rows[0][1], rows[0][2], rows[1][0], rows[1][1], rows[1][2],
                           rows[2][0], rows[2][1], rows[2][2]);
}

// Clips the segment with the four facets' half spaces in exact arithmetic: is more than a point
// left? (The interior of a convex cell is crossed exactly then, unless the rest lies in a facet.)
bool crosses_interior(const carving::Tetrahedra& tetrahedra, const Cell& cell, const Point3& from,
                      const Point3& to) {
  Exact low = 0, high = 1;
  for (int i = 0; i < 4; ++i) {
    const int sign_from = barycentric_sign(tetrahedra, cell, i, from);
    const int sign_to = barycentric_sign(tetrahedra, cell, i, to);
    if (sign_from <= 0 && sign_to <= 0) return false;
    if (sign_from >= 0 && sign_to >= 0) continue;
    std::array<const Point3*, 4> corners{};
    for (size_t k = 0; k < 4; ++k) {
      corners[k] = &tetrahedra.positions[cell.vertices[k]];
    }
    corners[i] = &from;
    const Exact at_from = volume(corners);
    corners[i] = &to;
    const Exact crossing = at_from / (at_from - volume(corners));
    if (sign_from < 0) low = std::max(low, crossing);
    if (sign_from > 0) high = std::min(high, crossing);
  }
  return low < high;
}

std::string to_text(const std::vector<ConstraintIndex>& constraints) {
  std::string text;
  for (const ConstraintIndex constraint : constraints) {
    text += " " + std::to_string(constraint.value());
  }
  return text;
}

}  // namespace

std::string Carver::Impl::validate() const {
  if (std::string problem = delaunay.validate(); !problem.empty()) return problem;
  if (!delaunay.built()) return "";
  const auto& tetrahedra = delaunay.tetrahedra();
  const size_t limit = std::max(0, options.max_constraints_per_cell);
  int64_t pairs = 0, ends = 0;
  for (const CellId id : tetrahedra.cells.ids()) {
    if (tetrahedra.states[id] != CellState::kKept) continue;
    const std::string name = "cell " + std::to_string(id.value());
    std::vector<ConstraintIndex> listed, ended, expected;
    for (const Entry entry : tracer.lists().entries(id)) {
      const ConstraintIndex constraint = entry.constraint();
      const bool is_end = entry.code() == carving::kEntryEnd;
      if (is_end && map.constraints[constraint].behind != id) {
        return name + ": lists the end of a constraint that ends elsewhere";
      }
      (is_end ? ended : listed).push_back(constraint);
    }
    std::sort(listed.begin(), listed.end());
    for (const ConstraintIndex constraint : map.constraints.ids()) {
      const carving::ConstraintRecord& record = map.constraints[constraint];
      if (record.state != carving::ConstraintState::kTraced) continue;
      const auto& from = map.keyframes[record.keyframe].centre;
      const auto& to = map.points[record.point].position;
      if (crosses_interior(tetrahedra, tetrahedra.cells[id], from, to)) {
        expected.push_back(constraint);
      }
    }
    pairs += listed.size();
    ends += ended.size();
    if (limit == 0 && listed != expected) {
      return name + ": lists constraints" + to_text(listed) + ", brute force says" +
             to_text(expected);
    }
    if (!std::includes(expected.begin(), expected.end(), listed.begin(), listed.end())) {
      return name + ": lists a constraint that does not cross it";
    }
    if (limit > 0 && listed.size() > limit) return name + ": list longer than its bound";
  }
  if (pairs != tracer.lists().pairs()) return "wrong number of pairs";
  const auto expected_ends =
      std::count_if(map.constraints.begin(), map.constraints.end(), [&](const auto& constraint) {
        const bool has_length =
            map.keyframes[constraint.keyframe].centre != map.points[constraint.point].position;
        return constraint.state == carving::ConstraintState::kTraced && has_length;
      });
  if (ends != expected_ends) return "wrong number of ends";
  return "";
}

}  // namespace foresight
