#include "procs/mesher/energies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace foresight {
namespace {

using Capacity = MaxFlow::Capacity;

static_assert(MaxFlow::kDegree == 4);
MaxFlow::ArcId arc_of(Slot slot) { return MaxFlow::ArcId(slot.value()); }
Slot slot_behind(MaxFlow::ArcId arc) { return Slot(arc.value()); }

/// The sum of all capacities is brought to about 2^58 by a power of two: the finest resolution that
/// cannot overflow, and the same labels when all coordinates are scaled by a power of two.
double capacity_scale(double total) {
  if (!(total > 0)) return 1;
  return std::ldexp(1.0, 58 - std::ilogb(total));
}

Capacity to_capacity(double scaled) { return static_cast<Capacity>(std::llround(scaled)); }

// ---- Visibility ----

constexpr double kVote =
    1 << 20;  // capacity of one constraint: weights are kept to a millionth of it
constexpr double kManyTouched = 0.5;  // share of the cells from which starting over is cheaper
constexpr Capacity kCertain = Capacity{1} << 48;  // of 2^28 constraints, far more than a cell has

Capacity votes(double count) { return to_capacity(kVote * count); }

/// By facet: cosine of the angle between it and the cell's circumsphere; positive if the sphere's
/// centre is on the cell's side. Small empty spheres beside a large facet, cosine −1: the facet
/// bridges a gap. Cells that rounding made flat count as −1.
std::array<float, 4> circumsphere_cosines(const CellComplex& complex, CellId cell) {
  std::array<float, 4> cosines{-1, -1, -1, -1};
  std::array<Eigen::Vector3d, 4> p;
  for (int k = 0; k < 4; ++k) {
    p[k] = complex.position_in_map(complex.vertex(slot_of(cell, k))).cast<double>();
  }
  const Eigen::Vector3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  const Eigen::Vector3d bc = b.cross(c);
  const double determinant = 2 * a.dot(bc);
  if (!(determinant > 0)) return cosines;
  const Eigen::Vector3d centre =
      (a.squaredNorm() * bc + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b)) /
      determinant;
  const double radius = centre.norm();
  for (size_t k = 0; k < 4; ++k) {
    const auto& f = kFacetCorners[k];
    const Eigen::Vector3d& q = p[f[0]];
    const Eigen::Vector3d outward = (p[f[1]] - q).cross(p[f[2]] - q);
    const double cosine = outward.dot(q - p[0] - centre) / (outward.norm() * radius);
    if (std::isfinite(cosine)) cosines[k] = static_cast<float>(std::clamp(cosine, -1.0, 1.0));
  }
  return cosines;
}

bool at_hull(const CellComplex& complex, CellId cell) {
  for (const Slot slot : slots_of(cell)) {
    if (!complex.vertex_id(complex.vertex(slot)).is_point()) return true;
  }
  return false;
}

double pocket_weight(const CellComplex& complex, CellId cell, double weight) {
  if (complex.constraints(cell) > 0 || at_hull(complex, cell)) return 0;
  int crossed = 0;
  for (const Slot slot : slots_of(cell)) {
    const Slot twin = complex.twin(slot);
    crossed += twin.is_valid() && complex.constraints(cell_of(twin)) > 0;
  }
  constexpr std::array<double, 5> kShare{0, 0.2, 1, 2, 2};
  return weight * kShare[crossed];
}

/// Constraints that came in by an edge or a vertex crossed no facet: they speak for the cell
/// itself.
Capacity free_votes(const CellComplex& complex, CellId cell) {
  const CellVotes& v = complex.votes(cell);
  if (v.started > 0) return kCertain;
  const int64_t by_facet = int64_t{v.entered[0]} + v.entered[1] + v.entered[2] + v.entered[3];
  return votes(static_cast<double>(complex.constraints(cell) - by_facet));
}

Capacity entering(const CellComplex& complex, Slot slot) {
  return votes(complex.votes(cell_of(slot)).entered[corner_of(slot)]);
}

}  // namespace

void VisibilityGraph::reset() { *this = VisibilityGraph(weights_); }

void VisibilityGraph::update(CellComplex* complex, MaxFlow* flow) {
  std::vector<CellId> cells = complex->take_touched();
  const bool anew =
      !started_ || static_cast<double>(cells.size()) > kManyTouched * complex->cell_count();
  if (anew) {
    cells.clear();
    cells.reserve(complex->cell_limit().index());
    for (const CellId cell : complex->cells()) cells.push_back(cell);
    flow->reset(complex->cell_limit().value());
  }
  flow->grow_to(complex->cell_limit().value());
  cosines_.resize(complex->cell_limit().index());
  started_ = true;
  for (const CellId cell : cells) {
    if (complex->exists(cell)) {
      cosines_[cell] = circumsphere_cosines(*complex, cell);
    }
    unlink_old(*complex, cell, flow);
  }
  for (const CellId cell : cells) {
    weigh_cell(*complex, cell, anew ? Links::kOnce : Links::kAll, flow);
    if (!anew) weigh_neighbours(*complex, cell, flow);
  }
}

