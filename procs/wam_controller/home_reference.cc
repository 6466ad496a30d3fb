#include "procs/wam_controller/home_reference.h"

#include <cmath>
#include <cstdio>
#include <sstream>

#include "procs/wam_controller/transmission.h"

namespace foresight {
namespace {

constexpr int64_t kWordCounts_s = 15 * 60, kClocksDiffer_s = 60;
constexpr double kLongestUnseenWay_rad = 0.5;  // of a joint: an arm that sank while nobody looked
constexpr double kLimitTolerance_rad = 0.1;
constexpr double kContradiction_rad = 0.1;

std::vector<int32_t> difference(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::vector<int32_t> result(a.size());
  for (size_t i = 0; i < a.size(); ++i) {
    result[i] = static_cast<int32_t>(static_cast<uint32_t>(a[i]) - static_cast<uint32_t>(b[i]));
  }
  return result;
}

std::string with_joint(const char* format, double angle_rad, Eigen::Index joint) {
  char text[160];
  std::snprintf(text, sizeof text, format, angle_rad, static_cast<int>(joint) + 1);
  return text;
}

// Why the stored reference does not hold any more; empty when it does.
std::string find_doubt(const ArmModel& arm, const HomeQuestion& q) {
  const auto size = static_cast<size_t>(arm.size());
  if (!q.stored) return "no reference of an earlier start is known";
  if (q.stored->arm != arm.name) return "the last reference is of another arm";
  if (q.stored->counts_at_zero.size() != size || q.stored->counts_last_seen.size() != size) {
    return "the last reference is of another number of motors";
  }
  if (!q.pucks_kept_running) return "the motor controllers were switched off since the last start";
  const Transmission transmission(arm);
  Eigen::Index joint = 0;
  const JointVector unseen_rad =
      transmission.joint_position_rad(difference(q.counts, q.stored->counts_last_seen));
  if (unseen_rad.cwiseAbs().maxCoeff(&joint) > kLongestUnseenWay_rad) {
    return with_joint("the arm is %.2f rad (joint %d) from where it was last seen",
                      std::abs(unseen_rad[joint]), joint);
  }
  const JointVector position_rad =
      transmission.joint_position_rad(difference(q.counts, q.stored->counts_at_zero));
  const JointVector outside_rad = position_rad - arm.clamp(position_rad, -kLimitTolerance_rad);
  if (outside_rad.cwiseAbs().maxCoeff(&joint) > 0) {
    return with_joint("the last reference puts the arm at %.2f rad, outside the limits (joint %d)",
                      position_rad[joint], joint);
  }
  return {};
}

bool is_new_word(const HomeQuestion& q) {
  const int64_t now_s = q.now.us / 1'000'000;
  const bool is_recent =
      now_s - kWordCounts_s <= q.confirmed_at_s && q.confirmed_at_s <= now_s + kClocksDiffer_s;
  return is_recent && (!q.stored || q.stored->confirmed_at_s < q.confirmed_at_s);
}

HomeReference take_home(const ArmModel& arm, const HomeQuestion& q) {
  const JointVector home_counts = Transmission(arm).motor_counts(arm.home());
  std::vector<int32_t> rounded;
  for (const double count : home_counts) rounded.push_back(static_cast<int32_t>(lround(count)));
  return {arm.name, q.confirmed_at_s, difference(q.counts, rounded), q.counts};
}

std::string instruction(const HomeQuestion& q, const std::string& doubt) {
  const std::string word =
      q.confirmed_at_s == 0 ? "" : " (the word that was given is used, or old)";
  return "can_home_confirmed_at_s: " + doubt + word +
         ": put the arm into the home position of its file, and start within 15 minutes with "
         "can_home_confirmed_at_s=$(date +%s)";
}

}  // namespace

std::string to_text(const HomeReference& reference) {
  std::ostringstream text;
  text << "arm " << reference.arm << "\nconfirmed_at_s " << reference.confirmed_at_s << "\nmotors "
       << reference.counts_at_zero.size() << "\n";
  for (size_t i = 0; i < reference.counts_at_zero.size(); ++i) {
    text << reference.counts_at_zero[i] << " " << reference.counts_last_seen[i] << "\n";
  }
  text << "end\n";
  return text.str();
}

std::optional<HomeReference> read_home_reference(const std::string& text) {
  std::istringstream in(text);
  HomeReference reference;
  std::string arm, confirmed, motors, end;
  int count = 0;
  in >> arm >> reference.arm >> confirmed >> reference.confirmed_at_s >> motors >> count;
  if (!in || arm != "arm" || confirmed != "confirmed_at_s" || motors != "motors" || count < 1 ||
      count > kMaxJoints) {
    return std::nullopt;
  }
  for (int i = 0; i < count; ++i) {
    int32_t at_zero = 0, last_seen = 0;
    in >> at_zero >> last_seen;
    reference.counts_at_zero.push_back(at_zero);
    reference.counts_last_seen.push_back(last_seen);
  }
  in >> end;
  if (!in || end != "end") return std::nullopt;
  return reference;
}

HomeAnswer find_home(const ArmModel& arm, const HomeQuestion& question) {
  const std::string doubt = find_doubt(arm, question);
  if (!is_new_word(question)) {
    if (!doubt.empty()) return {std::nullopt, instruction(question, doubt)};
    HomeReference kept = *question.stored;
    kept.counts_last_seen = question.counts;
    return {kept, {}};
  }
  HomeReference taken = take_home(arm, question);
  if (!doubt.empty()) return {taken, {}};
  const JointVector apart_rad = Transmission(arm).joint_position_rad(
      difference(question.stored->counts_at_zero, taken.counts_at_zero));
  Eigen::Index joint = 0;
  if (apart_rad.cwiseAbs().maxCoeff(&joint) <= kContradiction_rad) return {taken, {}};
  return {std::nullopt,
          with_joint("can_home_confirmed_at_s: the motor controllers went on counting and say that "
                     "the arm is %.2f rad (joint %d) from home",
                     std::abs(apart_rad[joint]), joint) +
              ": put it there, or switch them off and on if they are wrong"};
}

}  // namespace foresight
