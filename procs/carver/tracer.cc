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
  for (ConstraintRecord& constraint : map_.constraints) {
    constraint.grazing = constraint.tied = false;
    constraint.behind = CellId();
  }
  last_start_ = CellId(0);
}

void Tracer::start_delta(const std::vector<RetiredConstraint>& retired) {
  ++stamp_;
  runs_ = 0;
  traced_ = 0;
  for (const RetiredConstraint& constraint : retired) note_special(constraint.constraint, true);
}

void Tracer::note_special(ConstraintIndex constraint, bool special) {
  if (!special_.contains(constraint)) special_.resize(map_.constraints.size());
  special_[constraint] = special;
}

const Feature& Tracer::aim(ConstraintIndex constraint) {
  const ConstraintRecord& record = constraint_at(constraint);
  const KeyframeRecord& keyframe = map_.keyframes[record.keyframe];
  const PointRecord& point = map_.points[record.point];
  walker_.aim(keyframe.centre, point.vertex, point.position);
  return keyframe.start;
}

void Tracer::erase(std::span<const RetiredConstraint> retired) {
  marked_.resize(tetrahedra_.cells.size());
  const auto note = [&](CellId cell) {
    if (!marked_[cell]) crossed_.push_back(cell);
    marked_[cell] = true;
  };
  for (const RetiredConstraint& constraint : retired) {
    walker_.aim(constraint.from, constraint.vertex, tetrahedra_.positions[constraint.vertex]);
    walker_.trace(constraint.start, [&](CellId cell, uint32_t) {
      note(cell);
      return true;
    });
    const CellId behind = constraint_at(constraint.constraint).behind;
    if (behind.is_valid()) note(behind);
  }
  for (const CellId cell : crossed_) marked_[cell] = false;
}

void Tracer::prune() {
  for (const CellId cell : crossed_) {
    if (state_of(cell) == CellState::kDestroyed) continue;
    lists_.filter(cell, [&](Entry entry) {
      const ConstraintIndex constraint = entry.constraint();
      return special_[constraint] && constraint_at(constraint).state == ConstraintState::kRetired;
    });
  }
  crossed_.clear();
}

void Tracer::forget(std::span<const RetiredConstraint> retired) {
  for (const RetiredConstraint& constraint : retired) note_special(constraint.constraint, true);
  erase(retired);
  prune();
}

void Tracer::relocate() {
  lists_.resize(tetrahedra_.cells.size());
  for (KeyframeRecord& keyframe : map_.keyframes) {
    if (!keyframe.alive) continue;
    const CellId cell = keyframe.start.cell;
    if (cell.is_valid() && state_of(cell) != CellState::kDestroyed) continue;
    const auto usable = [&](CellId id) {
      return tetrahedra_.cells.contains(id) &&
             (state_of(id) == CellState::kKept || state_of(id) == CellState::kNew);
    };
    while (!usable(last_start_)) {
      last_start_ = last_start_.next();
      if (!tetrahedra_.cells.contains(last_start_)) last_start_ = CellId(0);
    }
    keyframe.start = locate(tetrahedra_, keyframe.centre, last_start_);
    last_start_ = keyframe.start.cell;
  }
}

void Tracer::note_cell(CellId cell) {
  for (const VertexIndex vertex : tetrahedra_.cells[cell].vertices) {
    if (!cell_by_vertex_.contains(vertex)) cell_by_vertex_.resize(tetrahedra_.positions.size());
    cell_by_vertex_[vertex] = cell;
  }
}

void Tracer::note_all_cells() {
  for (const CellId cell : tetrahedra_.cells.ids()) {
    if (state_of(cell) == CellState::kNew) note_cell(cell);
  }
}

