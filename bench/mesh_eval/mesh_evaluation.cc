#include "bench/mesh_eval/mesh_evaluation.h"

#include <algorithm>

#include "bench/slam_eval/depth_image.h"
#include "common/errors.h"

namespace foresight {
namespace {

// So many rays are traced for a depth image: every second pixel of every second row.
constexpr int kRayStep = 2;

std::map<Time, Pose<Map, Cam>> every_nth(const std::map<Time, Pose<Map, Cam>>& poses, int n) {
  std::map<Time, Pose<Map, Cam>> kept;
  int index = 0;
  for (const auto& [time, pose] : poses) {
    if (index++ % n == 0) kept[time] = pose;
  }
  return kept;
}

// Scores meshes at the depth images whose pose is known.
class Judge {
 public:
  Judge(const Sequence& sequence, const MeshEvaluation& evaluation)
      : sequence_(sequence), evaluation_(evaluation), rays_(sequence.camera, kRayStep) {}

  /// `mesh_at`: the mesh to see at an instant, or null; asked in the order of time.
  template <class MeshAt>
  DepthScore score(const MeshAt& mesh_at) const {
    DepthScorer scorer;
    const Mesh* shown = nullptr;
    std::optional<MeshView> view;
    for (const SequenceImage& entry : sequence_.depth_images) {
      const auto pose = evaluation_.poses.find(entry.time);
      const Mesh* mesh = mesh_at(entry.time);
      if (pose == evaluation_.poses.end() || mesh == nullptr) continue;
      const cv::Mat depth_m = load_depth(sequence_, entry);
      if (depth_m.empty()) continue;
      if (mesh != shown) view.emplace(*mesh, evaluation_.least_confidence);
      shown = mesh;
      scorer.add(view->from(pose->second, rays_), rays_, depth_m, evaluation_.metres_per_mu);
    }
    return scorer.score();
  }

 private:
  const Sequence& sequence_;
  const MeshEvaluation& evaluation_;
  PixelRays rays_;
};

}  // namespace

MeshEvaluation evaluate_mesh(const Sequence& sequence, const MeshEvaluationOptions& options) {
  if (sequence.depth_scale <= 0) {
    throw UnavailableError(sequence.name + ": no depth images (depth.txt) to compare with");
  }
  MeshFollower follower(options.mesh);
  EvaluationRange range;
  range.play = options.play;
  range.on_delta = [&](const Answer& answer, const MapDelta& delta) {
    follower.follow(answer.played.time, answer.epoch, delta);
  };
  const Evaluation tracked = evaluate(sequence, options.slam, range);
  if (tracked.depth.compared == 0) {
    const std::string why = complaint(tracked);
    throw UnavailableError(sequence.name + ": no depth image shows a point of the map" +
                           (why.empty() ? "" : " (" + why + ")"));
  }
  MeshEvaluation e;
  e.sequence = sequence.name;
  e.least_confidence = options.least_confidence;
  e.refused_images = tracked.input.refused();
  e.remarks = tracked.input.lines();
  e.complaint = complaint(tracked);
  e.metres_per_mu = tracked.depth.metres_per_mu;
  if (tracked.world_from_map) e.truth_metres_per_mu = tracked.world_from_map->scale();
  e.mesh = follower.mesh();
  e.points = static_cast<int>(follower.carver_statistics().points);
  e.triangles = static_cast<int>(e.mesh.triangles.size());
  for (const auto& [id, keyframe] : follower.keyframes()) e.map_keyframes.push_back(keyframe);
  e.keyframes = static_cast<int>(e.map_keyframes.size());
  e.poses = every_nth(poses_at_depth_images(sequence, tracked, follower.epoch()), options.every);
  const Judge judge(sequence, e);
  e.final_mesh = judge.score([&](Time) { return &e.mesh; });
  e.live_mesh = judge.score([&](Time time) { return follower.sent_by(time); });
  return e;
}

}  // namespace foresight
