#include "procs/mesher/energies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace foresight {
namespace {

using Capacity = MaxFlow::Capacity;

/// The sum of all capacities is brought to about 2^58 by a power of two: the finest resolution that
/// cannot overflow, and the same labels when all coordinates are scaled by a power of two.
double capacity_scale(double total) {
  if (!(total > 0)) return 1;
  return std::ldexp(1.0, 58 - std::ilogb(total));
}

Capacity to_capacity(double scaled) { return static_cast<Capacity>(std::llround(scaled)); }

// ---- Visibility ----

constexpr double kVote = 1 << 20;     // capacity of one ray: weights are kept to a millionth of it
constexpr double kManyTouched = 0.5;  // share of the cells from which starting over is cheaper
constexpr Capacity kCertain = Capacity{1} << 48;  // of 2^28 rays, far more than a cell has

Capacity votes(double count) { return to_capacity(kVote * count); }

/// By facet: cosine of the angle between it and the cell's circumsphere; positive if the sphere's
/// centre is on the cell's side. Small empty spheres beside a large facet, cosine −1: the facet
/// bridges a gap. Cells that rounding made flat count as −1.
std::array<float, 4> circumsphere_cosines(const CellComplex& complex, int32_t cell) {
  std::array<float, 4> cosines{-1, -1, -1, -1};
  std::array<Eigen::Vector3d, 4> p;
  for (size_t k = 0; k < 4; ++k) {
    p[k] =
        complex.position_in_map(complex.vertex(4 * cell + static_cast<int32_t>(k))).cast<double>();
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
    const Eigen::Vector3d& q = p[static_cast<size_t>(f[0])];
    const Eigen::Vector3d outward =
        (p[static_cast<size_t>(f[1])] - q).cross(p[static_cast<size_t>(f[2])] - q);
    const double cosine = outward.dot(q - p[0] - centre) / (outward.norm() * radius);
    if (std::isfinite(cosine)) cosines[k] = static_cast<float>(std::clamp(cosine, -1.0, 1.0));
  }
  return cosines;
}

bool at_hull(const CellComplex& complex, int32_t cell) {
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    if (!complex.vertex_id(complex.vertex(slot)).is_point()) return true;
  }
  return false;
}

double pocket_weight(const CellComplex& complex, int32_t cell, double weight) {
  if (complex.constraints(cell) > 0 || at_hull(complex, cell)) return 0;
  int crossed = 0;
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    crossed += complex.twin(slot) >= 0 && complex.constraints(complex.twin(slot) / 4) > 0;
  }
  constexpr std::array<double, 5> kShare{0, 0.2, 1, 2, 2};
  return weight * kShare[static_cast<size_t>(crossed)];
}

/// Rays that came in by an edge or a vertex crossed no facet: they speak for the cell itself.
Capacity free_votes(const CellComplex& complex, int32_t cell) {
  const CellVotes& v = complex.votes(cell);
  if (v.started > 0) return kCertain;
  const int64_t by_facet = int64_t{v.entered[0]} + v.entered[1] + v.entered[2] + v.entered[3];
  return votes(static_cast<double>(complex.constraints(cell) - by_facet));
}

Capacity entering(const CellComplex& complex, int32_t slot) {
  return votes(complex.votes(slot / 4).entered[static_cast<size_t>(slot % 4)]);
}

}  // namespace

void VisibilityGraph::reset() { *this = VisibilityGraph(weights_); }

void VisibilityGraph::update(CellComplex* complex, MaxFlow* flow) {
  std::vector<int32_t> cells = complex->take_touched();
  const bool anew =
      !started_ || static_cast<double>(cells.size()) > kManyTouched * complex->cell_count();
  if (anew) {
    cells.resize(static_cast<size_t>(complex->cell_limit()));
    std::iota(cells.begin(), cells.end(), 0);
    flow->reset(complex->cell_limit());
  }
  flow->grow_to(complex->cell_limit());
  cosines_.resize(static_cast<size_t>(complex->cell_limit()));
  started_ = true;
  for (const int32_t cell : cells) {
    if (complex->exists(cell)) {
      cosines_[static_cast<size_t>(cell)] = circumsphere_cosines(*complex, cell);
    }
    unlink_old(*complex, cell, flow);
  }
  for (const int32_t cell : cells) {
    weigh_cell(*complex, cell, anew ? Links::kOnce : Links::kAll, flow);
    if (!anew) weigh_neighbours(*complex, cell, flow);
  }
}

