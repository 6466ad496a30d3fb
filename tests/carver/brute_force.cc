#include "tests/carver/brute_force.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Interval_nt.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>
#include <optional>
#include <tuple>

namespace foresight::carver_test {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Rational = CGAL::Exact_rational;
using Interval = CGAL::Interval_nt_advanced;  // encloses the exact number
using Triangulation = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<
                CGAL::Triangulation_vertex_base_with_info_3<VertexId, Kernel>>>;

struct Segment {
  Point from, to;
};

// Six times the signed volume of abcp: the height of `p` over abc times twice its area.
template <class Number>
Number height(const Point& a, const Point& b, const Point& c, const Point& p) {
  std::array<std::array<Number, 3>, 3> m;
  const std::array<const Point*, 3> others{&b, &c, &p};
  for (size_t r = 0; r < 3; ++r) {
    for (int i = 0; i < 3; ++i) {
      m[r][static_cast<size_t>(i)] = Number((*others[r])[i]) - Number(a[i]);
    }
  }
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Of the ends of a segment, for each facet: strictly on its outer side. (Where one end is on the
// plane, t is 0 or 1: no limit.)
struct Outside {
  std::array<bool, 4> from{}, to{};
};

// Is there a t in (0, 1) with from + t (to − from) strictly inside all four facets? None: cannot
// tell. t where the segment meets a plane is a fraction, kept with a positive denominator.
template <class Number>
std::optional<bool> clip(const std::array<Point, 4>& cell, const Segment& segment,
                         const Outside& outside) {
  Number low(0), low_denominator(1), high(1), high_denominator(1);
  for (size_t i = 0; i < 4; ++i) {
    if (outside.from[i] == outside.to[i]) continue;
    const Point &a = cell[(i + 1) % 4], &b = cell[(i + 2) % 4], &c = cell[(i + 3) % 4];
    const Number at_from = height<Number>(a, b, c, segment.from);
    const Number at_to = height<Number>(a, b, c, segment.to);
    const Number size = CGAL::abs(at_from), denominator = size + CGAL::abs(at_to);
    const auto is_later = size * low_denominator > low * denominator;
    const auto is_earlier = size * high_denominator < high * denominator;
    if (!CGAL::is_certain(is_later) || !CGAL::is_certain(is_earlier)) return std::nullopt;
    if (outside.from[i] && CGAL::get_certain(is_later)) {
      low = size;
      low_denominator = denominator;
    } else if (outside.to[i] && CGAL::get_certain(is_earlier)) {
      high = size;
      high_denominator = denominator;
    }
  }
  const auto is_left = low * high_denominator < high * low_denominator;
  if (!CGAL::is_certain(is_left)) return std::nullopt;
  return CGAL::get_certain(is_left);
}

bool crosses(const std::array<Point, 4>& cell, const Segment& segment) {
  Outside outside;
  for (size_t i = 0; i < 4; ++i) {
    const Point &a = cell[(i + 1) % 4], &b = cell[(i + 2) % 4], &c = cell[(i + 3) % 4];
    const auto inside = CGAL::orientation(a, b, c, cell[i]);
    const auto from = CGAL::orientation(a, b, c, segment.from);
    const auto to = CGAL::orientation(a, b, c, segment.to);
    if (from != inside && to != inside) return false;
    outside.from[i] = from == -inside;
    outside.to[i] = to == -inside;
  }
  {
    const CGAL::Protect_FPU_rounding<true> upwards;
    const std::optional<bool> quick = clip<Interval>(cell, segment, outside);
    if (quick) return *quick;
  }
  return *clip<Rational>(cell, segment, outside);
}

// Which facet (opposite corner k) does the segment come in by, strictly inside it? −1: none.
int entry_facet(const std::array<Point, 4>& cell, const Segment& segment) {
  for (size_t k = 0; k < 4; ++k) {
    const std::array<const Point*, 3> f{&cell[(k + 1) % 4], &cell[(k + 2) % 4], &cell[(k + 3) % 4]};
    const auto inside = CGAL::orientation(*f[0], *f[1], *f[2], cell[k]);
    if (CGAL::orientation(*f[0], *f[1], *f[2], segment.from) != -inside) continue;
    if (CGAL::orientation(*f[0], *f[1], *f[2], segment.to) != inside) continue;
    const auto turn = [&](size_t n) {
      return CGAL::orientation(segment.from, segment.to, *f[n], *f[(n + 1) % 3]);
    };
    if (turn(0) != CGAL::ZERO && turn(0) == turn(1) && turn(1) == turn(2)) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

// The camera is inside, or on the border and the segment sets out into the cell.
bool starts_in(const std::array<Point, 4>& cell, const Segment& segment) {
  for (size_t k = 0; k < 4; ++k) {
    const Point &a = cell[(k + 1) % 4], &b = cell[(k + 2) % 4], &c = cell[(k + 3) % 4];
    const auto inside = CGAL::orientation(a, b, c, cell[k]);
    const auto from = CGAL::orientation(a, b, c, segment.from);
    if (from == -inside) return false;
    if (from == CGAL::ZERO && CGAL::orientation(a, b, c, segment.to) != inside) return false;
  }
  return true;
}

// The segment ends at a corner and would go on into the cell; closed: or along its border.
bool ends_before(const std::array<Point, 4>& cell, const Segment& segment, bool closed) {
  if (segment.from == segment.to) return false;
  const auto corner = std::find(cell.begin(), cell.end(), segment.to);
  if (corner == cell.end()) return false;
  for (size_t k = 0; k < 4; ++k) {
    if (&cell[k] == &*corner) continue;
    const Point &a = cell[(k + 1) % 4], &b = cell[(k + 2) % 4], &c = cell[(k + 3) % 4];
    const auto inside = CGAL::orientation(a, b, c, cell[k]);
    const auto from = CGAL::orientation(a, b, c, segment.from);
    if (from == inside || (from == CGAL::ZERO && !closed)) return false;
  }
  return true;
}

CellFacts facts_of(const std::array<Point, 4>& cell, const std::vector<Segment>& segments) {
  CellFacts facts{0, {}};
  for (const Segment& segment : segments) {
    if (!crosses(cell, segment)) continue;
    ++facts.constraints;
    const int facet = entry_facet(cell, segment);
    if (facet >= 0) ++facts.votes.entered[static_cast<size_t>(facet)];
    if (facet < 0 && starts_in(cell, segment)) ++facts.votes.started;
  }
  return facts;
}

Point to_point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

std::map<VertexId, VertexEvidence> evidence_by_brute_force(const MapModel& map) {
  std::map<std::array<float, 3>, std::vector<PointId>> points;  // by position, ascending ids
  for (const auto& [id, p] : map.points) points[{p.x() + 0, p.y() + 0, p.z() + 0}].push_back(id);
  std::map<VertexId, VertexEvidence> all;
  for (int32_t n = 0; n < VertexId::kHullCorners; ++n) all[VertexId::hull_corner(n)] = {};
  for (const auto& [position, ids] : points) {
    VertexEvidence& evidence = all[VertexId(ids.front())];
    std::vector<Eigen::Vector3d> directions;
    for (const MapObservation& seen : map.observations) {
      if (std::find(ids.begin(), ids.end(), seen.point_id) == ids.end()) continue;
      ++evidence.observations;
      const Eigen::Vector3d d =
          map.cameras.at(seen.keyframe_id) - map.points.at(seen.point_id).cast<double>();
      if (d.norm() > 0) directions.push_back(d.normalized());
    }
    for (const auto& a : directions) {
      for (const auto& b : directions) {
        const double angle = 2 * std::asin(std::min(1.0, (a - b).norm() / 2));
        evidence.spread_rad = std::max(evidence.spread_rad, static_cast<float>(angle));
      }
    }
  }
  return all;
}

std::string differences(const std::map<VertexId, VertexEvidence>& actual, const MapModel& map) {
  const auto expected = evidence_by_brute_force(map);
  if (actual.size() != expected.size()) return "wrong number of vertices";
  for (const auto& [id, evidence] : actual) {
    const std::string name = "vertex " + std::to_string(id.value());
    const auto at = expected.find(id);
    if (at == expected.end()) return name + " should not exist";
    if (evidence.observations != at->second.observations) return name + ": observations";
    const auto chord = [](float angle) { return 2 * std::sin(angle / 2); };
    const float share = chord(evidence.spread_rad) - chord(at->second.spread_rad);
    if (share > 1e-5f || share < -0.12f * chord(at->second.spread_rad) - 1e-5f) {
      return name + ": spread " + std::to_string(evidence.spread_rad) + " not " +
             std::to_string(at->second.spread_rad);
    }
  }
  return "";
}

Carving carve_by_brute_force(const MapModel& map,
                             const std::map<VertexId, Eigen::Vector3f>& vertices) {
  Triangulation triangulation;
  const auto insert = [&](VertexId id, const Eigen::Vector3f& position) {
    const size_t before = triangulation.number_of_vertices();
    const auto vertex = triangulation.insert(to_point(position.cast<double>()));
    if (triangulation.number_of_vertices() > before) vertex->info() = id;
  };
  // Ascending ids: the smallest of coincident points names the vertex.
  for (const auto& [id, position] : vertices) {
    if (!id.is_point()) insert(id, position);
  }
  for (const auto& [id, position] : map.points) insert(VertexId(id), position);
  std::vector<Segment> segments;
  for (const MapObservation& seen : map.observations) {
    segments.push_back({to_point(map.cameras.at(seen.keyframe_id)),
                        to_point(map.points.at(seen.point_id).cast<double>())});
  }
  Carving carving;
  std::map<std::array<Point, 4>, std::array<VertexId, 4>> keys;  // by the corners in order
  std::vector<std::array<Point, 4>> cells;
  for (const auto cell : triangulation.finite_cell_handles()) {
    std::array<std::pair<VertexId, Point>, 4> corners;
    for (size_t i = 0; i < 4; ++i) {
      const auto vertex = cell->vertex(static_cast<int>(i));
      corners[i] = {vertex->info(), vertex->point()};
    }
    std::sort(corners.begin(), corners.end());
    std::array<VertexId, 4> key{};
    std::array<Point, 4> points;
    for (size_t i = 0; i < 4; ++i) std::tie(key[i], points[i]) = corners[i];
    carving[key] = facts_of(points, segments);
    std::sort(points.begin(), points.end());
    keys[points] = key;
    cells.push_back(points);
  }
  std::sort(cells.begin(), cells.end());
  for (const Segment& segment : segments) {
    const auto strict = std::find_if(cells.begin(), cells.end(), [&](const auto& cell) {
      return ends_before(cell, segment, false);
    });
    const auto tied = std::find_if(cells.begin(), cells.end(), [&](const auto& cell) {
      return ends_before(cell, segment, true);
    });
    const auto behind = strict != cells.end() ? strict : tied;
    if (behind != cells.end()) ++carving[keys.at(*behind)].votes.ended;
  }
  return carving;
}

}  // namespace foresight::carver_test
