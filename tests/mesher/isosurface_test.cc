#include "procs/mesher/isosurface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "tests/common/plain_ids.h"
#include "tests/mesher/delaunay_carving.h"
#include "tests/mesher/mesher_checks.h"

namespace foresight {
namespace {

IdVector<CellId, uint8_t> labels_of(const CellComplex& complex) {
  IdVector<CellId, uint8_t> carved(complex.cell_limit().index());
  for (const CellId cell : complex.cells()) {
    carved[cell] = complex.constraints(cell) > 0;
  }
  return carved;
}

double carved_volume(const CellComplex& complex, const IdVector<CellId, uint8_t>& carved) {
  double volume = 0;
  for (const CellId cell : complex.cells()) {
    if (carved[cell] != 0) volume += complex.volume(cell);
  }
  return volume;
}

/// By the divergence theorem, with normals that point inwards.
double enclosed_volume(const Mesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> p;
    for (size_t j = 0; j < 3; ++j) {
      p[j] = mesh.vertices_in_map[static_cast<size_t>(t[j])].cast<double>();
    }
    volume -= p[0].dot(p[1].cross(p[2])) / 6;
  }
  return volume;
}

void expect_good_surface(const CellComplex& complex, const IdVector<CellId, uint8_t>& carved,
                         Isosurface* split) {
  const double volume = carved_volume(complex, carved);
  const Isosurface plain = extract_isosurface(complex, carved, ManifoldRepair::kNone);
  EXPECT_TRUE(find_defects(plain.mesh).closed_and_oriented());
  EXPECT_NEAR(enclosed_volume(plain.mesh), volume, 1e-5 * volume);
  EXPECT_EQ(std::set<VertexId>(plain.mesh.vertex_ids.begin(), plain.mesh.vertex_ids.end()).size(),
            plain.mesh.vertex_ids.size());
  *split = extract_isosurface(complex, carved, ManifoldRepair::kSplit);
  EXPECT_EQ(find_problem(split->mesh), "");
  EXPECT_NEAR(enclosed_volume(split->mesh), volume, 1e-5 * volume);
  EXPECT_EQ(split->mesh.vertex_ids.size(), plain.mesh.vertex_ids.size() +
                                               static_cast<size_t>(split->split_vertices) +
                                               static_cast<size_t>(split->split_edges));
  EXPECT_EQ(split->mesh.triangles.size(),
            plain.mesh.triangles.size() + 2 * static_cast<size_t>(split->split_edges));
}

TEST(Isosurface, NothingCarvedGivesAnEmptyMesh) {
  CellComplex complex;
  EXPECT_TRUE(extract_isosurface(complex, {}, ManifoldRepair::kSplit).mesh.triangles.empty());
  ASSERT_EQ(complex.apply(make_lattice(2, 1, [] { return 0; })), ApplyResult::kOk);
  const auto surface = extract_isosurface(complex, labels_of(complex), ManifoldRepair::kSplit);
  EXPECT_TRUE(surface.mesh.triangles.empty());
  EXPECT_TRUE(surface.mesh.vertices_in_map.empty());
}

TEST(Isosurface, AllCarvedGivesTheHull) {
  CellComplex complex;
  ASSERT_EQ(complex.apply(make_lattice(3, 1, [] { return 1; })), ApplyResult::kOk);
  Isosurface surface;
  expect_good_surface(complex, labels_of(complex), &surface);
  EXPECT_EQ(surface.mesh.triangles.size(), 6u * 9 * 2);
  EXPECT_EQ(surface.split_vertices, 0);
  EXPECT_EQ(surface.split_edges, 0);
}

TEST(Isosurface, NormalPointsIntoCarvedSpace) {
  CarvingDelta delta;
  delta.vertices_set =
      vertices({{10, {0, 0, 0}}, {11, {1, 0, 0}}, {12, {0, 1, 0}}, {13, {0, 0, 1}}});
  delta.cells_added = cells({{0, {10, 11, 12, 13}, 1}});
  CellComplex complex;
  ASSERT_EQ(complex.apply(delta), ApplyResult::kOk);
  const Mesh mesh = extract_isosurface(complex, labels_of(complex), ManifoldRepair::kSplit).mesh;
  ASSERT_EQ(mesh.triangles.size(), 4u);
  ASSERT_EQ(mesh.vertex_ids.size(), 4u);
  const Eigen::Vector3f inside(0.2f, 0.2f, 0.2f);
  for (const auto& t : mesh.triangles) {
    const auto p = [&](size_t j) { return mesh.vertices_in_map[static_cast<size_t>(t[j])]; };
    EXPECT_GT((p(1) - p(0)).cross(p(2) - p(0)).dot(inside - p(0)), 0);
  }
  for (size_t i = 0; i < 4; ++i) {
    const auto& vertex = delta.vertices_set[static_cast<size_t>(mesh.vertex_ids[i].value() - 10)];
    EXPECT_EQ(mesh.vertices_in_map[i], vertex.position_in_map);
  }
}

TEST(Isosurface, TwoCellsThatTouchInAnEdgeAreTakenApart) {
  CarvingDelta delta;
  delta.vertices_set = vertices({{0, {0, 0, 0}},
                                 {1, {0, 0, 1}},
                                 {2, {1, 0, 0}},
                                 {3, {1, 1, 0}},
                                 {4, {-1, 0, 0}},
                                 {5, {-1, -1, 0}}});
  delta.cells_added = cells({{0, {0, 2, 3, 1}, 1}, {1, {0, 4, 5, 1}, 1}});
  CellComplex complex;
  ASSERT_EQ(complex.apply(delta), ApplyResult::kOk);
  Isosurface surface;
  expect_good_surface(complex, labels_of(complex), &surface);
  EXPECT_EQ(surface.split_vertices, 2);
  EXPECT_EQ(surface.split_edges, 0);
  EXPECT_EQ(surface.mesh.vertex_ids.size(), 8u);
}

TEST(Isosurface, ClosedOrientedManifoldOnRandomDelaunayComplexes) {
  std::mt19937 random(1);
  int32_t split_vertices = 0, split_edges = 0;
  for (uint32_t trial = 0; trial < 60; ++trial) {
    std::uniform_real_distribution<float> coordinate(-1, 1);
    DelaunayCarving carving;
    if (trial % 2 == 0) carving.add_hull_corners(4);
    for (int32_t i = 0; i < 150; ++i) {
      const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
      carving.set_point(i, {x, y, z});
    }
    carving.carve_at_random(0.1 * (1 + trial % 9), trial);
    CellComplex complex;
    ASSERT_EQ(complex.apply(carving.snapshot()), ApplyResult::kOk);
    Isosurface surface;
    expect_good_surface(complex, labels_of(complex), &surface);
    split_vertices += surface.split_vertices;
    split_edges += surface.split_edges;
  }
  EXPECT_GT(split_vertices, 1000);  // the repair had something to do …
  EXPECT_GT(split_edges, 100);      // … of both kinds
}

TEST(Isosurface, ClosedOrientedManifoldOnRandomLattices) {
  std::mt19937 random(2);
  for (uint32_t trial = 0; trial < 40; ++trial) {
    std::bernoulli_distribution is_carved(0.1 * (1 + trial % 9));
    CellComplex complex;
    ASSERT_EQ(complex.apply(make_lattice(5, 1, [&] { return is_carved(random) ? 1 : 0; })),
              ApplyResult::kOk);
    Isosurface surface;
    expect_good_surface(complex, labels_of(complex), &surface);
  }
}

}  // namespace
}  // namespace foresight
