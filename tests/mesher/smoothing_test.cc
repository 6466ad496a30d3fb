// Smoothing evens a noisy room out and meets no ray.
#include "procs/mesher/smoothing.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "procs/mesher/isosurface.h"
#include "tests/mesher/delaunay_carving.h"

namespace foresight {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct Segment {
  Vector3f from, to;
};

/// A noisy room that cameras inside look at.
struct Room {
  CellComplex complex;
  std::vector<Segment> rays;
  Mesh mesh;

  explicit Room(uint32_t seed, float noise) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(-1, 1);
    DelaunayCarving carving;
    carving.add_hull_corners(20);
    std::vector<Vector3f> points;
    for (int32_t id = 0; id < 400; ++id) {
      Vector3f p(unit(random), unit(random), unit(random));
      const int axis = static_cast<int>(random() % 3);
      p[axis] = (p[axis] < 0 ? -1.f : 1.f) + noise * unit(random);
      points.push_back(p);
      carving.set_point(id, p);
    }
    for (const Vector3f& p : points) {
      for (int n = 0; n < 3; ++n) {
        rays.push_back({0.3f * Vector3f(unit(random), unit(random), unit(random)), p});
        carving.carve_segment(rays.back().from, rays.back().to);
      }
    }
    EXPECT_EQ(complex.apply(carving.take_delta()), ApplyResult::kOk);
    IdVector<CellId, uint8_t> carved(complex.cell_limit().index());
    for (const CellId cell : complex.cells()) {
      carved[cell] = complex.constraints(cell) > 0;
    }
    mesh = extract_isosurface(complex, carved, ManifoldRepair::kSplit).mesh;
  }
};

/// Strictly inside the triangle, strictly between the segment's ends (a thousandth is left out).
bool meets(const Segment& s, const Mesh& mesh, const std::array<int32_t, 3>& t) {
  const auto corner = [&](size_t j) {
    return mesh.vertices_in_map[static_cast<size_t>(t[j])].cast<double>();
  };
  const Vector3d from = s.from.cast<double>(), d = s.to.cast<double>() - from;
  const Vector3d a = corner(0), e1 = corner(1) - a, e2 = corner(2) - a;
  const Vector3d q = d.cross(e2);
  const double det = e1.dot(q);
  if (std::abs(det) < 1e-15) return false;
  const Vector3d w = from - a, r = w.cross(e1);
  const double u = w.dot(q) / det, v = d.dot(r) / det, along = e2.dot(r) / det;
  constexpr double kMargin = 1e-9;
  return u > kMargin && v > kMargin && u + v < 1 - kMargin && along > 1e-3 && along < 1 - 1e-3;
}

int count_meetings(const Room& room, const Mesh& mesh) {
  int count = 0;
  for (const Segment& ray : room.rays) {
    for (const auto& t : mesh.triangles) count += meets(ray, mesh, t);
  }
  return count;
}

/// Mean distance of the vertices from the middle of their neighbours.
double roughness(const Mesh& mesh) {
  std::vector<Vector3d> sums(mesh.vertices_in_map.size(), Vector3d::Zero());
  std::vector<int> counts(sums.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (size_t j = 0; j < 3; ++j) {
      const auto v = static_cast<size_t>(t[j]), next = static_cast<size_t>(t[(j + 1) % 3]);
      sums[v] += mesh.vertices_in_map[next].cast<double>();
      ++counts[v];
    }
  }
  double sum = 0;
  for (size_t v = 0; v < sums.size(); ++v) {
    if (!mesh.vertex_ids[v].is_point()) continue;
    sum += (sums[v] / counts[v] - mesh.vertices_in_map[v].cast<double>()).norm();
  }
  return sum / static_cast<double>(sums.size());
}

/// Constraints of the cells that hold the point, its faces included.
int most_constraints_at(const CellComplex& complex, const Vector3f& point) {
  int most = 0;
  for (const CellId cell : complex.cells()) {
    if (!complex.exists(cell)) continue;
    std::array<Vector3d, 4> p;
    for (int32_t k = 0; k < 4; ++k) {
      p[static_cast<size_t>(k)] =
          complex.position_in_map(complex.vertex(slot_of(cell, k))).cast<double>();
    }
    bool inside = true;
    for (size_t k = 0; k < 4 && inside; ++k) {
      std::array<Vector3d, 4> q = p;
      q[k] = point.cast<double>();
      inside = (q[1] - q[0]).cross(q[2] - q[0]).dot(q[3] - q[0]) > 0;
    }
    if (inside) most = std::max(most, complex.constraints(cell));
  }
  return most;
}

TEST(Smoothing, EvensOutAndMeetsNoRay) {
  for (const uint32_t seed : {1u, 2u, 3u}) {
    const Room room(seed, 0.05f);
    ASSERT_EQ(count_meetings(room, room.mesh), 0) << "every ray is carved";
    Mesh smoothed = room.mesh;
    EXPECT_GT(smooth(room.complex, 5, &smoothed), 10);
    EXPECT_EQ(count_meetings(room, smoothed), 0);
    EXPECT_EQ(smoothed.triangles, room.mesh.triangles);
    EXPECT_TRUE(find_defects(smoothed).closed_and_oriented());
    EXPECT_LT(roughness(smoothed), roughness(room.mesh));
    int moved = 0;
    for (size_t v = 0; v < smoothed.vertices_in_map.size(); ++v) {
      if (smoothed.vertices_in_map[v] == room.mesh.vertices_in_map[v]) continue;
      ++moved;
      EXPECT_TRUE(smoothed.vertex_ids[v].is_point());
      EXPECT_EQ(most_constraints_at(room.complex, smoothed.vertices_in_map[v]), 0);
    }
    EXPECT_GT(moved, 10);
  }
}

/// The check is needed: moving without asking does meet rays.
TEST(Smoothing, WithoutTheRuleRaysWouldBeMet) {
  const Room room(1, 0.05f);
  Mesh moved = room.mesh;
  for (size_t v = 0; v < moved.vertices_in_map.size(); ++v) {
    if (moved.vertex_ids[v].is_point()) moved.vertices_in_map[v] *= 0.97f;  // into the room
  }
  EXPECT_GT(count_meetings(room, moved), 0);
}

TEST(Smoothing, NoPassesNoChange) {
  const Room room(1, 0.05f);
  Mesh same = room.mesh;
  EXPECT_EQ(smooth(room.complex, 0, &same), 0);
  EXPECT_EQ(same.vertices_in_map, room.mesh.vertices_in_map);
  Mesh empty;
  EXPECT_EQ(smooth(CellComplex{}, 3, &empty), 0);
}

}  // namespace
}  // namespace foresight
