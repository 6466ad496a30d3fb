// For tests that write maps and carvings down: tables of plain numbers become typed ids.
//
//   delta.points_set = points({{0, {1, 0, 0}}, {1, {0, 1, 0}}});
//   delta.observations_added = seen({{0, 0}, {0, 1}});  // keyframe 0 saw points 0 and 1
//   delta.points_removed = ids<PointId>({1});
#pragma once

#include <Eigen/Core>
#include <array>
#include <initializer_list>
#include <vector>

#include "common/carving_delta.h"
#include "common/map_delta.h"

namespace foresight {

template <class IdType>
std::vector<IdType> ids(std::initializer_list<int32_t> values) {
  std::vector<IdType> all;
  for (const int32_t value : values) all.emplace_back(value);
  return all;
}

struct PlacedId {
  int32_t id;
  Eigen::Vector3f position;
};

inline std::vector<MapPoint> points(std::initializer_list<PlacedId> rows) {
  std::vector<MapPoint> all;
  for (const PlacedId& row : rows) all.push_back({PointId(row.id), row.position});
  return all;
}

inline std::vector<CarvingVertex> vertices(std::initializer_list<PlacedId> rows) {
  std::vector<CarvingVertex> all;
  for (const PlacedId& row : rows) all.push_back({VertexId(row.id), row.position});
  return all;
}

struct KeyframeAndPoint {
  int32_t keyframe, point;
};

inline std::vector<MapObservation> seen(std::initializer_list<KeyframeAndPoint> rows) {
  std::vector<MapObservation> all;
  for (const auto& [keyframe, point] : rows) all.push_back({KeyframeId(keyframe), PointId(point)});
  return all;
}

inline CarvingCell carving_cell(int32_t id, const std::array<int32_t, 4>& v, int32_t constraints) {
  return {
      CellId(id), {VertexId(v[0]), VertexId(v[1]), VertexId(v[2]), VertexId(v[3])}, constraints};
}

struct PlainCell {
  int32_t id;
  std::array<int32_t, 4> vertices;
  int32_t constraints;
};

inline std::vector<CarvingCell> cells(std::initializer_list<PlainCell> rows) {
  std::vector<CarvingCell> all;
  for (const PlainCell& row : rows) {
    all.push_back(carving_cell(row.id, row.vertices, row.constraints));
  }
  return all;
}

}  // namespace foresight
