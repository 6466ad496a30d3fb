// Carver::validate: an independent, slow check of every invariant.
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <algorithm>

#include "procs/carver/carver_impl.h"

namespace foresight {
namespace {

using carving::Cell;
using carving::CellState;
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
bool crosses_interior(const carving::CellComplex& complex, const Cell& cell, const Point3& from,
                      const Point3& to) {
  Exact low = 0, high = 1;
  for (int i = 0; i < 4; ++i) {
    const int sign_from = barycentric_sign(complex, cell, i, from);
    const int sign_to = barycentric_sign(complex, cell, i, to);
    if (sign_from <= 0 && sign_to <= 0) return false;
    if (sign_from >= 0 && sign_to >= 0) continue;
    std::array<const Point3*, 4> corners{};
    for (size_t k = 0; k < 4; ++k) {
      corners[k] = &complex.positions[static_cast<size_t>(cell.vertices[k])];
    }
    corners[static_cast<size_t>(i)] = &from;
    const Exact at_from = volume(corners);
    corners[static_cast<size_t>(i)] = &to;
    const Exact crossing = at_from / (at_from - volume(corners));
    if (sign_from < 0) low = std::max(low, crossing);
    if (sign_from > 0) high = std::min(high, crossing);
  }
  return low < high;
}

std::string to_text(const std::vector<int32_t>& numbers) {
  std::string text;
  for (const int32_t number : numbers) text += " " + std::to_string(number);
  return text;
}

}  // namespace

std::string Carver::Impl::validate() const {
  if (std::string problem = delaunay.validate(); !problem.empty()) return problem;
  if (!delaunay.built()) return "";
  const auto& complex = delaunay.complex();
  const auto limit = static_cast<size_t>(std::max(0, options.max_constraints_per_cell));
  size_t pairs = 0, ends = 0;
  for (size_t id = 0; id < complex.cells.size(); ++id) {
    if (complex.states[id] != CellState::kKept) continue;
    const std::string name = "cell " + std::to_string(id);
    std::vector<int32_t> listed, ended, expected;
    for (const uint32_t entry : tracer.lists().entries(static_cast<int32_t>(id))) {
      const int32_t ray = carving::entry_ray(entry);
      const bool is_end = carving::entry_code(entry) == carving::kEntryEnd;
      if (is_end && map.rays[static_cast<size_t>(ray)].behind != static_cast<int32_t>(id)) {
        return name + ": lists the end of a ray that ends elsewhere";
      }
      (is_end ? ended : listed).push_back(ray);
    }
    std::sort(listed.begin(), listed.end());
    for (size_t ray = 0; ray < map.rays.size(); ++ray) {
      const carving::RayRecord& record = map.rays[ray];
      if (record.state != carving::RayState::kTraced) continue;
      const auto& from = map.keyframes[static_cast<size_t>(record.keyframe)].centre;
      const auto& to = map.points[static_cast<size_t>(record.point)].position;
      if (crosses_interior(complex, complex.cells[id], from, to)) {
        expected.push_back(static_cast<int32_t>(ray));
      }
    }
    pairs += listed.size();
    ends += ended.size();
    if (limit == 0 && listed != expected) {
      return name + ": lists rays" + to_text(listed) + ", brute force says" + to_text(expected);
    }
    if (!std::includes(expected.begin(), expected.end(), listed.begin(), listed.end())) {
      return name + ": lists a constraint that does not cross it";
    }
    if (limit > 0 && listed.size() > limit) return name + ": list longer than its bound";
  }
  if (static_cast<int64_t>(pairs) != tracer.lists().pairs()) return "wrong number of pairs";
  const auto expected_ends = std::count_if(map.rays.begin(), map.rays.end(), [&](const auto& ray) {
    const bool has_length = map.keyframes[static_cast<size_t>(ray.keyframe)].centre !=
                            map.points[static_cast<size_t>(ray.point)].position;
    return ray.state == carving::RayState::kTraced && has_length;
  });
  if (static_cast<int64_t>(ends) != expected_ends) return "wrong number of ends";
  return "";
}

}  // namespace foresight
