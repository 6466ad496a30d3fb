#include "procs/renderer/display_judge.h"

namespace foresight {
namespace {

// What a person at the display would notice.
constexpr Duration kStoodStill = seconds(1);
constexpr Duration kMoreDelay = milliseconds(100);

std::string delay_complaint(const DisplayFacts& facts) {
  if (!facts.delay || !facts.normal_delay) return {};
  const Duration now = *facts.delay, normal = *facts.normal_delay;
  if (now < normal * 2 || now - normal < kMoreDelay) return {};
  return "delay " + seconds_text(now, 2) + " instead of " + seconds_text(normal, 2);
}

std::string joined(const std::vector<std::string>& parts) {
  std::string line;
  for (const std::string& part : parts) {
    if (!part.empty()) line += (line.empty() ? "" : "; ") + part;
  }
  return line;
}

}  // namespace

std::string DisplayJudge::drawing_complaint(const DisplayFacts& facts) {
  const bool is_first = !picture_time_ || facts.now < *picture_time_;
  if (is_first || facts.pictures != pictures_) picture_time_ = facts.now;
  pictures_ = facts.pictures;
  if (facts.stood_still > kStoodStill) {
    return "the display stood still for " + seconds_text(facts.stood_still, 1);
  }
  const Duration since = facts.now - *picture_time_;
  if (since < facts.redraw_after + seconds(1)) return {};
  return "nothing drawn for " + seconds_text(since, 1);
}

DisplayVerdict DisplayJudge::judge(const DisplayFacts& facts) {
  std::vector<std::string> complaints{drawing_complaint(facts), facts.clocks};
  const std::string& missing = facts.prediction_reason;
  has_predicted_ = has_predicted_ || facts.has_prediction;
  if (has_predicted_ && !facts.has_prediction) complaints.push_back("no prediction: " + missing);
  for (const StreamFacts& stream : facts.streams) {
    const bool is_said = !facts.has_prediction && missing.find(stream.name) != std::string::npos;
    if (is_said || !stream.watch.is_silent(facts.now, stream.slack)) continue;
    complaints.push_back("no " + stream.name + " for " +
                         seconds_text(*stream.watch.silence(facts.now), 1));
  }
  complaints.insert(complaints.end(),
                    {facts.arm, facts.commanders, delay_complaint(facts), facts.recording});
  const std::string bad = joined(complaints);
  const std::string pending = !facts.has_video ? "no video yet" : "no prediction yet: " + missing;
  if (has_predicted_) {
    return bad.empty() ? DisplayVerdict{DisplayState::kOk, facts.note}
                       : DisplayVerdict{DisplayState::kDegraded, joined({bad, facts.note})};
  }
  return bad.empty() ? DisplayVerdict{DisplayState::kWaiting, joined({pending, facts.note})}
                     : DisplayVerdict{DisplayState::kDegraded, joined({bad, pending, facts.note})};
}

}  // namespace foresight
