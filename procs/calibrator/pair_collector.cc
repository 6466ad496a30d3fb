#include "procs/calibrator/pair_collector.h"

#include <algorithm>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {
namespace {

constexpr size_t kMaxWaiting = 1000;

}  // namespace

void PairCollector::clear() {
  keyframes_.clear();
  frames_.clear();
  waiting_.clear();
  excluded_.clear();
}

bool PairCollector::knows(KeyframeId keyframe_id) const {
  return keyframes_.contains(keyframe_id) || excluded_.contains(keyframe_id) ||
         std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& w) {
           return w.is_keyframe && w.keyframe_id == keyframe_id;
         });
}

void PairCollector::push(const Waiting& waiting) {
  if (waiting_.size() >= kMaxWaiting) waiting_.pop_front();
  waiting_.push_back(waiting);
}

void PairCollector::add_keyframes(const MapDelta& delta) {
  for (const MapKeyframe& k : delta.keyframes_set) {
    if (!knows(k.id)) push({k.time, k.id, true, {}});
  }
}

void PairCollector::exclude_keyframes(const MapDelta& delta) {
  for (const MapKeyframe& k : delta.keyframes_set) {
    if (!knows(k.id)) excluded_.insert(k.id);
  }
}

void PairCollector::add_frame(Time time, const Pose<Map, Cam>& map_from_cam) {
  const MapKeyframe* nearest = map_.nearest_keyframe(map_from_cam.translation());
  if (nearest == nullptr) return;
  push({time, nearest->id, false, nearest->map_from_cam.inverse() * map_from_cam});
}

// A keyframe that left the map takes its pairs with it: there is no pose left to compare with the
// arm's.
void PairCollector::forget_removed() {
  const auto is_gone = [&](KeyframeId id) { return map_.find_keyframe(id) == nullptr; };
  std::erase_if(keyframes_, [&](const auto& k) { return is_gone(k.first); });
  std::erase_if(frames_, [&](const FramePair& f) { return is_gone(f.keyframe_id); });
  std::erase_if(excluded_, is_gone);
}

bool PairCollector::update() {
  forget_removed();
  bool has_new = false;
  std::deque<Waiting> still_waiting;
  for (const Waiting& w : waiting_) {
    ArmTrack arm;
    switch (readiness(w, &arm)) {
      case Readiness::kReady:
        has_new |= take(w, std::move(arm));
        break;
      case Readiness::kWaits:
        still_waiting.push_back(w);
        break;
      case Readiness::kNever:
        break;
    }
  }
  waiting_ = std::move(still_waiting);
  return has_new;
}

PairCollector::Readiness PairCollector::readiness(const Waiting& waiting, ArmTrack* arm) const {
  const Duration window = seconds(options_.window_s);
  if (arm_.empty() || arm_.newest() < waiting.time + window) return Readiness::kWaits;
  const auto track = arm_.around(waiting.time, window);
  if (!track) return Readiness::kNever;
  *arm = *track;
  return Readiness::kReady;
}

bool PairCollector::take(const Waiting& waiting, ArmTrack arm) {
  if (map_.find_keyframe(waiting.keyframe_id) == nullptr) return false;
  const Pose<Base, Ee> hand = arm.at(0).base_from_ee;
  if (waiting.is_keyframe) {
    keyframes_[waiting.keyframe_id] = {waiting.time, std::move(arm), hand};
  } else {
    if (!frames_.empty() && distance(frames_.back().hand, hand) < 1) return false;
    frames_.push_back(
        {waiting.time, waiting.keyframe_id, waiting.keyframe_from_cam, std::move(arm), hand});
  }
  thin();
  return true;
}

double PairCollector::distance(const Pose<Base, Ee>& a, const Pose<Base, Ee>& b) const {
  return (a.translation() - b.translation()).norm() / options_.spacing_m +
         angle_between(a.rotation(), b.rotation()) / (options_.spacing_deg * kDegree);
}

// The frame closest to any other pair goes; without frames, the oldest keyframe.
void PairCollector::thin() {
  if (size() <= options_.max_pairs) return;
  if (frames_.empty()) {
    excluded_.insert(keyframes_.begin()->first);
    keyframes_.erase(keyframes_.begin());
    return;
  }
  auto most_alike = frames_.begin();
  double least = 1e300;
  for (auto f = frames_.begin(); f != frames_.end(); ++f) {
    double nearest = 1e300;
    for (auto g = frames_.begin(); g != frames_.end(); ++g) {
      if (g != f) nearest = std::min(nearest, distance(f->hand, g->hand));
    }
    for (const auto& [id, k] : keyframes_) nearest = std::min(nearest, distance(f->hand, k.hand));
    if (nearest >= least) continue;
    least = nearest;
    most_alike = f;
  }
  frames_.erase(most_alike);
}

template <class IsOut>
void PairCollector::discard(const IsOut& is_out) {
  for (const auto& [id, k] : keyframes_) {
    if (is_out(k.time)) excluded_.insert(id);
  }
  for (const Waiting& w : waiting_) {
    if (w.is_keyframe && is_out(w.time)) excluded_.insert(w.keyframe_id);
  }
  std::erase_if(keyframes_, [&](const auto& k) { return is_out(k.second.time); });
  std::erase_if(frames_, [&](const FramePair& f) { return is_out(f.time); });
  std::erase_if(waiting_, [&](const Waiting& w) { return is_out(w.time); });
}

void PairCollector::discard_before(Time time) {
  discard([time](Time t) { return t < time; });
}

void PairCollector::discard_after(Time time) {
  discard([time](Time t) { return t > time; });
}

std::vector<PosePair> PairCollector::pairs() const {
  std::vector<PosePair> pairs;
  for (const auto& [id, k] : keyframes_) {
    const MapKeyframe* now = map_.find_keyframe(id);
    if (now != nullptr) pairs.push_back({k.time, now->map_from_cam, k.arm});
  }
  for (const FramePair& f : frames_) {
    const MapKeyframe* now = map_.find_keyframe(f.keyframe_id);
    if (now != nullptr) {
      pairs.push_back({f.time, now->map_from_cam * f.keyframe_from_cam, f.arm});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const PosePair& a, const PosePair& b) { return a.time < b.time; });
  return pairs;
}

}  // namespace foresight::calibration
