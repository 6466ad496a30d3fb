#include "procs/carver/carver.h"

#include <algorithm>
#include <cmath>

#include "procs/carver/carver_impl.h"
#include "procs/carver/thinning.h"

namespace foresight {

Carver::Carver(const CarverOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Carver::~Carver() = default;
Carver::Carver(Carver&&) noexcept = default;
Carver& Carver::operator=(Carver&&) noexcept = default;

CarvingDelta Carver::apply(const MapDelta& delta) { return impl_->apply(delta); }
CarvingDelta Carver::snapshot() const { return impl_->snapshot(); }
void Carver::reset() { impl_ = std::make_unique<Impl>(impl_->options); }
CarverStatistics Carver::statistics() const { return impl_->collect_statistics(); }
std::string Carver::validate() const { return impl_->validate(); }

CarvingDelta Carver::Impl::apply(const MapDelta& delta) {
  map.stage(delta);
  tracer.start_delta(map.staged.retired);
  cells_replaced = 0;
  const RebuildReason reason = rebuild_reason();
  return reason == RebuildReason::kNever ? update() : rebuild(reason);
}

int64_t Carver::Impl::memory_bytes() const {
  return map.memory_bytes() + delaunay.memory_bytes() + tracer.lists().memory_bytes();
}

// After the delta's own work, before its result is told. Once more if constraints were shorter than
// usual.
void Carver::Impl::thin() {
  const auto over = [&] {
    return options.memory_limit_bytes > 0 && memory_bytes() > options.memory_limit_bytes;
  };
  over_limit = over();
  while (over_limit) {
    const size_t before = map.staged.retired.size();
    if (thin_oldest(map, constraints_to_forget()) == 0) return;
    tracer.forget(std::span(map.staged.retired).subspan(before));
    tracer.lists().compact();
    over_limit = over();
  }
}

// Lists are what forgetting makes smaller: down to three quarters of the limit, so that not every
// delta has to do it again, but by no more than a quarter of the lists unless the limit asks for
// it.
int64_t Carver::Impl::constraints_to_forget() const {
  const auto limit = static_cast<double>(options.memory_limit_bytes);
  const auto held = static_cast<double>(memory_bytes());
  const auto lists = static_cast<double>(tracer.lists().list_bytes());
  const double bytes = std::max(held - limit, std::min(held - 0.75 * limit, 0.25 * lists));
  const auto constraints = static_cast<double>(map.live_constraints);
  return static_cast<int64_t>(
      std::min(constraints, std::ceil(constraints * bytes / std::max(lists, 1.0))));
}

RebuildReason Carver::Impl::rebuild_reason() const {
  if (!delaunay.built()) return RebuildReason::kFirstBuild;
  if (!staged_fits_hull()) return RebuildReason::kHullOutgrown;
  return update_is_dearer() ? RebuildReason::kManyChanges : RebuildReason::kNever;
}

bool Carver::Impl::staged_fits_hull() const {
  for (const carving::PointIndex point : map.staged.attached) {
    const carving::PointRecord& record = map.points[point];
    if (record.alive && !hull.holds(record.position)) return false;
  }
  return std::all_of(map.keyframes.begin(), map.keyframes.end(), [&](const auto& keyframe) {
    return !keyframe.alive || keyframe.start.cell.is_valid() || hull.holds(keyframe.centre);
  });
}

// Estimates in microseconds, measured on the carving sequences (docs/algorithms/carving.md).
bool Carver::Impl::update_is_dearer() const {
  constexpr double kRemoval = 16.0, kInsertion = 11.0, kBuiltVertex = 8.0, kConstraint = 1.1;
  constexpr double kRetracing =
      18.0;  // of the constraints through what a removal or insertion changes
  const auto removals = static_cast<double>(map.staged.detached.size());
  const auto insertions = static_cast<double>(map.staged.attached.size());
  const auto walks = static_cast<double>(map.staged.retired.size() + map.staged.issued.size());
  const double update = kRemoval * removals + kInsertion * insertions +
                        kRetracing * (removals + insertions) + kConstraint * walks;
  const double anew = kBuiltVertex * static_cast<double>(map.live_points) +
                      kConstraint * static_cast<double>(map.live_constraints);
  return update > options.rebuild_cost_ratio * anew;
}

CarvingDelta Carver::Impl::update() {
  tracer.erase(map.staged.retired);
  vertices.update(map.staged);
  const carving::TriangulationChange& change = delaunay.commit();
  tracer.relocate();
  tracer.retrace(change);
  tracer.prune();
  tracer.trace(map.staged.issued);
  thin();
  CarvingDelta delta = net_delta(change);
  finish();
  return delta;
}

// None only before the first build: later, a map of a single position keeps the cube's size.
std::optional<carving::Hull> Carver::Impl::choose_hull() const {
  const carving::Extent extent = map.extent();
  std::optional<carving::Hull> chosen = fit_hull(extent, options);
  if (!chosen && delaunay.built()) {
    chosen = extent.empty ? hull : carving::moved_hull(hull, extent.low);
  }
  return chosen;
}

CarvingDelta Carver::Impl::rebuild(RebuildReason reason) {
  using carving::ConstraintIndex;
  const std::optional<carving::Hull> chosen = choose_hull();
  if (!chosen) {
    map.postpone();
    return {};
  }
  const CarvingDelta before = snapshot();
  hull = *chosen;
  vertices.rebuild(hull.corners());
  tracer.reset();
  for (auto& keyframe : map.keyframes) keyframe.start = carving::Feature{};
  std::vector<ConstraintIndex> constraints;
  for (const ConstraintIndex constraint : map.constraints.ids()) {
    carving::ConstraintState& state = map.constraints[constraint].state;
    if (state == carving::ConstraintState::kTraced) state = carving::ConstraintState::kNew;
    if (state == carving::ConstraintState::kNew) constraints.push_back(constraint);
  }
  map.staged.issued = std::move(constraints);
  tracer.relocate();
  tracer.note_all_cells();
  tracer.trace(map.staged.issued);
  thin();
  tracer.lists().take_changed();
  refresh_evidence(vertices.inserted());
  finish();
  ++rebuilds;
  last_rebuild = reason;
  cells_replaced = before.cells_added.size();
  return replacement(before, snapshot());
}

void Carver::Impl::finish() {
  vertices.finish();
  delaunay.finish();
  map.finish();
}

CarverStatistics Carver::Impl::collect_statistics() const {
  CarverStatistics s;
  s.points = map.live_points;
  s.vertices = vertices.live();
  s.keyframes = map.live_keyframes;
  s.constraints = map.live_constraints;
  s.thinned_constraints = map.thinned_constraints;
  const auto& lists = tracer.lists();
  const auto& states = delaunay.tetrahedra().states;
  for (const CellId cell : states.ids()) {
    if (states[cell] != carving::CellState::kKept) continue;
    const int64_t count = lists.constraints(cell);
    ++s.cells;
    s.carved_cells += count > 0;
    s.max_constraints_in_cell = std::max(s.max_constraints_in_cell, count);
  }
  s.constraint_cell_pairs = lists.pairs();
  s.memory_bytes = memory_bytes();
  s.over_memory_limit = over_limit;
  s.ignored_inputs = map.ignored;
  s.rebuilds = rebuilds;
  s.last_rebuild = last_rebuild;
  s.hull_half_size_mu = hull.half_size;
  s.cells_replaced = cells_replaced;
  s.runs_retraced = tracer.runs();
  s.constraints_traced = tracer.traced();
  return s;
}

}  // namespace foresight
