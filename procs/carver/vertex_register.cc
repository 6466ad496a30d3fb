#include "procs/carver/vertex_register.h"

#include <algorithm>
#include <numeric>

namespace foresight::carving {

void VertexRegister::clear() {
  records_.assign(kHullCorners, {});
  free_.clear();
  dropped_.clear();
  inserted_.clear();
  erased_ids_.clear();
  live_ = 0;
}

VertexId VertexRegister::external_id(int32_t vertex) const {
  if (vertex < kHullCorners) return VertexId::hull_corner(vertex);
  return VertexId(id_of(records_[static_cast<size_t>(vertex)].owner));
}

int32_t VertexRegister::allocate() {
  if (free_.empty()) {
    records_.emplace_back();
    return static_cast<int32_t>(records_.size()) - 1;
  }
  const int32_t vertex = free_.back();
  free_.pop_back();
  return vertex;
}

// Makes `members` the points at `vertex`, the smallest id its owner.
void VertexRegister::adopt(int32_t vertex, std::vector<int32_t> members) {
  const auto first = std::min_element(members.begin(), members.end(),
                                      [&](int32_t a, int32_t b) { return id_of(a) < id_of(b); });
  std::iter_swap(members.begin(), first);
  for (const int32_t point : members) {
    map_.points[static_cast<size_t>(point)].vertex = vertex;
    map_.points[static_cast<size_t>(point)].waiting = false;
  }
  at(vertex).owner = members.front();
  at(vertex).also_there.assign(members.begin() + 1, members.end());
}

// Inserts a vertex for points at one position. If a vertex is there already they join it; a new
// owner takes the vertex over by removal and insertion, so that all its cells are announced anew.
void VertexRegister::place(std::vector<int32_t> members) {
  const int32_t vertex = allocate();
  const Point3 position = map_.points[static_cast<size_t>(members.front())].position;
  const int32_t present = delaunay_.insert({vertex, position});
  if (present < 0) {
    at(vertex).fresh = true;
    inserted_.push_back(vertex);
    ++live_;
    adopt(vertex, std::move(members));
    return;
  }
  free_.push_back(vertex);
  const int32_t owner = at(present).owner;
  members.push_back(owner);
  members.insert(members.end(), at(present).also_there.begin(), at(present).also_there.end());
  const bool keeps = std::all_of(members.begin(), members.end(),
                                 [&](int32_t point) { return id_of(owner) <= id_of(point); });
  if (keeps) {
    adopt(present, std::move(members));
    return;
  }
  if (!at(present).fresh) erased_ids_.push_back(id_of(owner));
  at(present).owner = -1;
  erase(present);
  place(std::move(members));
}

void VertexRegister::erase(int32_t vertex) {
  delaunay_.remove(vertex);
  --live_;
  dropped_.push_back(vertex);
}

void VertexRegister::update(const StagedChanges& staged) {
  std::vector<int32_t> abandoned;
  for (const DetachedPoint& detached : staged.detached) {
    VertexRecord& record = at(detached.vertex);
    if (record.owner == detached.point) {
      if (!record.fresh) erased_ids_.push_back(id_of(detached.point));
      record.owner = -1;
      abandoned.push_back(detached.vertex);
    } else {
      std::erase(record.also_there, detached.point);
    }
  }
  std::vector<std::vector<int32_t>> heirs;
  for (const int32_t vertex : abandoned) {
    if (!at(vertex).also_there.empty()) heirs.push_back(std::move(at(vertex).also_there));
    erase(vertex);
  }
  for (auto& members : heirs) place(std::move(members));
  std::vector<int32_t> waiting;
  std::vector<VertexSite> sites;
  for (const int32_t point : staged.attached) {
    const PointRecord& record = map_.points[static_cast<size_t>(point)];
    if (!record.alive || !record.waiting) continue;
    waiting.push_back(point);
    sites.push_back({0, record.position});
  }
  for (const size_t n : Delaunay::spatial_order(sites)) place({waiting[n]});
}

void VertexRegister::rebuild(const std::array<Point3, 8>& corners) {
  std::vector<int32_t> points;
  for (size_t n = 0; n < map_.points.size(); ++n) {
    if (map_.points[n].alive) points.push_back(static_cast<int32_t>(n));
  }
  const auto position = [&](int32_t point) -> const Point3& {
    return map_.points[static_cast<size_t>(point)].position;
  };
  std::sort(points.begin(), points.end(), [&](int32_t a, int32_t b) {
    return position(a) != position(b) ? position(a) < position(b) : id_of(a) < id_of(b);
  });
  clear();
  std::vector<VertexSite> sites;
  for (size_t n = 0; n < points.size();) {
    size_t end = n + 1;
    while (end < points.size() && position(points[end]) == position(points[n])) ++end;
    const int32_t vertex = allocate();
    at(vertex).fresh = true;
    inserted_.push_back(vertex);
    sites.push_back({vertex, position(points[n])});
    adopt(vertex, {points.begin() + static_cast<std::ptrdiff_t>(n),
                   points.begin() + static_cast<std::ptrdiff_t>(end)});
    n = end;
  }
  live_ = static_cast<int64_t>(sites.size());
  delaunay_.build(corners, sites);
}

void VertexRegister::finish() {
  for (const int32_t vertex : inserted_) at(vertex).fresh = false;
  for (const int32_t vertex : dropped_) {
    at(vertex) = VertexRecord{};
    free_.push_back(vertex);
  }
  inserted_.clear();
  dropped_.clear();
  erased_ids_.clear();
}

}  // namespace foresight::carving
