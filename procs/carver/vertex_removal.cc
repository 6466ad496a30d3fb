#include "procs/carver/vertex_removal.h"

#include <algorithm>
#include <limits>

namespace foresight::carving {
namespace {

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Facet i of a positively oriented cell: points beyond it are on the positive side of these.
constexpr int kOutward[4][3] = {{1, 2, 3}, {2, 0, 3}, {0, 1, 3}, {1, 0, 2}};

template <class Corner>
uint32_t key_of(std::array<Corner, 3> corners) {
  std::sort(corners.begin(), corners.end());
  return corners[0].value() | corners[1].value() << 10 | corners[2].value() << 20;
}

// Whether two orders of the same three corners are the same up to rotation.
template <class Corner>
bool same_turn(const std::array<Corner, 3>& a, const std::array<Corner, 3>& b) {
  const size_t n = a[0] == b[0] ? 0 : a[0] == b[1] ? 1 : 2;
  return a[1] == b[(n + 1) % 3];
}

}  // namespace

bool VertexRemoval::remove(Triangulation& triangulation, VertexHandle vertex,
                           std::span<const CellHandle> star) {
  corners_.clear();
  border_.clear();
  open_.clear();
  open_keys_.clear();
  cells_.clear();
  mates_.clear();
  collect_border(vertex, star);
  for (const Corner& corner : corners_) {
    corner_by_vertex_[corner.vertex->info()] = CornerIndex();
  }
  if (corners_.size() > kMaxCorners || !fill(triangulation) || !proven(triangulation)) return false;
  commit(triangulation, vertex, star);
  return true;
}

VertexRemoval::CornerIndex VertexRemoval::corner_of(VertexHandle vertex,
                                                    const Kernel::Point_3& origin) {
  corner_by_vertex_.grow_to(vertex->info());
  CornerIndex& corner = corner_by_vertex_[vertex->info()];
  if (!corner.is_valid()) {
    const Kernel::Point_3& p = vertex->point();
    corner =
        corners_.push_back({vertex, {p.x() - origin.x(), p.y() - origin.y(), p.z() - origin.z()}});
  }
  return corner;
}

void VertexRemoval::collect_border(VertexHandle vertex, std::span<const CellHandle> star) {
  for (const CellHandle cell : star) {
    const int i = cell->index(vertex);
    Triangle corners{};
    for (size_t n = 0; n < 3; ++n) {
      corners[n] = corner_of(cell->vertex(kOutward[i][n]), vertex->point());
    }
    std::swap(corners[0], corners[1]);  // the hole is on the vertex's side
    const CellHandle outer = cell->neighbor(i);
    border_.push_back({outer, outer->index(cell)});
    open_.push_back({corners, -static_cast<int>(border_.size())});
    open_keys_.push_back(key_of(corners));
  }
}

bool VertexRemoval::fill(const Triangulation& triangulation) {
  const size_t most_cells = 4 * open_.size() + 16;  // a sane filling has fewer
  while (!open_.empty()) {
    const OpenFacet facet = open_.back();
    open_.pop_back();
    open_keys_.pop_back();
    const CornerIndex apex = apex_over(triangulation, facet.corners);
    if (!apex.is_valid() || cells_.size() == most_cells) return false;
    const int cell = static_cast<int>(cells_.size());
    cells_.push_back({facet.corners[0], facet.corners[1], facet.corners[2], apex});
    mates_.resize(mates_.size() + 4);
    pair(4 * cell + 3, facet.side);
    if (!close_facets(cell)) return false;
  }
  return true;
}

bool VertexRemoval::close_facets(int cell) {
  const HoleCell c = cells_[cell];
  for (int i = 0; i < 3; ++i) {
    Triangle corners{};
    for (size_t n = 0; n < 3; ++n) corners[n] = c[kOutward[i][n]];
    if (!close_or_open(corners, 4 * cell + i)) return false;
  }
  return true;
}

bool VertexRemoval::close_or_open(const Triangle& corners, int side) {
  const uint32_t key = key_of(corners);
  const auto found = std::find(open_keys_.begin(), open_keys_.end(), key);
  if (found == open_keys_.end()) {
    open_.push_back({corners, side});
    open_keys_.push_back(key);
    return true;
  }
  const size_t at = found - open_keys_.begin();
  if (same_turn(open_[at].corners, corners)) return false;  // both cells on one side
  pair(side, open_[at].side);
  open_[at] = open_.back();
  open_.pop_back();
  *found = open_keys_.back();
  open_keys_.pop_back();
  return true;
}

void VertexRemoval::pair(int side, int other) {
  mates_[side] = other;
  if (other >= 0) mates_[other] = side;
}

// The spheres through a facet a, b, c have their centres at m + τ/2 n (from a; m: the circle's
// centre, n = ab × ac). A point u lies on the one with τ = (u² − 2 m·u) / (n·u); of the points on
// the positive side, the one with the least τ has no other in its sphere.
VertexRemoval::CornerIndex VertexRemoval::apex_over(const Triangulation& triangulation,
                                                    const Triangle& facet) {
  constexpr double kUndecided = 1e-9;
  const auto at = [&](CornerIndex n) -> const Vector& { return corners_[n].at; };
  const Vector &a = at(facet[0]), b = minus(at(facet[1]), a), c = minus(at(facet[2]), a);
  const Vector n = cross(b, c), nb = cross(n, b), cn = cross(c, n);
  const double bb = dot(b, b), cc = dot(c, c), nn = dot(n, n);
  Vector m2{};
  for (size_t i = 0; i < 3; ++i) m2[i] = (cc * nb[i] + bb * cn[i]) / nn;
  double least = std::numeric_limits<double>::infinity();
  close_.clear();
  for (const CornerIndex q : corners_.ids()) {
    const Vector u = minus(at(q), a);
    const double height = dot(n, u), uu = dot(u, u), mu = dot(m2, u);
    if (height <= 0) continue;
    if (uu - mu > least * height + kUndecided * (uu + std::abs(mu))) continue;
    if (q == facet[0] || q == facet[1] || q == facet[2]) continue;
    if ((uu - mu) + kUndecided * (uu + std::abs(mu)) < least * height) close_.clear();
    least = std::min(least, (uu - mu) / height);
    close_.push_back(q);
  }
  if (close_.empty()) return {};
  return close_.size() == 1 ? close_.front() : best_of_close(triangulation, facet);
}

VertexRemoval::CornerIndex VertexRemoval::best_of_close(const Triangulation& triangulation,
                                                        const Triangle& facet) const {
  const auto &a = point(facet[0]), &b = point(facet[1]), &c = point(facet[2]);
  CornerIndex best;
  for (const CornerIndex q : close_) {
    if (CGAL::orientation(a, b, c, point(q)) != CGAL::POSITIVE) continue;
    if (!best.is_valid() || triangulation.in_sphere(a, b, c, point(best), point(q))) best = q;
  }
  return best;
}

bool VertexRemoval::proven(const Triangulation& triangulation) const {
  for (size_t n = 0; n < cells_.size(); ++n) {
    const HoleCell& c = cells_[n];
    if (CGAL::orientation(point(c[0]), point(c[1]), point(c[2]), point(c[3])) != CGAL::POSITIVE) {
      return false;
    }
    for (int i = 0; i < 4; ++i) {
      if (!locally_delaunay(triangulation, static_cast<int>(n), i)) return false;
    }
  }
  return true;
}

// Facets between new cells are asked about from one side; both give the same answer.
bool VertexRemoval::locally_delaunay(const Triangulation& triangulation, int cell,
                                     int index) const {
  const int side = 4 * cell + index, mate = mates_[side];
  VertexHandle beyond;
  if (mate >= 0) {
    if (mate < side) return true;
    const HoleCell& other = cells_[mate / 4];
    beyond = corners_[other[mate % 4]].vertex;
  } else {
    const BorderFacet& border = border_[-1 - mate];
    beyond = border.outer->vertex(border.index);
    if (triangulation.is_infinite(beyond)) return true;  // nothing is beyond the hull
  }
  const HoleCell& c = cells_[cell];
  return !triangulation.in_sphere(point(c[0]), point(c[1]), point(c[2]), point(c[3]),
                                  beyond->point());
}

void VertexRemoval::commit(Triangulation& triangulation, VertexHandle vertex,
                           std::span<const CellHandle> star) {
  auto& structure = triangulation.tds();
  std::vector<CellHandle> made;
  made.reserve(cells_.size());
  const auto vertex_at = [&](CornerIndex corner) { return corners_[corner].vertex; };
  for (const HoleCell& c : cells_) {
    made.push_back(
        structure.create_cell(vertex_at(c[0]), vertex_at(c[1]), vertex_at(c[2]), vertex_at(c[3])));
    for (const CornerIndex corner : c) vertex_at(corner)->set_cell(made.back());
  }
  for (size_t side = 0; side < mates_.size(); ++side) {
    const int mate = mates_[side];
    const CellHandle cell = made[side / 4];
    const int index = static_cast<int>(side % 4);
    if (mate >= 0) {
      cell->set_neighbor(index, made[mate / 4]);
    } else {
      const BorderFacet& border = border_[-1 - mate];
      structure.set_adjacency(cell, index, border.outer, border.index);
    }
  }
  structure.delete_cells(star.begin(), star.end());
  structure.delete_vertex(vertex);
}

}  // namespace foresight::carving