// A facet that has another cell behind it now, or none.
void VisibilityGraph::unlink_old(const CellComplex& complex, CellId cell, MaxFlow* flow) const {
  for (const Slot slot : slots_of(cell)) {
    const Slot twin = complex.exists(cell) ? complex.twin(slot) : Slot();
    const Slot old = slot_behind(flow->twin(arc_of(slot)));
    if (!old.is_valid() || old == twin) continue;
    flow->unlink(arc_of(slot));
    if (complex.exists(cell_of(old))) weigh_terminal(complex, cell_of(old), flow);
  }
}

void VisibilityGraph::weigh_cell(const CellComplex& complex, CellId cell, Links links,
                                 MaxFlow* flow) const {
  if (!complex.exists(cell)) return flow->set_terminal(node_of(cell), 0);
  for (const Slot slot : slots_of(cell)) {
    const Slot twin = complex.twin(slot);
    if (!twin.is_valid() || (links == Links::kOnce && twin < slot)) continue;
    // Cut from a free cell to one that is not: by the constraints that enter the latter here.
    const double worse = static_cast<double>(std::min(cosine(slot), cosine(twin)));
    const Capacity bad = votes(weights_.shape * (1 - worse));
    flow->set_link(arc_of(slot), arc_of(twin), entering(complex, twin) + bad,
                   entering(complex, slot) + bad);
  }
  weigh_terminal(complex, cell, flow);
}

// Whether a neighbour is a pocket depends on this cell.
void VisibilityGraph::weigh_neighbours(const CellComplex& complex, CellId cell,
                                       MaxFlow* flow) const {
  if (!complex.exists(cell)) return;
  for (const Slot slot : slots_of(cell)) {
    const Slot twin = complex.twin(slot);
    if (twin.is_valid()) weigh_terminal(complex, cell_of(twin), flow);
  }
}

void VisibilityGraph::weigh_terminal(const CellComplex& complex, CellId cell, MaxFlow* flow) const {
  Capacity terminal = free_votes(complex, cell) +
                      votes(pocket_weight(complex, cell, weights_.pocket)) -
                      votes(weights_.surface * complex.votes(cell).ended);
  for (const Slot slot : slots_of(cell)) {
    if (!complex.twin(slot).is_valid()) terminal -= votes(weights_.shape);
  }
  flow->set_terminal(node_of(cell), terminal);
}

// ---- Eq. (1) ----

// A t-link that exceeds the cell's n-links decides its label, however large it is: it is cut to
// just above their sum, which keeps huge hull cells from eating up the resolution.
void weigh_by_volume(const CellComplex& complex, double lambda_mu, int32_t min_constraints,
                     MaxFlow* flow) {
  double total_area = 0;
  IdVector<Slot, double> areas(4 * complex.cell_limit().index(), 0);
  for (const Slot slot : complex.slots()) {
    if (!complex.exists(cell_of(slot))) continue;
    const Slot twin = complex.twin(slot);
    areas[slot] = twin.is_valid() && twin < slot ? areas[twin] : complex.area(slot);
    total_area += areas[slot];
  }
  const double scale = capacity_scale(lambda_mu * total_area);
  flow->reset(complex.cell_limit().value());
  for (const CellId cell : complex.cells()) {
    if (!complex.exists(cell)) continue;
    Capacity links = 0;
    for (const Slot slot : slots_of(cell)) {
      const Capacity capacity = to_capacity(scale * lambda_mu * areas[slot]);
      const Slot twin = complex.twin(slot);
      links += capacity;
      if (!twin.is_valid()) {
        flow->add_terminal(node_of(cell), -capacity);
      } else if (slot < twin) {
        flow->connect(arc_of(slot), arc_of(twin), capacity, capacity);
      }
    }
    const double volume = scale * complex.volume(cell);
    const bool heavy = links == 0 || volume > static_cast<double>(links);
    const Capacity weight = heavy ? links + 1 : to_capacity(volume);
    flow->add_terminal(node_of(cell),
                       complex.constraints(cell) >= min_constraints ? weight : -weight);
  }
}

}  // namespace foresight
