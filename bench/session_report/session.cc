#include "bench/session_report/session.h"

#include <cmath>
#include <filesystem>
#include <sstream>

#include "bench/evaluate/figures.h"
#include "bench/evaluate/image_scores.h"
#include "common/errors.h"
#include "common/message_check.h"
#include "common/messages.h"
#include "common/output_file.h"

namespace foresight {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;
constexpr Duration kSettling = seconds(2);

double yaw_deg(const Pose<World, Base>& pose) {
  const Eigen::Vector3d x = pose.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x()) * kDegrees;
}

}  // namespace

// Both logs in the order in which the messages were received: one clock stamps both.
void Session::read(const std::string& robot_log, const std::string& operator_log) {
  LogReader robot(robot_log), operators(operator_log);
  auto a = robot.next(), b = operators.next();
  while (a || b) {
    const bool take_robot = a && (!b || a->time <= b->time);
    take_robot ? on_robot(*a) : on_operator(*b);
    if (take_robot) {
      a = robot.next();
    } else {
      b = operators.next();
    }
  }
  result_.name = "session";
  for (const LogReader* log : {&robot, &operators}) {
    const std::string complaint = log->complaint();
    if (!complaint.empty()) damage_ += (damage_.empty() ? "" : "; ") + complaint;
  }
}

void Session::require_whole_logs() const {
  if (!damage_.empty()) throw UnavailableError(damage_);
}

void Session::on_robot(const LogEvent& event) {
  if (event.channel == "TRUTH_STATE") {
    const auto message = decode_checked<truth_t>(event.bytes);
    if (!message) return;
    if (!start_) start_ = Time{message->utime};
    truth_.on_message(event.bytes);
    score_due();
  }
  if (!start_) return;
  if (event.channel == "CAMERA_INFO" && !view_) {
    const auto message = decode_checked<camera_info_t>(event.bytes);
    const auto camera = message ? from_message(*message) : std::nullopt;
    if (camera) view_ = std::make_unique<TrueView>(sim_params_, *camera);
  }
  if (event.channel == "ALIGNMENT") on_alignment(event);
  if (event.channel == "BASE_POSE") on_base(event);
  if (event.channel == "JOINT_STATE") on_joint_state(event);
}

void Session::on_operator(const LogEvent& event) {
  if (!start_) return;
  if (event.channel == "DISPLAY_STATS") on_display(event);
  if (event.channel == "JOINT_COMMAND") {
    const auto message = decode_checked<joint_command_t>(event.bytes);
    if (message && message->engaged != 0) commanded_rad_ = message->position_rad;
  }
}

void Session::on_alignment(const LogEvent& event) {
  const auto message = decode_checked<alignment_t>(event.bytes);
  if (!message || true_from_estimated_ || !read_alignment(*message)) return;
  const auto truth = truth_.at({message->utime});
  if (!truth) return;
  true_from_estimated_.emplace(truth->world_from_base.rotation(),
                               truth->world_from_base.translation());
  aligned_at_ = {message->utime};
  result_.first_aligned_s = since_start_s(aligned_at_);
}

void Session::on_base(const LogEvent& event) {
  const auto message = decode_checked<base_pose_t>(event.bytes);
  const auto base = message ? read_base(*message) : std::nullopt;
  if (!base || !true_from_estimated_ || base->time < aligned_at_ + kSettling) return;
  waiting_bases_.push_back(*base);
}

void Session::on_joint_state(const LogEvent& event) {
  const auto message = decode_checked<joint_state_t>(event.bytes);
  if (!message || commanded_rad_.size() != message->position_rad.size()) return;
  joints_.push_back({since_start_s({message->utime}), commanded_rad_, message->position_rad});
}

