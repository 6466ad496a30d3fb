#include "bench/slam_eval/score.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace foresight {
namespace {

constexpr double kRight_m = 0.05, kWrong_m = 0.10;
constexpr double kPrompt_s = 0.5;
constexpr Duration kRelativeSpan = seconds(1);

bool placed(const Answer& a) { return a.state == TrackingState::kTracking; }

int epoch_with_most_poses(const std::vector<Answer>& answers) {
  std::map<int, int> counts;
  for (const Answer& a : answers) counts[a.epoch] += placed(a) ? 1 : 0;
  int best = -1;
  for (const auto& [epoch, count] : counts) {
    if (count > 0 && (best < 0 || count > counts[best])) best = epoch;
  }
  return best;
}

void score_starting(Evaluation* e) {
  int count = 0;
  for (size_t i = 0; i < e->answers.size(); ++i) {
    if (!placed(e->answers[i])) continue;
    ++count;
    if (e->first_frame >= 0) continue;
    e->first_frame = static_cast<int>(i);
    e->init_s = (e->answers[i].played.time - e->answers.front().played.time).seconds();
  }
  e->tracked_fraction = count / static_cast<double>(e->answers.size() + e->input.refused());
}

std::optional<Similarity<World, Map>> align(const Sequence& sequence, int epoch, Evaluation* e) {
  std::vector<Eigen::Vector3d> in_map;
  for (const Answer& a : e->answers) {
    const auto truth = sequence.truth_at(a.image_time);
    if (!placed(a) || a.epoch != epoch || !truth) continue;
    in_map.push_back(a.map_from_cam.translation());
    e->truth_path.push_back(truth->translation());
  }
  if (in_map.size() < 3) return std::nullopt;
  const Similarity<World, Map> world_from_map = align_umeyama(in_map, e->truth_path);
  for (const Eigen::Vector3d& p : in_map) e->estimated_path.push_back(world_from_map * p);
  e->world_from_map = world_from_map;
  return world_from_map;
}

void score_positions(Evaluation* e) {
  double squared = 0;
  for (size_t i = 0; i < e->truth_path.size(); ++i) {
    const double error = (e->estimated_path[i] - e->truth_path[i]).norm();
    squared += error * error;
    e->ate_max_m = std::max(e->ate_max_m, error);
    if (error > kRight_m) ++e->wrong_by_5_cm;
    if (error > kWrong_m) ++e->wrong_by_10_cm;
  }
  e->ate_rmse_m = std::sqrt(squared / static_cast<double>(e->truth_path.size()));
}

// Relative pose error: the motion over one second, estimated against true.
void score_relative(const Sequence& sequence, const Similarity<World, Map>& world_from_map,
                    int epoch, Evaluation* e) {
  struct Pair {
    Time time;
    Pose<World, Cam> estimate, truth;
  };
  std::vector<Pair> pairs;
  for (const Answer& a : e->answers) {
    const auto truth = sequence.truth_at(a.image_time);
    if (!placed(a) || a.epoch != epoch || !truth) continue;
    pairs.push_back({a.played.time, world_from_map * a.map_from_cam, *truth});
  }
  double squared_m = 0, squared_rad = 0;
  int count = 0;
  for (size_t from = 0, to = 0; to < pairs.size(); ++to) {
    while (pairs[to].time - pairs[from].time > kRelativeSpan) ++from;
    if (pairs[to].time - pairs[from].time < milliseconds(900)) continue;
    const Pose<Cam, Cam> moved = pairs[from].estimate.inverse() * pairs[to].estimate;
    const Pose<Cam, Cam> truly = pairs[from].truth.inverse() * pairs[to].truth;
    const Pose<Cam, Cam> error = truly.inverse() * moved;
    const double angle = error.rotation().angularDistance(Eigen::Quaterniond::Identity());
    squared_m += error.translation().squaredNorm();
    squared_rad += angle * angle;
    ++count;
  }
  if (count == 0) return;
  e->rpe_rmse_m = std::sqrt(squared_m / count);
  e->rpe_rmse_deg = std::sqrt(squared_rad / count) * 180 / M_PI;
}

void note_errors(const Sequence& sequence, const Similarity<World, Map>& world_from_map, int epoch,
                 Evaluation* e) {
  std::vector<double> right;
  for (Answer& a : e->answers) {
    const auto truth = sequence.truth_at(a.image_time);
    if (a.epoch != epoch || !truth || a.state == TrackingState::kInitialising) continue;
    a.error_m = (world_from_map * a.map_from_cam.translation() - truth->translation()).norm();
    if (*a.error_m < kRight_m && placed(a)) right.push_back(a.quality);
    if (*a.error_m > kWrong_m) e->wrong_quality_max = std::max(e->wrong_quality_max, a.quality);
  }
  if (!right.empty()) e->right_quality_p05 = quantile(std::move(right), 0.05);
}

void bin_by_quality(Evaluation* e) {
  for (const auto& [from, to] : {std::pair(0.0, 0.5), {0.5, 0.7}, {0.7, 0.9}, {0.9, 1.01}}) {
    QualityBin bin{from, to};
    std::vector<double> errors;
    for (const Answer& a : e->answers) {
      if (!placed(a) || !a.error_m || a.quality < from || a.quality >= to) continue;
      errors.push_back(*a.error_m);
      if (*a.error_m > kRight_m) ++bin.wrong_by_5_cm;
    }
    bin.images = static_cast<int>(errors.size());
    bin.error_m_median = quantile(errors, 0.5);
    bin.error_m_p95 = quantile(errors, 0.95);
    e->quality_bins.push_back(bin);
  }
}

void score_recovery(Evaluation* e) {
  std::optional<Time> waiting_since;
  for (const Answer& a : e->answers) {
    if (a.played.disturbed) {
      ++e->recovery.disturbances;
      waiting_since = a.played.time;
    }
    if (a.played.black && placed(a)) ++e->recovery.placed_in_black;
    if (!waiting_since || !placed(a) || !a.error_m || *a.error_m > kRight_m) continue;
    const double after_s = (a.played.time - *waiting_since).seconds();
    ++e->recovery.returned;
    if (after_s <= kPrompt_s) ++e->recovery.within_half_s;
    e->recovery.slowest_s = std::max(e->recovery.slowest_s, after_s);
    waiting_since.reset();
  }
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
}

void score(const Sequence& sequence, Evaluation* e) {
  score_starting(e);
  const int epoch = epoch_with_most_poses(e->answers);
  const auto world_from_map = align(sequence, epoch, e);
  if (!world_from_map) return;
  score_positions(e);
  score_relative(sequence, *world_from_map, epoch, e);
  note_errors(sequence, *world_from_map, epoch, e);
  bin_by_quality(e);
  score_recovery(e);
}

}  // namespace foresight
