#include "procs/mesher/cell_complex.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/check.h"

namespace foresight {
namespace {

/// Cell ids are dense: they may exceed the number of cells only as far as a lively history of
/// removals explains.
int64_t max_cell_id(int64_t cells, int64_t added) {
  constexpr int64_t kSpread = 16;
  constexpr int64_t kSlack = 65536;
  constexpr int64_t kSlotsFitInt = std::numeric_limits<int32_t>::max() / 4 - 1;
  return std::min(kSpread * (cells + added) + kSlack, kSlotsFitInt);
}

/// The volume, or nothing when the cell is inverted by more than rounding its vertices to float
/// explains: moving a vertex by δ changes the determinant by at most δ × twice a facet's area.
std::optional<double> checked_volume(const std::array<Eigen::Vector3d, 4>& p) {
  const Eigen::Vector3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  const double determinant = a.dot(b.cross(c));
  double magnitude = 0;
  for (const Eigen::Vector3d& x : p) magnitude = std::max(magnitude, x.cwiseAbs().maxCoeff());
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double rounding = magnitude * std::numeric_limits<float>::epsilon();
  const double tolerance = 2 * rounding * (la * lb + lb * lc + lc * la);
  if (determinant < -tolerance) return std::nullopt;
  return std::max(determinant, 0.0) / 6;
}

bool makes_sense(const VertexEvidence& evidence) {
  constexpr float kPi = 3.15f;  // and a little
  return evidence.observations >= 0 && evidence.spread_rad >= 0 && evidence.spread_rad <= kPi;
}

}  // namespace

struct CellComplex::Journal {
  enum class Step {
    kCellRemoved,
    kCellAdded,
    kAllCellsAdded,  // of a complex that had none
    kCellUpdated,
    kVertexRemoved,
    kVertexChanged,
    kVertexNew
  };
  using SavedCell = Id<struct SavedCellTag>;
  using SavedPoint = Id<struct SavedPointTag>;
  struct Entry {
    Step step;
    CellId cell = {};  // … or
    VertexIndex vertex = {};
    SavedCell saved_cell = {};  // what it was
    SavedPoint saved_point = {};
  };
  struct Cell {
    Corners corners{};
    Evidence evidence{};
    double volume = 0;
  };
  std::vector<Entry> steps;
  IdVector<SavedCell, Cell> cells;
  IdVector<SavedPoint, Point> points;