// A vertex that stays while a cell of its goes has a new cell, so one pass over these is enough.
void Tracer::retrace(const TriangulationChange& change) {
  spoiled_ = false;
  for (const CellId cell : change.created) note_cell(cell);
  for (size_t n = 0; n < change.destroyed.size(); ++n) {
    collect_runs(change.destroyed[n], change.entries[n]);
  }
  for (size_t n = 0; n < to_run_.size(); ++n) {
    prefetch(n);
    run(to_run_[n]);
  }
  runs_ += to_run_.size();
  to_run_.clear();
  for (const ConstraintIndex constraint : std::exchange(starts_, {})) retrace_start(constraint);
  if (!change.destroyed.empty()) queue_grazing();
  retrace_whole(change);
  if (!change.destroyed.empty()) retrace_ends();
  for (const CellId cell : change.destroyed) lists_.release(cell);
}

void Tracer::place_end(ConstraintIndex constraint) {
  ConstraintRecord& record = constraint_at(constraint);
  const KeyframeRecord& keyframe = map_.keyframes[record.keyframe];
  const PointRecord& point = map_.points[record.point];
  record.behind = CellId();
  record.tied = false;
  if (keyframe.centre == point.position) return;  // no direction
  aim(constraint);
  const auto found = walker_.behind(cell_by_vertex_[point.vertex]);
  record.behind = found.cell;
  record.tied = found.tied;
  if (found.tied) tied_.push_back(constraint);
  lists_.push(found.cell, Entry(constraint, kEntryEnd));
}

// A tie may be decided otherwise by any cell that is new.
void Tracer::retrace_ends() {
  for (const ConstraintIndex constraint : std::exchange(tied_, {})) {
    ConstraintRecord& record = constraint_at(constraint);
    if (!record.tied || record.state != ConstraintState::kTraced) continue;
    if (state_of(record.behind) == CellState::kDestroyed) continue;  // is among the lost ones
    record.tied = false;                                             // until it is placed again
    lists_.filter(record.behind,
                  [&](Entry entry) { return entry == Entry(constraint, kEntryEnd); });
    lost_ends_.push_back(constraint);
  }
  for (const ConstraintIndex constraint : lost_ends_) place_end(constraint);
  lost_ends_.clear();
}

// Each constraint is taken up where it enters the changed region; what it does elsewhere in it
// follows.
void Tracer::collect_runs(CellId destroyed, const std::array<RegionEntry, 4>& entries) {
  for (const Entry entry : lists_.entries(destroyed)) {
    const ConstraintIndex constraint = entry.constraint();
    const uint32_t code = entry.code();
    if (limit_ > 0 || code >= kEntryStart || special_[constraint]) {
      collect_special(constraint, code);
    } else if (entries[code].cell.is_valid()) {
      to_run_.push_back({constraint, entries[code]});
    }
  }
}

void Tracer::collect_special(ConstraintIndex constraint, uint32_t code) {
  if (constraint_at(constraint).state != ConstraintState::kTraced) return;
  if (code == kEntryEnd) {
    lost_ends_.push_back(constraint);
  } else if (limit_ > 0 || constraint_at(constraint).degenerate || code == kEntryOther) {
    queue_whole(constraint);
  } else {
    starts_.push_back(constraint);
  }
}

void Tracer::run(const Run& run) {
  if (constraint_at(run.constraint).degenerate)
    return;  // found out meanwhile, will be traced as a whole
  aim(run.constraint);
  const WalkEnd end =
      walker_.walk_from_facet(run.resume.cell, run.resume.facet, [&](CellId cell, uint32_t facet) {
        if (state_of(cell) != CellState::kNew) return false;
        lists_.push(cell, Entry(run.constraint, facet));
        return true;
      });
  if (end != WalkEnd::kDegenerate) return;
  spoiled_ = true;
  queue_whole(run.constraint);
}

// Constraints lie anywhere in memory, and so do their points.
void Tracer::prefetch(size_t run) const {
  constexpr size_t kConstraintAhead = 16, kPointAhead = 8;
  if (run + kConstraintAhead < to_run_.size()) {
    __builtin_prefetch(&map_.constraints[to_run_[run + kConstraintAhead].constraint]);
  }
  if (run + kPointAhead < to_run_.size()) {
    const ConstraintRecord& constraint = map_.constraints[to_run_[run + kPointAhead].constraint];
    __builtin_prefetch(&map_.points[constraint.point]);
  }
}

