#include "procs/carver/tracer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace foresight::carving {

void Tracer::reset() {
  lists_.reset();
  special_.clear();
  crossed_.clear();
  grazing_.clear();
  lost_ends_.clear();
  tied_.clear();
  cell_by_vertex_.clear();
  for (RayRecord& ray : map_.rays) {
    ray.grazing = ray.tied = false;
    ray.behind = -1;
  }
  last_start_ = 0;
}

void Tracer::start_delta(const std::vector<RetiredRay>& retired) {
  ++stamp_;
  runs_ = 0;
  traced_ = 0;
  for (const RetiredRay& ray : retired) note_special(ray.ray, true);
}

void Tracer::note_special(int32_t ray, bool special) {
  const auto at = static_cast<size_t>(ray);
  if (at >= special_.size()) special_.resize(map_.rays.size());
  special_[at] = special;
}

const Feature& Tracer::aim(int32_t ray) {
  const RayRecord& record = ray_at(ray);
  const KeyframeRecord& keyframe = map_.keyframes[static_cast<size_t>(record.keyframe)];
  const PointRecord& point = map_.points[static_cast<size_t>(record.point)];
  walker_.aim(keyframe.centre, point.vertex, point.position);
  return keyframe.start;
}

void Tracer::erase(std::span<const RetiredRay> retired) {
  marked_.resize(complex_.cells.size());
  const auto note = [&](int32_t cell) {
    const auto at = static_cast<size_t>(cell);
    if (!marked_[at]) crossed_.push_back(cell);
    marked_[at] = true;
  };
  for (const RetiredRay& ray : retired) {
    walker_.aim(ray.from, ray.vertex, complex_.positions[static_cast<size_t>(ray.vertex)]);
    walker_.trace(ray.start, [&](int32_t cell, uint32_t) {
      note(cell);
      return true;
    });
    const int32_t behind = ray_at(ray.ray).behind;
    if (behind >= 0) note(behind);
  }
  for (const int32_t cell : crossed_) marked_[static_cast<size_t>(cell)] = false;
}

void Tracer::prune() {
  for (const int32_t cell : crossed_) {
    if (state_of(cell) == CellState::kDestroyed) continue;
    lists_.filter(cell, [&](uint32_t entry) {
      const int32_t ray = entry_ray(entry);
      return special_[static_cast<size_t>(ray)] && ray_at(ray).state == RayState::kRetired;
    });
  }
  crossed_.clear();
}

void Tracer::forget(std::span<const RetiredRay> retired) {
  for (const RetiredRay& ray : retired) note_special(ray.ray, true);
  erase(retired);
  prune();
}

void Tracer::relocate() {
  lists_.resize(complex_.cells.size());
  for (KeyframeRecord& keyframe : map_.keyframes) {
    if (!keyframe.alive) continue;
    const int32_t cell = keyframe.start.cell;
    if (cell >= 0 && state_of(cell) != CellState::kDestroyed) continue;
    const auto usable = [&](int32_t id) {
      return id >= 0 && static_cast<size_t>(id) < complex_.cells.size() &&
             (state_of(id) == CellState::kKept || state_of(id) == CellState::kNew);
    };
    while (!usable(last_start_)) {
      last_start_ =
          static_cast<int32_t>((static_cast<size_t>(last_start_) + 1) % complex_.cells.size());
    }
    keyframe.start = locate(complex_, keyframe.centre, last_start_);
    last_start_ = keyframe.start.cell;
  }
}

void Tracer::note_cell(int32_t cell) {
  for (const int32_t vertex : complex_.cells[static_cast<size_t>(cell)].vertices) {
    const auto v = static_cast<size_t>(vertex);
    if (v >= cell_by_vertex_.size()) cell_by_vertex_.resize(complex_.positions.size(), -1);
    cell_by_vertex_[v] = cell;
  }
}

void Tracer::note_all_cells() {
  for (size_t cell = 0; cell < complex_.cells.size(); ++cell) {
    if (complex_.states[cell] == CellState::kNew) note_cell(static_cast<int32_t>(cell));
  }
}

