// How long the mesher takes on a carving of real size: a room with boxes in it, seen by cameras on
// a path through it. Prints ms per phase; compare ratios within one run.
//
//   mesh-bench [--points 10000] [--repeats 5] [--lambda 0.005]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "common/tool_main.h"
#include "procs/mesher/mesher.h"
#include "tests/mesher/delaunay_carving.h"

namespace {

using namespace foresight;

struct Options {
  int32_t points = 10000;
  int32_t cameras = 100;
  int32_t rays_per_point = 6;
  int32_t repeats = 5;
  double outliers = 0.02;
  std::vector<double> lambdas = {0, 0.001, 0.005, 0.02, 0.1};
};

/// A point on the walls of a 6 × 5 × 3 room, with some noise, or off them if it is an outlier.
Eigen::Vector3f surface_point(double outliers, std::mt19937* random) {
  std::uniform_real_distribution<float> unit(-0.5f, 0.5f);
  std::normal_distribution<float> noise(0, 0.006f);
  const int axis = static_cast<int>((*random)() % 3);
  Eigen::Vector3f p(unit(*random), unit(*random), unit(*random));
  p[axis] = p[axis] < 0 ? -0.5f : 0.5f;
  p = p.cwiseProduct(Eigen::Vector3f(6, 5, 3));
  if (std::bernoulli_distribution(outliers)(*random)) p *= 1.2f + 0.5f * unit(*random);
  return p + Eigen::Vector3f(noise(*random), noise(*random), noise(*random));
}

CarvingDelta make_room(const Options& options) {
  std::mt19937 random(1);
  DelaunayCarving carving;
  carving.add_hull_corners(20);
  std::vector<Eigen::Vector3f> points;
  for (int32_t i = 0; i < options.points; ++i) {
    points.push_back(surface_point(options.outliers, &random));
    carving.set_point(i, points.back());
  }
  for (const auto& point : points) {
    for (int32_t ray = 0; ray < options.rays_per_point; ++ray) {
      const auto camera = static_cast<float>(random() % static_cast<uint32_t>(options.cameras));
      const float angle = 6.28f * camera / static_cast<float>(options.cameras);
      carving.carve_segment({1.5f * std::cos(angle), 1.5f * std::sin(angle), 0.2f}, point);
    }
  }
  return carving.snapshot();
}

/// CPU time, which other programs on the machine disturb least.
double milliseconds_since(std::clock_t begin) {
  return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void measure(const CarvingDelta& snapshot, double lambda, int32_t repeats) {
  std::vector<double> apply, update, extract;
  CutStatistics s;
  size_t triangles = 0;
  for (int32_t i = 0; i < repeats; ++i) {
    Mesher mesher({.energy = Energy::kVolume, .lambda = lambda});
    std::clock_t begin = std::clock();
    if (mesher.apply(snapshot) != ApplyResult::kOk) std::abort();
    apply.push_back(milliseconds_since(begin));
    begin = std::clock();
    triangles = mesher.update().triangles.size();
    update.push_back(milliseconds_since(begin));
    begin = std::clock();
    extract_isosurface(mesher.complex(), mesher.carved(), ManifoldRepair::kSplit);
    extract.push_back(milliseconds_since(begin));
    s = mesher.statistics();
  }
  std::printf("%7.4f %8.1f %8.1f %8.1f %9.1f %9d %9d %8.1f %9zu %7d %6d\n", lambda, median(apply),
              median(update), median(extract), median(update) - median(extract),
              s.input_carved_cells, s.carved_cells, 100.0 * s.decided_at_once / s.cells, triangles,
              s.split_vertices, s.split_edges);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Times the mesher on a synthetic room.", "mesh-bench");
  app.add_option("--points", options.points, "map points")->check(CLI::Range(10, 1000000));
  app.add_option("--repeats", options.repeats, "runs per line")->check(CLI::Range(1, 1000));
  app.add_option("--outliers", options.outliers, "share of points")->check(CLI::Range(0.0, 1.0));
  app.add_option("--lambda", options.lambdas, "relative weights of the area");
  return tool_main(app, argc, argv, [&] {
    const CarvingDelta snapshot = make_room(options);
    std::printf("%d points, %zu cells; CPU times in ms, medians of %d\n", options.points,
                snapshot.cells_added.size(), options.repeats);
    std::printf(
        " lambda    apply   update  extract build+cut carved in    carved  at once triangles"
        "  splits  edges\n");
    for (const double lambda : options.lambdas) measure(snapshot, lambda, options.repeats);
    return kExitDone;
  });
}