void Tracer::retrace_start(ConstraintIndex constraint) {
  ++runs_;
  const Feature& start = aim(constraint);
  const bool degenerate = walker_.trace(start, [&](CellId cell, uint32_t code) {
    if (state_of(cell) != CellState::kNew) return false;
    lists_.push(cell, Entry(constraint, code));
    return true;
  });
  if (!degenerate) return;
  spoiled_ = true;
  queue_whole(constraint);
}

void Tracer::queue_whole(ConstraintIndex constraint) {
  ConstraintRecord& record = constraint_at(constraint);
  record.degenerate = limit_ == 0;
  note_special(constraint, record.degenerate);
  if (record.stamp == stamp_) return;
  record.stamp = stamp_;
  whole_.push_back(constraint);
}

// Where a constraint runs inside a facet or along an edge no cell lists it, so the destruction of
// the cells around goes unnoticed: such constraints (rare outside lattices) are traced again with
// every change.
void Tracer::queue_grazing() {
  std::erase_if(grazing_, [&](ConstraintIndex constraint) {
    return !constraint_at(constraint).grazing ||
           constraint_at(constraint).state != ConstraintState::kTraced;
  });
  for (const ConstraintIndex constraint : grazing_) queue_whole(constraint);
}

template <class Visit>
void Tracer::trace_whole(ConstraintIndex constraint, Visit&& visit) {
  ++traced_;
  const Feature start = aim(constraint);
  ConstraintRecord& record = constraint_at(constraint);
  record.degenerate = walker_.trace(start, visit);
  note_special(constraint, record.degenerate);
  if (walker_.grazed() && !record.grazing) grazing_.push_back(constraint);
  record.grazing = walker_.grazed();
}

// Degenerate constraints (and all, when lists are bounded) are traced from the camera on, but added
// to new cells only. What their runs have added before the degeneracy showed is taken out first.
void Tracer::retrace_whole(const TriangulationChange& change) {
  if (spoiled_) {
    for (const CellId cell : change.created) {
      lists_.filter(cell, [&](Entry entry) {
        return entry.code() != kEntryEnd && constraint_at(entry.constraint()).degenerate;
      });
    }
  }
  for (const ConstraintIndex constraint : whole_) {
    trace_whole(constraint, [&](CellId cell, uint32_t code) {
      if (state_of(cell) == CellState::kNew) add(cell, constraint, code);
      return true;
    });
  }
  whole_.clear();
}

void Tracer::trace(const std::vector<ConstraintIndex>& constraints) {
  for (const ConstraintIndex constraint : constraints) {
    if (constraint_at(constraint).state != ConstraintState::kNew) continue;
    trace_whole(constraint, [&](CellId cell, uint32_t code) {
      add(cell, constraint, code);
      return true;
    });
    place_end(constraint);
  }
}

inline void Tracer::add(CellId cell, ConstraintIndex constraint, uint32_t code) {
  if (limit_ == 0 || lists_.constraints(cell) < limit_) {
    lists_.push(cell, Entry(constraint, code));
  } else {
    add_dissimilar(cell, constraint, code);
  }
}

Point3 Tracer::direction(ConstraintIndex constraint) const {
  const ConstraintRecord& record = map_.constraints[constraint];
  const Point3& from = map_.keyframes[record.keyframe].centre;
  const Point3& to = map_.points[record.point].position;
  Point3 d{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  const double scale = 1.0 / std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (double& x : d) x *= scale;
  return d;
}

// Of the K kept constraints and the new one, the closest pair in direction loses a member: the one
// that is closer to any third constraint.
void Tracer::add_dissimilar(CellId cell, ConstraintIndex constraint, uint32_t code) {
  directions_.clear();
  places_.clear();
  const std::span<const Entry> entries = lists_.entries(cell);
  for (size_t n = 0; n < entries.size(); ++n) {
    if (entries[n].code() == kEntryEnd) continue;
    directions_.push_back(direction(entries[n].constraint()));
    places_.push_back(n);
  }
  directions_.push_back(direction(constraint));
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
  if (loser + 1 != count) lists_.replace(cell, places_[loser], Entry(constraint, code));
}

}  // namespace foresight::carving