// A vertex that stays while a cell of its goes has a new cell, so one pass over these is enough.
void Tracer::retrace(const TriangulationChange& change) {
  spoiled_ = false;
  for (const int32_t cell : change.created) note_cell(cell);
  for (size_t n = 0; n < change.destroyed.size(); ++n) {
    collect_runs(change.destroyed[n], change.entries[n]);
  }
  for (size_t n = 0; n < to_run_.size(); ++n) {
    prefetch(n);
    run(to_run_[n]);
  }
  runs_ += static_cast<int64_t>(to_run_.size());
  to_run_.clear();
  for (const int32_t ray : std::exchange(starts_, {})) retrace_start(ray);
  if (!change.destroyed.empty()) queue_grazing();
  retrace_whole(change);
  if (!change.destroyed.empty()) retrace_ends();
  for (const int32_t cell : change.destroyed) lists_.release(cell);
}

void Tracer::place_end(int32_t ray) {
  RayRecord& record = ray_at(ray);
  const KeyframeRecord& keyframe = map_.keyframes[static_cast<size_t>(record.keyframe)];
  const PointRecord& point = map_.points[static_cast<size_t>(record.point)];
  record.behind = -1;
  record.tied = false;
  if (keyframe.centre == point.position) return;  // no direction
  aim(ray);
  const auto found = walker_.behind(cell_by_vertex_[static_cast<size_t>(point.vertex)]);
  record.behind = found.cell;
  record.tied = found.tied;
  if (found.tied) tied_.push_back(ray);
  lists_.push(found.cell, make_entry(ray, kEntryEnd));
}

// A tie may be decided otherwise by any cell that is new.
void Tracer::retrace_ends() {
  for (const int32_t ray : std::exchange(tied_, {})) {
    RayRecord& record = ray_at(ray);
    if (!record.tied || record.state != RayState::kTraced) continue;
    if (state_of(record.behind) == CellState::kDestroyed) continue;  // is among the lost ones
    record.tied = false;                                             // until it is placed again
    lists_.filter(record.behind,
                  [&](uint32_t entry) { return entry == make_entry(ray, kEntryEnd); });
    lost_ends_.push_back(ray);
  }
  for (const int32_t ray : lost_ends_) place_end(ray);
  lost_ends_.clear();
}

// Each ray is taken up where it enters the changed region; what it does elsewhere in it follows.
void Tracer::collect_runs(int32_t destroyed, const std::array<RegionEntry, 4>& entries) {
  for (const uint32_t entry : lists_.entries(destroyed)) {
    const int32_t ray = entry_ray(entry);
    const uint32_t code = entry_code(entry);
    if (limit_ > 0 || code >= kEntryStart || special_[static_cast<size_t>(ray)]) {
      collect_special(ray, code);
    } else if (entries[code].cell >= 0) {
      to_run_.push_back({ray, entries[code]});
    }
  }
}

void Tracer::collect_special(int32_t ray, uint32_t code) {
  if (ray_at(ray).state != RayState::kTraced) return;
  if (code == kEntryEnd) {
    lost_ends_.push_back(ray);
  } else if (limit_ > 0 || ray_at(ray).degenerate || code == kEntryOther) {
    queue_whole(ray);
  } else {
    starts_.push_back(ray);
  }
}

void Tracer::run(const Run& run) {
  if (ray_at(run.ray).degenerate) return;  // found out meanwhile, will be traced as a whole
  aim(run.ray);
  const WalkEnd end =
      walker_.walk_from_facet(run.resume.cell, run.resume.facet, [&](int32_t cell, uint32_t facet) {
        if (state_of(cell) != CellState::kNew) return false;
        lists_.push(cell, make_entry(run.ray, facet));
        return true;
      });
  if (end != WalkEnd::kDegenerate) return;
  spoiled_ = true;
  queue_whole(run.ray);
}

// Rays lie anywhere in memory, and so do their points.
void Tracer::prefetch(size_t run) const {
  constexpr size_t kRayAhead = 16, kPointAhead = 8;
  if (run + kRayAhead < to_run_.size()) {
    __builtin_prefetch(&map_.rays[static_cast<size_t>(to_run_[run + kRayAhead].ray)]);
  }
  if (run + kPointAhead < to_run_.size()) {
    const RayRecord& ray = map_.rays[static_cast<size_t>(to_run_[run + kPointAhead].ray)];
    __builtin_prefetch(&map_.points[static_cast<size_t>(ray.point)]);
  }
}

void Tracer::retrace_start(int32_t ray) {
  ++runs_;
  const Feature& start = aim(ray);
  const bool degenerate = walker_.trace(start, [&](int32_t cell, uint32_t code) {
    if (state_of(cell) != CellState::kNew) return false;
    lists_.push(cell, make_entry(ray, code));
    return true;
  });
  if (!degenerate) return;
  spoiled_ = true;
  queue_whole(ray);
}

