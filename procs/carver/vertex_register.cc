#include "procs/carver/vertex_register.h"

#include <algorithm>
#include <numeric>

namespace foresight::carving {

void VertexRegister::clear() {
  records_.assign(kFirstPoint.index(), {});
  free_.clear();
  dropped_.clear();
  inserted_.clear();
  erased_ids_.clear();
  live_ = 0;
}

VertexId VertexRegister::id_of(VertexIndex vertex) const {
  if (vertex < kFirstPoint) return VertexId::hull_corner(vertex.value());
  return VertexId(id_of(records_[vertex].owner));
}

VertexIndex VertexRegister::allocate() {
  if (free_.empty()) return records_.emplace_back();
  const VertexIndex vertex = free_.back();
  free_.pop_back();
  return vertex;
}

// Makes `members` the points at `vertex`, the smallest id its owner.
void VertexRegister::adopt(VertexIndex vertex, std::vector<PointIndex> members) {
  const auto first =
      std::min_element(members.begin(), members.end(),
                       [&](PointIndex a, PointIndex b) { return id_of(a) < id_of(b); });
  std::iter_swap(members.begin(), first);
  for (const PointIndex point : members) {
    map_.points[point].vertex = vertex;
    map_.points[point].waiting = false;
  }
  at(vertex).owner = members.front();
  at(vertex).also_there.assign(members.begin() + 1, members.end());
}

// Inserts a vertex for points at one position. If a vertex is there already they join it; a new
// owner takes the vertex over by removal and insertion, so that all its cells are announced anew.
void VertexRegister::place(std::vector<PointIndex> members) {
  const VertexIndex vertex = allocate();
  const Point3 position = map_.points[members.front()].position;
  const VertexIndex present = delaunay_.insert({vertex, position});
  if (!present.is_valid()) {
    at(vertex).fresh = true;
    inserted_.push_back(vertex);
    ++live_;
    adopt(vertex, std::move(members));
    return;
  }
  free_.push_back(vertex);
  const PointIndex owner = at(present).owner;
  members.push_back(owner);
  members.insert(members.end(), at(present).also_there.begin(), at(present).also_there.end());
  const bool keeps = std::all_of(members.begin(), members.end(),
                                 [&](PointIndex point) { return id_of(owner) <= id_of(point); });
  if (keeps) {
    adopt(present, std::move(members));
    return;
  }
  if (!at(present).fresh) erased_ids_.push_back(id_of(owner));
  at(present).owner = PointIndex();
  erase(present);
  place(std::move(members));
}

void VertexRegister::erase(VertexIndex vertex) {
  delaunay_.remove(vertex);
  --live_;
  dropped_.push_back(vertex);
}

void VertexRegister::update(const StagedChanges& staged) {
  std::vector<VertexIndex> abandoned;
  for (const DetachedPoint& detached : staged.detached) {
    VertexRecord& record = at(detached.vertex);
    if (record.owner == detached.point) {
      if (!record.fresh) erased_ids_.push_back(id_of(detached.point));
      record.owner = PointIndex();
      abandoned.push_back(detached.vertex);
    } else {
      std::erase(record.also_there, detached.point);
    }
  }
  std::vector<std::vector<PointIndex>> heirs;
  for (const VertexIndex vertex : abandoned) {
    if (!at(vertex).also_there.empty()) heirs.push_back(std::move(at(vertex).also_there));
    erase(vertex);
  }
  for (auto& members : heirs) place(std::move(members));
  std::vector<PointIndex> waiting;
  std::vector<VertexSite> sites;
  for (const PointIndex point : staged.attached) {
    const PointRecord& record = map_.points[point];
    if (!record.alive || !record.waiting) continue;
    waiting.push_back(point);
    sites.push_back({{}, record.position});
  }
  for (const size_t n : Delaunay::spatial_order(sites)) place({waiting[n]});
}

void VertexRegister::rebuild(const std::array<Point3, 8>& corners) {
  std::vector<PointIndex> points;
  for (const PointIndex point : map_.points.ids()) {
    if (map_.points[point].alive) points.push_back(point);
  }
  const auto position = [&](PointIndex point) -> const Point3& {
    return map_.points[point].position;
  };
  std::sort(points.begin(), points.end(), [&](PointIndex a, PointIndex b) {
    return position(a) != position(b) ? position(a) < position(b) : id_of(a) < id_of(b);
  });
  clear();
  std::vector<VertexSite> sites;
  for (size_t n = 0; n < points.size();) {
    size_t end = n + 1;
    while (end < points.size() && position(points[end]) == position(points[n])) ++end;
    const VertexIndex vertex = allocate();
    at(vertex).fresh = true;
    inserted_.push_back(vertex);
    sites.push_back({vertex, position(points[n])});
    const auto first = points.begin();
    adopt(vertex, {first + n, first + end});
    n = end;
  }
  live_ = sites.size();
  delaunay_.build(corners, sites);
}

void VertexRegister::finish() {
  for (const VertexIndex vertex : inserted_) at(vertex).fresh = false;
  for (const VertexIndex vertex : dropped_) {
    at(vertex) = VertexRecord{};
    free_.push_back(vertex);
  }
  inserted_.clear();
  dropped_.clear();
  erased_ids_.clear();
}

}  // namespace foresight::carving
