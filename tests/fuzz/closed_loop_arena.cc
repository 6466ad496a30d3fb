#include "tests/fuzz/closed_loop_arena.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/message_bytes.h"
#include "common/message_check.h"
#include "foresight/alignment_t.hpp"
#include "foresight/base_pose_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/controller_state_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/health_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/truth_t.hpp"

namespace foresight::fuzz {
namespace {

constexpr double kMaxError_m = 0.03;  // of the predicted camera; undisturbed it is some millimetres
constexpr size_t kMinPictures = 10;
constexpr size_t kTruthKept = 5000;

// The base stands still, so the calibrator's world is the simulation's.
ClosedLoopOptions loop_options() {
  return {.seconds = 1e6,
          .delay_s = 0.2,
          .settings = {"sim.camera_width_px=320", "sim.camera_rate_hz=10", "renderer.used_views=2",
                       "renderer.idle_rate_hz=10", "sim.base_motion=still"}};
}

}  // namespace

ClosedLoopArena::ClosedLoopArena() : loop_(loop_options()) {}

void ClosedLoopArena::run_for(double seconds_long) {
  const Time end = world().now() + seconds(seconds_long);
  while (world().now() < end) loop_.step();
}

void ClosedLoopArena::on_message(Domain domain, const std::string& channel,
                                 std::span<const uint8_t> bytes) {
  if (domain == Domain::kRobot) learn_beliefs(channel, bytes);
  if (domain == Domain::kOperator && channel == "HEALTH") {
    const auto health = decode_checked<health_t>(bytes);  // link passes forged ones on
    if (health && health->process == "renderer") {
      beliefs_["renderer"] = "renderer: " + health->reason;
    }
  }
  if (channel == "ALIGNMENT" && domain == Domain::kRobot) {
    is_aligned_ = decode<alignment_t>(bytes).state == alignment_t::STATE_ALIGNED;
  } else if (channel == "TRUTH_STATE") {
    const auto truth = decode<truth_t>(bytes);
    true_joints_rad_ = truth.joint_position_rad;
    truth_[{truth.utime}] = Eigen::Vector3d(truth.world_from_cam_position_m);
    if (truth_.size() > kTruthKept) truth_.erase(truth_.begin());
  } else if (channel == "DISPLAY_STATS") {
    const auto stats = decode<display_stats_t>(bytes);
    if (stats.epoch == 0) return;
    pictures_.push_back(
        {{stats.utime}, Eigen::Vector3d(stats.predicted_world_from_cam_position_m)});
  }
}

// The base stands still at the world's origin.
void ClosedLoopArena::learn_beliefs(const std::string& channel, std::span<const uint8_t> bytes) {
  char text[160] = "";
  if (channel == "BASE_POSE") {
    const auto base = decode<base_pose_t>(bytes);
    const Eigen::Vector3d place(base.world_from_base_position_m);
    std::snprintf(text, sizeof text, "the base %.0f mm from its place, turned by %.1f deg, %s",
                  1e3 * place.norm(),
                  114.6 * std::acos(std::min(1.0, std::abs(base.world_from_base_quat_wxyz[0]))),
                  base.state == base_pose_t::STATE_MEASURED ? "measured" : "predicted");
  } else if (channel == "CAMERA_POSE") {
    const auto pose = decode<camera_pose_t>(bytes);
    std::snprintf(text, sizeof text, "tracking in state %d, %.1f s ago", pose.state,
                  (world().now() - Time{pose.utime}).seconds());
  } else if (channel == "MESH") {
    const auto mesh = decode<mesh_t>(bytes);
    std::snprintf(text, sizeof text, "a mesh of %d triangles, %.1f s ago", mesh.n_triangles,
                  (world().now() - Time{mesh.utime}).seconds());
  } else if (channel == "CONTROLLER_STATE") {
    const auto controller = decode<controller_state_t>(bytes);
    std::snprintf(text, sizeof text, "the controller in state %d", controller.state);
  } else if (channel == "JOINT_STATE") {
    const auto joints = decode<joint_state_t>(bytes);
    double off_rad = 0;
    for (size_t i = 0; i < std::min(joints.position_rad.size(), true_joints_rad_.size()); ++i) {
      off_rad = std::max(off_rad, std::abs(joints.position_rad[i] - true_joints_rad_[i]));
    }
    std::snprintf(text, sizeof text, "joints %.3f rad off", off_rad);
  } else {
    return;
  }
  beliefs_[channel] = text;
}

std::string ClosedLoopArena::beliefs() const {
  std::string text;
  for (const auto& [channel, belief] : beliefs_) text += (text.empty() ? "" : "; ") + belief;
  return " (" + text + ")";
}

std::string ClosedLoopArena::find_fault() {
  if (!is_aligned_) return "not aligned" + beliefs();
  std::vector<double> errors_m;
  for (const Picture& p : pictures_) {
    const auto truth = truth_.lower_bound(p.instant);
    if (truth != truth_.end()) errors_m.push_back((truth->second - p.camera_in_world).norm());
  }
  if (errors_m.size() < kMinPictures) {
    return "only " + std::to_string(errors_m.size()) + " predictions" + beliefs();
  }
  const double first_m = errors_m.front(), last_m = errors_m.back();
  const auto middle = errors_m.begin() + static_cast<std::ptrdiff_t>(errors_m.size() / 2);
  std::nth_element(errors_m.begin(), middle, errors_m.end());
  if (*middle <= kMaxError_m) return {};
  char text[160];
  std::snprintf(text, sizeof text, "the predicted camera is %.1f mm off (first %.1f, last %.1f mm)",
                1e3 * *middle, 1e3 * first_m, 1e3 * last_m);
  return text + beliefs();
}

}  // namespace foresight::fuzz