// A facet that has another cell behind it now, or none.
void VisibilityGraph::unlink_old(const CellComplex& complex, int32_t cell, MaxFlow* flow) const {
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    const int32_t twin = complex.exists(cell) ? complex.twin(slot) : -1;
    const int32_t old = flow->twin(slot);
    if (old < 0 || old == twin) continue;
    flow->unlink(slot);
    if (complex.exists(old / 4)) weigh_terminal(complex, old / 4, flow);
  }
}

void VisibilityGraph::weigh_cell(const CellComplex& complex, int32_t cell, Links links,
                                 MaxFlow* flow) const {
  if (!complex.exists(cell)) return flow->set_terminal(cell, 0);
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    const int32_t twin = complex.twin(slot);
    if (twin < 0 || (links == Links::kOnce && twin < slot)) continue;
    // Cut from a free cell to one that is not: by the rays that enter the latter here.
    const double worse = static_cast<double>(std::min(cosine(slot), cosine(twin)));
    const Capacity bad = votes(weights_.shape * (1 - worse));
    flow->set_link(slot, twin, entering(complex, twin) + bad, entering(complex, slot) + bad);
  }
  weigh_terminal(complex, cell, flow);
}

// Whether a neighbour is a pocket depends on this cell.
void VisibilityGraph::weigh_neighbours(const CellComplex& complex, int32_t cell,
                                       MaxFlow* flow) const {
  if (!complex.exists(cell)) return;
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    if (complex.twin(slot) >= 0) weigh_terminal(complex, complex.twin(slot) / 4, flow);
  }
}

void VisibilityGraph::weigh_terminal(const CellComplex& complex, int32_t cell,
                                     MaxFlow* flow) const {
  Capacity terminal = free_votes(complex, cell) +
                      votes(pocket_weight(complex, cell, weights_.pocket)) -
                      votes(weights_.surface * complex.votes(cell).ended);
  for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
    if (complex.twin(slot) < 0) terminal -= votes(weights_.shape);
  }
  flow->set_terminal(cell, terminal);
}

// ---- Eq. (1) ----

// A t-link that exceeds the cell's n-links decides its label, however large it is: it is cut to
// just above their sum, which keeps huge hull cells from eating up the resolution.
void weigh_by_volume(const CellComplex& complex, double lambda_mu, int32_t min_constraints,
                     MaxFlow* flow) {
  const int32_t cells = complex.cell_limit();
  double total_area = 0;
  std::vector<double> areas(static_cast<size_t>(4 * cells), 0);  // by slot
  for (int32_t slot = 0; slot < 4 * cells; ++slot) {
    if (!complex.exists(slot / 4)) continue;
    const int32_t twin = complex.twin(slot);
    double& area = areas[static_cast<size_t>(slot)];
    area = twin >= 0 && twin < slot ? areas[static_cast<size_t>(twin)] : complex.area(slot);
    total_area += area;
  }
  const double scale = capacity_scale(lambda_mu * total_area);
  flow->reset(cells);
  for (int32_t cell = 0; cell < cells; ++cell) {
    if (!complex.exists(cell)) continue;
    Capacity links = 0;
    for (int32_t slot = 4 * cell; slot < 4 * cell + 4; ++slot) {
      const Capacity capacity = to_capacity(scale * lambda_mu * areas[static_cast<size_t>(slot)]);
      const int32_t twin = complex.twin(slot);
      links += capacity;
      if (twin < 0) {
        flow->add_terminal(cell, -capacity);
      } else if (slot < twin) {
        flow->connect(slot, twin, capacity, capacity);
      }
    }
    const double volume = scale * complex.volume(cell);
    const bool heavy = links == 0 || volume > static_cast<double>(links);
    const Capacity weight = heavy ? links + 1 : to_capacity(volume);
    flow->add_terminal(cell, complex.constraints(cell) >= min_constraints ? weight : -weight);
  }
}

}  // namespace foresight
