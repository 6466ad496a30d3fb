#include "procs/carver/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace foresight::carving {
namespace {

// A cube's 3 normals, 6 edge and 4 corner directions.
constexpr double kHalf = 0.70710678118654752, kThird = 0.57735026918962576;
constexpr Point3 kAxes[] = {{1, 0, 0},
                            {0, 1, 0},
                            {0, 0, 1},
                            {kHalf, kHalf, 0},
                            {kHalf, -kHalf, 0},
                            {kHalf, 0, kHalf},
                            {kHalf, 0, -kHalf},
                            {0, kHalf, kHalf},
                            {0, kHalf, -kHalf},
                            {kThird, kThird, kThird},
                            {kThird, kThird, -kThird},
                            {kThird, -kThird, kThird},
                            {-kThird, kThird, kThird}};

void add_directions(const MapState& map, PointIndex at, std::vector<Point3>* directions,
                    int32_t* observations) {
  const PointRecord& point = map.points[at];
  for (const ConstraintIndex constraint : point.constraints) {
    ++*observations;
    const KeyframeIndex keyframe = map.constraints[constraint].keyframe;
    const Point3& from = map.keyframes[keyframe].centre;
    Point3 d{};
    for (size_t i = 0; i < 3; ++i) d[i] = from[i] - point.position[i];
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (length == 0.0) continue;
    for (double& x : d) x /= length;
    directions->push_back(d);
  }
}

}  // namespace

double angular_spread(std::span<const Point3> unit_vectors) {
  double chord = 0.0;
  for (const Point3& axis : kAxes) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Point3& v : unit_vectors) {
      const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
      low = std::min(low, along);
      high = std::max(high, along);
    }
    chord = std::max(chord, high - low);
  }
  return 2.0 * std::asin(std::min(1.0, chord / 2.0));
}

VertexEvidence evidence_at(const MapState& map, const VertexRecord& vertex) {
  if (!vertex.owner.is_valid()) return {};
  std::vector<Point3> directions;
  int32_t observations = 0;
  add_directions(map, vertex.owner, &directions, &observations);
  for (const PointIndex point : vertex.also_there) {
    add_directions(map, point, &directions, &observations);
  }
  if (directions.size() < 2) return {observations, 0.0f};
  return {observations, static_cast<float>(angular_spread(directions))};
}

}  // namespace foresight::carving