void Tracer::queue_whole(int32_t ray) {
  RayRecord& record = ray_at(ray);
  record.degenerate = limit_ == 0;
  note_special(ray, record.degenerate);
  if (record.stamp == stamp_) return;
  record.stamp = stamp_;
  whole_.push_back(ray);
}

// Where a ray runs inside a facet or along an edge no cell lists it, so the destruction of the
// cells around goes unnoticed: such rays (rare outside lattices) are traced again with every
// change.
void Tracer::queue_grazing() {
  std::erase_if(grazing_, [&](int32_t ray) {
    return !ray_at(ray).grazing || ray_at(ray).state != RayState::kTraced;
  });
  for (const int32_t ray : grazing_) queue_whole(ray);
}

template <class Visit>
void Tracer::trace_whole(int32_t ray, Visit&& visit) {
  ++traced_;
  const Feature start = aim(ray);
  RayRecord& record = ray_at(ray);
  record.degenerate = walker_.trace(start, visit);
  note_special(ray, record.degenerate);
  if (walker_.grazed() && !record.grazing) grazing_.push_back(ray);
  record.grazing = walker_.grazed();
}

// Degenerate rays (and all, when lists are bounded) are traced from the camera on, but added to new
// cells only. What their runs have added before the degeneracy showed is taken out first.
void Tracer::retrace_whole(const TriangulationChange& change) {
  if (spoiled_) {
    for (const int32_t cell : change.created) {
      lists_.filter(cell, [&](uint32_t entry) {
        return entry_code(entry) != kEntryEnd && ray_at(entry_ray(entry)).degenerate;
      });
    }
  }
  for (const int32_t ray : whole_) {
    trace_whole(ray, [&](int32_t cell, uint32_t code) {
      if (state_of(cell) == CellState::kNew) add(cell, ray, code);
      return true;
    });
  }
  whole_.clear();
}

void Tracer::trace(const std::vector<int32_t>& rays) {
  for (const int32_t ray : rays) {
    if (ray_at(ray).state != RayState::kNew) continue;
    trace_whole(ray, [&](int32_t cell, uint32_t code) {
      add(cell, ray, code);
      return true;
    });
    place_end(ray);
  }
}

inline void Tracer::add(int32_t cell, int32_t ray, uint32_t code) {
  if (limit_ == 0 || lists_.constraints(cell) < limit_) {
    lists_.push(cell, make_entry(ray, code));
  } else {
    add_dissimilar(cell, ray, code);
  }
}

Point3 Tracer::direction(int32_t ray) const {
  const RayRecord& record = map_.rays[static_cast<size_t>(ray)];
  const Point3& from = map_.keyframes[static_cast<size_t>(record.keyframe)].centre;
  const Point3& to = map_.points[static_cast<size_t>(record.point)].position;
  Point3 d{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  const double scale = 1.0 / std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (double& x : d) x *= scale;
  return d;
}

// Of the K kept constraints and the new one, the closest pair in direction loses a member: the one
// that is closer to any third constraint.
void Tracer::add_dissimilar(int32_t cell, int32_t ray, uint32_t code) {
  directions_.clear();
  places_.clear();
  const std::span<const uint32_t> entries = lists_.entries(cell);
  for (size_t n = 0; n < entries.size(); ++n) {
    if (entry_code(entries[n]) == kEntryEnd) continue;
    directions_.push_back(direction(entry_ray(entries[n])));
    places_.push_back(n);
  }
  directions_.push_back(direction(ray));
  const size_t count = directions_.size();
  const auto squared_distance = [&](size_t a, size_t b) {
    double sum = 0.0;
    for (size_t i = 0; i < 3; ++i) {
      const double difference = directions_[a][i] - directions_[b][i];
      sum += difference * difference;
    }
    return sum;
  };
  size_t first = 0, second = 1;
  double nearest = 5.0;  // more than the square of a sphere's diameter
  for (size_t a = 0; a < count; ++a) {
    for (size_t b = a + 1; b < count; ++b) {
      const double distance = squared_distance(a, b);
      if (distance < nearest) nearest = distance, first = a, second = b;
    }
  }
  double near_first = 5.0, near_second = 5.0;
  for (size_t n = 0; n < count; ++n) {
    if (n == first || n == second) continue;
    near_first = std::min(near_first, squared_distance(n, first));
    near_second = std::min(near_second, squared_distance(n, second));
  }
  const size_t loser = near_first < near_second ? first : second;
  if (loser + 1 != count) lists_.replace(cell, places_[loser], make_entry(ray, code));
}

}  // namespace foresight::carving
