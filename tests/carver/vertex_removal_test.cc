// What is left after a removal is the triangulation that never had the vertex.
#include "procs/carver/vertex_removal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace foresight::carving {
namespace {

using Sites = std::vector<Kernel::Point_3>;  // the first eight are the hull's corners

constexpr size_t kCorners = 8;

Sites hull() {
  Sites sites;
  for (int n = 0; n < 8; ++n) {
    sites.emplace_back(n & 1 ? 100 : -100, n & 2 ? 100 : -100, n & 4 ? 100 : -100);
  }
  return sites;
}

Sites random_points(int count, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  Sites sites = hull();
  for (int n = 0; n < count; ++n)
    sites.emplace_back(normal(random), normal(random), normal(random));
  return sites;
}

Sites lattice(int edge) {
  Sites sites = hull();
  for (int n = 0; n < edge * edge * edge; ++n) {
    sites.emplace_back(n % edge, n / edge % edge, n / edge / edge);
  }
  return sites;
}

// A centre whose removal leaves a hole with all others around it.
Sites sphere(int count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  Sites sites = hull();
  sites.emplace_back(0, 0, 0);
  for (int n = 0; n < count; ++n) {
    const double x = normal(random), y = normal(random), z = normal(random);
    const double r = std::sqrt(x * x + y * y + z * z);
    sites.emplace_back(x / r, y / r, z / r);
  }
  return sites;
}

using Cells = std::set<std::array<VertexIndex, 4>>;

Cells cells_of(const Triangulation& triangulation) {
  Cells cells;
  for (const auto cell : triangulation.finite_cell_handles()) {
    std::array<VertexIndex, 4> corners{};
    for (int i = 0; i < 4; ++i) corners[i] = cell->vertex(i)->info();
    std::sort(corners.begin(), corners.end());
    cells.insert(corners);
  }
  return cells;
}

struct Numbered {
  Triangulation triangulation;
  std::vector<VertexHandle> vertices;

  explicit Numbered(const Sites& sites, const std::set<size_t>& without = {}) {
    for (size_t n = 0; n < sites.size(); ++n) {
      vertices.push_back(without.contains(n) ? VertexHandle() : triangulation.insert(sites[n]));
      if (!without.contains(n)) vertices.back()->info() = VertexIndex::at(n);
    }
  }
};

// Removes `count` vertices in random order; returns how many were left to CGAL.
int remove_and_compare(const Sites& sites, int count) {
  Numbered all(sites);
  VertexRemoval removal;
  std::set<size_t> gone;
  std::mt19937 random(3);
  int left_to_cgal = 0;
  while (static_cast<int>(gone.size()) < count) {
    const size_t n = gone.empty() ? kCorners : kCorners + random() % (sites.size() - kCorners);
    if (!gone.insert(n).second) continue;
    std::vector<CellHandle> star;
    all.triangulation.incident_cells(all.vertices[n], std::back_inserter(star));
    if (!removal.remove(all.triangulation, all.vertices[n], star)) {
      ++left_to_cgal;
      all.triangulation.remove(all.vertices[n]);
    }
    EXPECT_TRUE(all.triangulation.is_valid());
    EXPECT_EQ(cells_of(all.triangulation), cells_of(Numbered(sites, gone).triangulation));
    if (testing::Test::HasFailure()) break;
  }
  return left_to_cgal;
}

TEST(VertexRemoval, LeavesTheTriangulationOfTheOthers) {
  EXPECT_EQ(remove_and_compare(random_points(150, 1), 140), 0);
}

TEST(VertexRemoval, EmptiesTheHull) { EXPECT_EQ(remove_and_compare(random_points(30, 2), 30), 0); }

TEST(VertexRemoval, DecidesTiesAsCgalDoes) {
  const int left_to_cgal = remove_and_compare(lattice(4), 50);
  EXPECT_LT(left_to_cgal, 25);
}

TEST(VertexRemoval, FillsALargeHole) { EXPECT_EQ(remove_and_compare(sphere(400), 1), 0); }

// Far from the origin rounding misleads the choice sooner; never the outcome.
TEST(VertexRemoval, IsRightFarFromTheOrigin) {
  Sites sites = hull();
  for (const auto& p : random_points(60, 5)) {
    if (std::abs(p.x()) < 50)
      sites.emplace_back(90 + 1e-7 * p.x(), 90 + 1e-7 * p.y(), 90 + 1e-7 * p.z());
  }
  remove_and_compare(sites, 50);
}

}  // namespace
}  // namespace foresight::carving
