#include "procs/slam/loop_correction.h"

#include <cmath>
#include <set>
#include <utility>

#include "common/check.h"

namespace foresight::slam {
namespace {

constexpr int kStrongLink = 30;      // shared points that make an edge
constexpr double kLoopWeight = 100;  // of an edge across the loop, in shared points
constexpr double kSamePlace_px = 3;  // of two points that may be one
constexpr double kSameDepth = 0.1;   // of the larger depth

Similarity<Cam, Map> rigid(const Pose<Map, Cam>& map_from_cam) {
  const Pose<Cam, Map> inverse = map_from_cam.inverse();
  return {1, inverse.rotation(), inverse.translation()};
}

class Builder {
 public:
  Builder(const SlamMap& map, PoseGraph* graph) : map_(map), graph_(*graph) {
    for (const auto& [id, keyframe] : map.keyframes()) {
      index_[id] = graph_.vertices.push_back(
          {id, rigid(keyframe.map_from_cam), keyframe.median_depth, graph_.vertices.empty()});
    }
  }

  // To all older keyframes with many points in common; to the closest one at least.
  void link_to_older(KeyframeId id) {
    const std::map<KeyframeId, int> shared =
        shared_point_counts(map_, map_.keyframe(id)->point_ids);
    std::pair<int, KeyframeId> best{0, KeyframeId()};
    for (const auto& [other, points] : shared) {
      if (other >= id) break;
      if (points >= kStrongLink) add(other, id, points);
      best = std::max(best, {points, other});
    }
    if (best.first >= kStrongLink) return;
    if (!best.second.is_valid() && index_.at(id) > VertexId(0)) {
      best = {1, graph_.vertices[VertexId(index_.at(id).value() - 1)].id};
    }
    if (best.second.is_valid()) add(best.second, id, best.first);
  }

  void link_loop(KeyframeId new_id, KeyframeId old_id, const Similarity<Map, Map>& old_from_new) {
    if (!index_.contains(new_id) || !index_.contains(old_id)) return;
    const Similarity<Cam, Cam> old_from_new_cam =
        vertex(old_id).cam_from_map * old_from_new * vertex(new_id).cam_from_map.inverse();
    graph_.edges.push_back({index_.at(new_id), index_.at(old_id), old_from_new_cam, kLoopWeight});
  }

 private:
  const PoseGraphVertex& vertex(KeyframeId id) const { return graph_.vertices[index_.at(id)]; }
  void add(KeyframeId a, KeyframeId b, double weight) {
    const Similarity<Cam, Cam> b_from_a = vertex(b).cam_from_map * vertex(a).cam_from_map.inverse();
    graph_.edges.push_back({index_.at(a), index_.at(b), b_from_a, weight});
  }

  const SlamMap& map_;
  PoseGraph& graph_;
  std::map<KeyframeId, VertexId> index_;
};

bool at_same_depth(const Keyframe& keyframe, const Point& a, const Point& b) {
  const Pose<Cam, Map> cam_from_map = keyframe.map_from_cam.inverse();
  const double depth_a = (cam_from_map * a.position_in_map).z();
  const double depth_b = (cam_from_map * b.position_in_map).z();
  return std::abs(depth_a - depth_b) < kSameDepth * std::max(depth_a, depth_b);
}

}  // namespace

PoseGraph pose_graph_of(const SlamMap& map, const LoopClosure& closure) {
  PoseGraph graph;
  Builder builder(map, &graph);
  for (const auto& [id, keyframe] : map.keyframes()) builder.link_to_older(id);
  for (const KeyframeId new_id : closure.new_side) {
    for (const KeyframeId old_id : closure.old_side) {
      builder.link_loop(new_id, old_id, closure.old_from_new);
    }
  }
  return graph;
}

MapCorrection correction_by(const PoseGraph& before, const PoseGraph& solved, const SlamMap& map) {
  FORESIGHT_CHECK(before.vertices.size() == solved.vertices.size() && !before.vertices.empty());
  MapCorrection known;
  for (const VertexId i : before.vertices.ids()) {
    known[before.vertices[i].id] =
        solved.vertices[i].cam_from_map.inverse() * before.vertices[i].cam_from_map;
  }
  MapCorrection correction;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const auto it = known.find(id);
    correction[id] = it != known.end() ? it->second : known.rbegin()->second;
  }
  return correction;
}

void correct_map(const MapCorrection& correction, SlamMap* map) {
  for (const auto& [id, new_from_old] : correction) {
    map->move_keyframe(id, new_from_old * map->keyframe(id)->map_from_cam);
    map->scale_depth(id, new_from_old.scale());
  }
  std::vector<std::pair<PointId, Eigen::Vector3d>> moved;
  for (const auto& [id, point] : map->points()) {
    moved.emplace_back(id, correction.at(point.source.keyframe_id) * point.position_in_map);
  }
  for (const auto& [id, position] : moved) map->move_point(id, position);
}

int fuse_points(const LoopClosure& closure, SlamMap* map) {
  int fused = 0;
  for (const LoopObservation& seen : closure.observations) {
    const Keyframe* keyframe = map->keyframe(seen.observation.keyframe_id);
    const Point* old = map->point(seen.point_id);
    if (keyframe == nullptr || old == nullptr || old->observation_in(keyframe->id) != nullptr) {
      continue;
    }
    const Point* own = point_near(*map, *keyframe, seen.observation.pixel, kSamePlace_px);
    if (own != nullptr && at_same_depth(*keyframe, *old, *own)) {
      map->merge_points(old->id, own->id);
      ++fused;
    } else {
      map->add_observation(old->id, seen.observation);
    }
  }
  return fused;
}

}  // namespace foresight::slam
