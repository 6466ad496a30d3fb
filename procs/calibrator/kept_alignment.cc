#include "procs/calibrator/kept_alignment.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <sstream>
#include <string_view>
#include <vector>

namespace foresight::calibration {
namespace {

constexpr double kFarthest_m = 1e6, kLargestScale = 1e6, kLongestDelay_s = 1;
constexpr double kUnitNorm = 1e-6;  // of a rotation

void put(std::string* text, std::string_view key, std::initializer_list<double> numbers) {
  *text += key;
  for (const double number : numbers) {
    std::array<char, 32> digits;
    *text += ' ';
    text->append(digits.data(), std::to_chars(digits.begin(), digits.end(), number).ptr);
  }
  *text += '\n';
}

void put(std::string* text, std::string_view key, int64_t number) {
  *text += std::string(key) + " " + std::to_string(number) + "\n";
}

void put(std::string* text, std::string_view key, const Eigen::Quaterniond& q,
         const Eigen::Vector3d& t) {
  put(text, key, {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()});
}

// Takes lines in the order in which they were put; the first that does not fit spoils the rest.
class Lines {
 public:
  explicit Lines(const std::string& text) : in_(text) {}
  bool is_good() const { return good_; }
  bool is_at_end() { return good_ && (in_ >> std::ws).eof(); }

  template <class Number>
  std::vector<Number> take(std::string_view key, size_t count) {
    std::vector<Number> numbers(count);
    std::string word;
    good_ = good_ && (in_ >> word) && word == key;
    for (Number& number : numbers) {
      good_ = good_ && (in_ >> word);
      const char* end = word.data() + word.size();
      const auto read = std::from_chars(word.data(), end, number);
      good_ = good_ && read.ec == std::errc() && read.ptr == end;
      if constexpr (std::is_floating_point_v<Number>) good_ = good_ && std::isfinite(number);
    }
    return good_ ? numbers : std::vector<Number>(count);
  }
  double take_within(std::string_view key, double least, double most) {
    const double number = take<double>(key, 1)[0];
    require(number >= least && number <= most);
    return number;
  }
  template <class A, class B>
  Pose<A, B> take_pose(std::string_view key) {
    const auto n = take<double>(key, 7);
    const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
    const Eigen::Vector3d t(n[4], n[5], n[6]);
    require(std::abs(q.norm() - 1) < kUnitNorm && t.cwiseAbs().maxCoeff() < kFarthest_m);
    return good_ ? Pose<A, B>(q, t) : Pose<A, B>();
  }
  void require(bool condition) { good_ = good_ && condition; }

 private:
  std::istringstream in_;
  bool good_ = true;
};

}  // namespace

std::string to_text(const KeptAlignment& k) {
  std::string text;
  const AlignmentSolution& s = k.solution;
  put(&text, "epoch", k.epoch);
  put(&text, "time_us", k.time.us);
  put(&text, "newest_pair_us", k.newest_pair.us);
  put(&text, "scale_m_per_mu", {k.world_from_map.scale()});
  put(&text, "world_from_map", k.world_from_map.rotation(), k.world_from_map.translation());
  put(&text, "ee_from_cam", s.estimate.ee_from_cam.rotation(),
      s.estimate.ee_from_cam.translation());
  put(&text, "joint_delay_s", {s.estimate.joint_delay_s});
  put(&text, "scale_sigma", {s.scale_sigma});
  put(&text, "position_sigma_m", {s.position_sigma_m});
  put(&text, "rotation_sigma_rad", {s.rotation_sigma_rad});
  put(&text, "residual_px", {s.residual_px});
  put(&text, "middle_in_base", {s.middle_in_base.x(), s.middle_in_base.y(), s.middle_in_base.z()});
  put(&text, "inliers", int64_t{s.inliers});
  put(&text, "aligned_base", k.world_from_aligned_base.rotation(),
      k.world_from_aligned_base.translation());
  put(&text, "aligned_base_sigma_m", {k.aligned_base_sigma_m});
  put(&text, "aligned_base_sigma_rad", {k.aligned_base_sigma_rad});
  put(&text, "stand", static_cast<int64_t>(k.stand));
  put(&text, "base", k.world_from_base.rotation(), k.world_from_base.translation());
  put(&text, "base_speed_m_per_s", {k.base_speed_m_per_s});
  put(&text, "base_turn_rad_per_s", {k.base_turn_rad_per_s});
  return text;
}

std::optional<KeptAlignment> parse_kept_alignment(const std::string& text) {
  Lines lines(text);
  KeptAlignment k;
  AlignmentSolution& s = k.solution;
  k.epoch = lines.take<int64_t>("epoch", 1)[0];
  k.time.us = lines.take<int64_t>("time_us", 1)[0];
  k.newest_pair.us = lines.take<int64_t>("newest_pair_us", 1)[0];
  const double scale = lines.take_within("scale_m_per_mu", 1 / kLargestScale, kLargestScale);
  const auto world_from_map = lines.take_pose<World, Map>("world_from_map");
  k.world_from_map = {scale, world_from_map.rotation(), world_from_map.translation()};
  s.verdict = AlignmentVerdict::kAccepted;
  s.estimate.ee_from_cam = lines.take_pose<Ee, Cam>("ee_from_cam");
  s.estimate.joint_delay_s = lines.take_within("joint_delay_s", -kLongestDelay_s, kLongestDelay_s);
  s.scale_sigma = lines.take_within("scale_sigma", 0, 1);
  s.position_sigma_m = lines.take_within("position_sigma_m", 0, kFarthest_m);
  s.rotation_sigma_rad = lines.take_within("rotation_sigma_rad", 0, 10);
  s.residual_px = lines.take_within("residual_px", 0, 1e6);
  const auto middle = lines.take<double>("middle_in_base", 3);
  s.middle_in_base = {middle[0], middle[1], middle[2]};
  s.inliers = static_cast<int>(std::clamp<int64_t>(lines.take<int64_t>("inliers", 1)[0], 0, 1000));
  k.world_from_aligned_base = lines.take_pose<World, Base>("aligned_base");
  k.aligned_base_sigma_m = lines.take_within("aligned_base_sigma_m", 0, kFarthest_m);
  k.aligned_base_sigma_rad = lines.take_within("aligned_base_sigma_rad", 0, 10);
  const int64_t stand = lines.take<int64_t>("stand", 1)[0];
  lines.require(stand >= 0 && stand <= static_cast<int64_t>(Stand::kLeft));
  k.stand = lines.is_good() ? static_cast<Stand>(stand) : Stand::kThere;
  k.world_from_base = lines.take_pose<World, Base>("base");
  k.base_speed_m_per_s = lines.take_within("base_speed_m_per_s", 0, 100);
  k.base_turn_rad_per_s = lines.take_within("base_turn_rad_per_s", 0, 100);
  lines.require(k.epoch > 0 && k.time.us > 0 && s.middle_in_base.norm() < kFarthest_m);
  if (!lines.is_at_end()) return std::nullopt;
  return k;
}

}  // namespace foresight::calibration