void Session::on_display(const LogEvent& event) {
  const auto message = decode_checked<display_stats_t>(event.bytes);
  if (!message) return;
  if (result_.first_prediction_s >= 0) ++result_.drawn_frames;
  if (message->epoch == 0 || !true_from_estimated_) return;
  if (result_.first_prediction_s < 0) {
    result_.first_prediction_s = since_start_s({message->shown_utime});
    ++result_.drawn_frames;
  }
  ++result_.predicted_frames;
  ShownPicture picture;
  picture.time_s = since_start_s({message->shown_utime});
  picture.texture_age_ms = 1e-3 * static_cast<double>(message->utime - message->texture_utime);
  picture.draw_ms = message->draw_ms;
  if (message->command_utime > newest_command_us_) {
    newest_command_us_ = message->command_utime;
    picture.motion_to_picture_ms =
        1e-3 * static_cast<double>(message->shown_utime - message->command_utime);
  }
  pictures_.push_back(picture);
  waiting_.push_back(*message);
}

void Session::score_due() {
  while (!waiting_.empty()) {
    const auto truth = truth_.at({waiting_.front().utime});
    if (!truth) break;
    score(waiting_.front(), *truth);
    waiting_.pop_front();
  }
  while (!waiting_bases_.empty()) {
    const BaseState& base = waiting_bases_.front();
    const auto truth = truth_.at(base.time);
    if (!truth) break;
    const Pose<World, Base> estimated = *true_from_estimated_ * base.world_from_base;
    const Pose<World, Base>& real = truth->world_from_base;
    PoseError e;
    e.time_s = since_start_s(base.time);
    e.position_mm = 1e3 * (estimated.translation() - real.translation()).norm();
    e.angle_deg = kDegrees * estimated.rotation().angularDistance(real.rotation());
    result_.base.push_back(e);
    BaseSample sample{e.time_s, {}, {}, yaw_deg(real), yaw_deg(estimated)};
    Eigen::Map<Eigen::Vector3d>(sample.true_m) = real.translation();
    Eigen::Map<Eigen::Vector3d>(sample.estimated_m) = estimated.translation();
    result_.base_path.push_back(sample);
    waiting_bases_.pop_front();
  }
}

void Session::score(const display_stats_t& shown, const Truth& truth) {
  const auto pose = read_transform<World, Cam>(shown.predicted_world_from_cam_quat_wxyz,
                                               shown.predicted_world_from_cam_position_m);
  if (!pose) return;
  const Pose<World, Cam> predicted = *true_from_estimated_ * *pose;
  PoseError e;
  e.time_s = since_start_s(truth.time);
  e.position_mm = 1e3 * (truth.world_from_cam.translation() - predicted.translation()).norm();
  e.angle_deg = kDegrees * truth.world_from_cam.rotation().angularDistance(predicted.rotation());
  if (view_) e.shift_px = view_->shift_px(truth.world_from_cam, predicted);
  result_.predictions.push_back(e);
}

void Session::write(const std::string& folder) const {
  write_series(folder, result_);
  std::ostringstream pictures, joints;
  pictures << "time_s,motion_to_picture_ms,texture_age_ms,draw_ms\n";
  std::vector<double> latency_ms, draw_ms, texture_ms;
  for (const ShownPicture& p : pictures_) {
    pictures << p.time_s << "," << p.motion_to_picture_ms << "," << p.texture_age_ms << ","
             << p.draw_ms << "\n";
    if (p.motion_to_picture_ms >= 0) latency_ms.push_back(p.motion_to_picture_ms);
    draw_ms.push_back(p.draw_ms);
    texture_ms.push_back(p.texture_age_ms);
  }
  joints << "time_s,joint,commanded_rad,measured_rad\n";
  for (const JointSample& sample : joints_) {
    for (size_t i = 0; i < sample.measured_rad.size(); ++i) {
      joints << sample.time_s << "," << i << "," << sample.commanded_rad[i] << ","
             << sample.measured_rad[i] << "\n";
    }
  }
  Report report = report_of(result_);
  report.figures.push_back({"motion_to_picture_median_ms", percentile(latency_ms, 0.5), 1});
  report.figures.push_back({"motion_to_picture_p95_ms", percentile(latency_ms, 0.95), 1});
  report.figures.push_back({"draw_median_ms", percentile(draw_ms, 0.5), 1});
  report.figures.push_back({"texture_age_median_ms", percentile(texture_ms, 0.5), 1});
  write_output(folder + "/pictures.csv", pictures.str());
  write_output(folder + "/joints.csv", joints.str());
  write_json(folder + "/summary.json", {report});
}

}  // namespace foresight