  void note(Step step, CellId cell) { steps.push_back({.step = step, .cell = cell}); }
  void note(Step step, CellId cell, const Cell& was) {
    steps.push_back({.step = step, .cell = cell, .saved_cell = cells.push_back(was)});
  }
  void note(Step step, VertexIndex vertex) { steps.push_back({.step = step, .vertex = vertex}); }
  void note(Step step, VertexIndex vertex, const Point& was) {
    steps.push_back({.step = step, .vertex = vertex, .saved_point = points.push_back(was)});
  }
};

// ---- The transaction ----------------------------------------------------------------------------

ApplyResult CellComplex::apply(const CarvingDelta& delta) {
  Journal journal;
  journal.steps.reserve(delta.cells_removed.size() + delta.vertices_removed.size() +
                        delta.vertices_set.size() + delta.cells_added.size() +
                        delta.cells_updated.size() + delta.vertices_updated.size());
  const size_t old_cell_limit = constraints_.size();
  const ApplyResult result = try_apply(delta, &journal);
  if (result == ApplyResult::kOk) {
    commit(journal);
  } else {
    roll_back(journal);
    resize_cells(old_cell_limit);
  }
  return result;
}

ApplyResult CellComplex::try_apply(const CarvingDelta& delta, Journal* journal) {
  const auto apply_all = [&](const auto& items, auto&& apply_one) {
    for (const auto& item : items) {
      const ApplyResult result = (this->*apply_one)(item, journal);
      if (result != ApplyResult::kOk) return result;
    }
    return ApplyResult::kOk;
  };
  CellId largest;
  for (const CarvingCell& cell : delta.cells_added) {
    if (!cell.id.is_valid()) return ApplyResult::kCellIdOutOfRange;
    largest = std::max(largest, cell.id);
  }
  if (largest >= cell_limit()) {
    if (largest.value() > max_cell_id(cell_count_, delta.cells_added.size())) {
      return ApplyResult::kCellIdOutOfRange;
    }
    resize_cells(largest.index() + 1);
  }
  const bool changes_cells = !delta.cells_removed.empty() || !delta.cells_added.empty();
  if (changes_cells && cell_count_ > 0) know_facets();
  ApplyResult result = apply_all(delta.cells_removed, &CellComplex::remove_cell);
  if (result != ApplyResult::kOk) return result;
  result = apply_all(delta.vertices_removed, &CellComplex::remove_vertex);
  if (result != ApplyResult::kOk) return result;
  result = apply_all(delta.vertices_set, &CellComplex::set_vertex);
  if (result != ApplyResult::kOk) return result;
  if (cell_count_ == 0 && !delta.cells_added.empty()) {
    result = add_all_cells(delta.cells_added);
    if (result == ApplyResult::kOk) journal->note(Journal::Step::kAllCellsAdded, CellId());
  } else {
    result = apply_all(delta.cells_added, &CellComplex::add_cell);
  }
  if (result != ApplyResult::kOk) return result;
  result = apply_all(delta.cells_updated, &CellComplex::update_cell);
  if (result != ApplyResult::kOk) return result;
  return apply_all(delta.vertices_updated, &CellComplex::update_vertex);
}

void CellComplex::resize_cells(size_t limit) {
  constraints_.resize(limit, -1);
  votes_.resize(limit);
  std::erase_if(touched_, [&](CellId cell) { return cell.index() >= limit; });
  is_touched_.resize(limit, 0);
  volumes_.resize(limit, 0);
  vertices_.resize(4 * limit);
  twins_.resize(4 * limit);
}

/// Indices of removed vertices become free only now: until here a rollback may need them back.
void CellComplex::commit(const Journal& journal) {
  for (const Journal::Entry& entry : journal.steps) {
    if (entry.step == Journal::Step::kVertexRemoved) free_points_.push_back(entry.vertex);
  }
}

void CellComplex::roll_back(const Journal& journal) {
  using Step = Journal::Step;
  for (auto entry = journal.steps.rbegin(); entry != journal.steps.rend(); ++entry) {
    const CellId cell = entry->cell;
    const VertexIndex i = entry->vertex;
    switch (entry->step) {
      case Step::kCellRemoved: {
        const Journal::Cell& was = journal.cells[entry->saved_cell];
        FORESIGHT_CHECK(attach(cell, was.corners, was.evidence, was.volume) == ApplyResult::kOk);
        break;
      }
      case Step::kCellAdded:
        detach(cell);
        break;
      case Step::kAllCellsAdded:
        remove_all_cells();
        break;
      case Step::kCellUpdated:
        set_evidence(cell, journal.cells[entry->saved_cell].evidence);
        break;
      case Step::kVertexRemoved:
        points_[i] = journal.points[entry->saved_point];
        vertex_table_.insert(vertex_id(i), i);
        break;
      case Step::kVertexChanged:
        points_[i] = journal.points[entry->saved_point];
        break;
      case Step::kVertexNew:
        vertex_table_.erase(vertex_id(i));
        points_[i] = Point{};
        free_points_.push_back(i);
        break;
    }
  }
}

void CellComplex::reset() { *this = CellComplex{}; }

void CellComplex::touch(CellId cell) {
  if (is_touched_[cell] != 0) return;
  is_touched_[cell] = 1;
  touched_.push_back(cell);
}

std::vector<CellId> CellComplex::take_touched() {
  for (const CellId cell : touched_) is_touched_[cell] = 0;
  return std::exchange(touched_, {});
}

void CellComplex::set_evidence(CellId cell, const Evidence& evidence) {
  touch(cell);
  constraints_[cell] = evidence.constraints;
  votes_[cell] = evidence.votes;
}

bool CellComplex::Evidence::makes_sense() const {
  int64_t crossing = votes.started;
  for (const int32_t n : votes.entered) {
    if (n < 0) return false;
    crossing += n;
  }
  return votes.started >= 0 && votes.ended >= 0 && votes.ended <= kMaxVotes &&
         crossing <= constraints && constraints <= kMaxVotes;
}

// ---- Single steps -------------------------------------------------------------------------------

ApplyResult CellComplex::remove_cell(const CellId& cell, Journal* journal) {
  if (!constraints_.contains(cell) || !exists(cell)) return ApplyResult::kUnknownCell;
  Journal::Cell saved{{}, {constraints(cell), votes(cell)}, volume(cell)};
  for (const Slot slot : slots_of(cell)) saved.corners[corner_of(slot)] = vertex(slot);
  journal->note(Journal::Step::kCellRemoved, cell, saved);
  detach(cell);
  return ApplyResult::kOk;
}

ApplyResult CellComplex::remove_vertex(const VertexId& id, Journal* journal) {
  const VertexIndex i = vertex_table_.find(id);
  if (!i.is_valid()) return ApplyResult::kUnknownVertex;
  Point& point = points_[i];
  if (point.degree > 0) return ApplyResult::kVertexInUse;
  journal->note(Journal::Step::kVertexRemoved, i, point);
  point = Point{};
  vertex_table_.erase(id);
  return ApplyResult::kOk;
}

ApplyResult CellComplex::set_vertex(const CarvingVertex& vertex, Journal* journal) {
  if (!vertex.id.is_valid()) return ApplyResult::kVertexIdOutOfRange;
  if (!vertex.position_in_map.allFinite()) return ApplyResult::kBadPosition;
  if (!makes_sense(vertex.evidence)) return ApplyResult::kBadEvidence;
  VertexIndex i = vertex_table_.find(vertex.id);
  if (!i.is_valid()) {
    i = new_point();
    journal->note(Journal::Step::kVertexNew, i);
    points_[i] = {vertex.position_in_map, vertex.evidence, vertex.id, 0, true};
    vertex_table_.insert(vertex.id, i);
    return ApplyResult::kOk;
  }
  Point& point = points_[i];
  const bool moved = point.position_in_map != vertex.position_in_map;
  if (moved && point.degree > 0) return ApplyResult::kVertexInUse;
  journal->note(Journal::Step::kVertexChanged, i, point);
  point.position_in_map = vertex.position_in_map;
  point.evidence = vertex.evidence;
  return ApplyResult::kOk;
}

ApplyResult CellComplex::update_vertex(const CarvingVertexUpdate& update, Journal* journal) {
  const VertexIndex i = vertex_table_.find(update.id);
  if (!i.is_valid()) return ApplyResult::kUnknownVertex;
  if (!makes_sense(update.evidence)) return ApplyResult::kBadEvidence;
  journal->note(Journal::Step::kVertexChanged, i, points_[i]);
  points_[i].evidence = update.evidence;
  return ApplyResult::kOk;
}

ApplyResult CellComplex::check_cell(const CarvingCell& cell, Corners* corners,
                                    double* volume) const {
  if (exists(cell.id)) return ApplyResult::kDuplicateCell;
  if (!Evidence{cell.constraints, cell.votes}.makes_sense()) return ApplyResult::kBadConstraints;
  const ApplyResult found = find_corners(cell, corners);
  if (found != ApplyResult::kOk) return found;
  std::array<Eigen::Vector3d, 4> positions;
  for (size_t k = 0; k < 4; ++k) positions[k] = position_in_map((*corners)[k]).cast<double>();
  const std::optional<double> checked = checked_volume(positions);
  if (!checked) return ApplyResult::kInvertedCell;
  *volume = *checked;
  return ApplyResult::kOk;
}

ApplyResult CellComplex::add_cell(const CarvingCell& cell, Journal* journal) {
  Corners corners{};
  double volume = 0;
  ApplyResult result = check_cell(cell, &corners, &volume);
  if (result != ApplyResult::kOk) return result;
  result = attach(cell.id, corners, {cell.constraints, cell.votes}, volume);
  if (result != ApplyResult::kOk) return result;
  journal->note(Journal::Step::kCellAdded, cell.id);
  return result;
}

ApplyResult CellComplex::update_cell(const CarvingCellUpdate& update, Journal* journal) {
  const CellId cell = update.id;
  if (!constraints_.contains(cell) || !exists(cell)) return ApplyResult::kUnknownCell;
  const Evidence evidence{update.constraints, update.votes};
  if (!evidence.makes_sense()) return ApplyResult::kBadConstraints;
  journal->note(Journal::Step::kCellUpdated, cell, {{}, {constraints(cell), votes(cell)}, 0});
  set_evidence(cell, evidence);
  return ApplyResult::kOk;
}

ApplyResult CellComplex::find_corners(const CarvingCell& cell, Corners* corners) const {
  for (size_t k = 0; k < 4; ++k) {
    const VertexIndex corner = vertex_table_.find(cell.vertices[k]);
    if (!corner.is_valid()) return ApplyResult::kUnknownVertex;
    (*corners)[k] = corner;
    for (size_t l = 0; l < k; ++l) {
      if ((*corners)[l] == corner) return ApplyResult::kRepeatedVertex;
    }
  }
  return ApplyResult::kOk;
}

VertexIndex CellComplex::new_point() {
  if (free_points_.empty()) return points_.emplace_back();
  const VertexIndex i = free_points_.back();
  free_points_.pop_back();
  return i;
}

// ---- Neighbours ---------------------------------------------------------------------------------

ApplyResult CellComplex::attach(CellId cell, const Corners& corners, const Evidence& evidence,
                                double volume) {
  for (const Slot slot : slots_of(cell)) vertices_[slot] = corners[corner_of(slot)];
  for (int32_t k = 0; k < 4; ++k) {
    const ApplyResult result = attach_facet(slot_of(cell, k));
    if (result == ApplyResult::kOk) continue;
    while (k-- > 0) detach_facet(slot_of(cell, k));
    return result;
  }
  for (const VertexIndex corner : corners) ++points_[corner].degree;
  set_evidence(cell, evidence);
  volumes_[cell] = volume;
  ++cell_count_;
  return ApplyResult::kOk;
}

void CellComplex::detach(CellId cell) {
  for (const Slot slot : slots_of(cell)) {
    detach_facet(slot);
    --points_[vertex(slot)].degree;
  }
  clear_cell(cell);
}

void CellComplex::clear_cell(CellId cell) {
  touch(cell);
  constraints_[cell] = -1;
  votes_[cell] = {};
  volumes_[cell] = 0;
  --cell_count_;
}

ApplyResult CellComplex::attach_facet(Slot slot) {
  const FacetKey key = facet_key(slot);
  const FacetTable::Entry* entry = facets_.find(key);
  if (entry == nullptr) {
    twins_[slot] = Slot();
    facets_.insert(key, slot);
    ++facet_count_;
    return ApplyResult::kOk;
  }
  if (twin(entry->slot).is_valid()) return ApplyResult::kCrowdedFacet;
  if (entry->key == key) return ApplyResult::kOverlappingCells;
  twins_[slot] = entry->slot;
  twins_[entry->slot] = slot;
  return ApplyResult::kOk;
}

void CellComplex::detach_facet(Slot slot) {
  const FacetKey key = facet_key(slot);
  FacetTable::Entry* entry = facets_.find(key);
  FORESIGHT_CHECK(entry != nullptr);
  if (!twin(slot).is_valid()) {
    facets_.erase(entry);
    --facet_count_;
    return;
  }
  *entry = {twin(slot), key.reversed()};
  twins_[entry->slot] = Slot();
  twins_[slot] = Slot();
}

// Counter-clockwise seen from outside of the cell.
std::array<VertexIndex, 3> CellComplex::facet_vertices(Slot slot) const {
  const auto& corners = kFacetCorners[corner_of(slot)];
  const CellId cell = cell_of(slot);
  return {vertex(slot_of(cell, corners[0])), vertex(slot_of(cell, corners[1])),
          vertex(slot_of(cell, corners[2]))};
}

FacetKey CellComplex::facet_key(Slot slot) const { return FacetKey::of(facet_vertices(slot)); }

/// Summed up in the order of vertex ids: the same number whichever cell came first.
double CellComplex::area(Slot slot) const {
  std::array<VertexIndex, 3> v = facet_vertices(slot);
  std::sort(v.begin(), v.end(),
            [&](VertexIndex a, VertexIndex b) { return vertex_id(a) < vertex_id(b); });
  const Eigen::Vector3d origin = position_in_map(v[0]).cast<double>();
  const Eigen::Vector3d a = position_in_map(v[1]).cast<double>() - origin;
  const Eigen::Vector3d b = position_in_map(v[2]).cast<double>() - origin;
  return a.cross(b).norm() / 2;
}

}  // namespace foresight
