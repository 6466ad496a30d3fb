// Collects pairs of poses while the base stands still: keyframes, and tracked frames between them.
//
// A keyframe's pose is looked up in the map whenever a problem is made, so pairs follow bundle
// adjustment. A tracked frame's pose would go stale: it is kept relative to the nearest keyframe
// and moves with it. Frames are worth having because keyframes are few (one per 3.5 % of the
// scene's depth) and average less noise; and because a joint delay shows only in frames taken in
// motion.
//
// Pairs wait until the joints around their image have arrived. Frames are thinned so that
// neighbours differ by the spacing; when there are too many, the frame that is most alike to
// another goes.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <vector>

#include "procs/calibrator/alignment.h"
#include "procs/calibrator/arm_history.h"
#include "procs/calibrator/map_store.h"

namespace foresight::calibration {

struct PairCollectorOptions {
  int max_pairs = 150;
  double spacing_m = 0.02;
  double spacing_deg = 3;
  double window_s = 0.12;  // joints on either side of an image
};

class PairCollector {
 public:
  PairCollector(const PairCollectorOptions& options, const ArmHistory& arm, const MapStore& map)
      : options_(options), arm_(arm), map_(map) {}

  void clear();
  /// Keyframes that appeared in the map while the base stands still.
  void add_keyframes(const MapDelta& delta);
  /// Keyframes that appeared while it does not: they will never be pairs.
  void exclude_keyframes(const MapDelta& delta);
  void add_frame(Time time, const Pose<Map, Cam>& map_from_cam);
  /// Takes up what waited for joints. Returns true when there is a new pair.
  bool update();

  /// Forgets pairs whose images are older, or newer. Waiting ones too.
  void discard_before(Time time);
  void discard_after(Time time);

  /// All pairs with their poses as of now, in order of time.
  std::vector<PosePair> pairs() const;
  int size() const { return static_cast<int>(keyframes_.size() + frames_.size()); }

 private:
  struct KeyframePair {
    Time time;
    ArmTrack arm;
    Pose<Base, Ee> hand;  // at `time`
  };
  struct FramePair {
    Time time;
    KeyframeId keyframe_id;
    Pose<Cam, Cam> keyframe_from_cam;  // translation in mu
    ArmTrack arm;
    Pose<Base, Ee> hand;  // at `time`
  };
  struct Waiting {
    Time time;
    KeyframeId keyframe_id;  // the keyframe itself, or the one nearest to the frame
    bool is_keyframe;
    Pose<Cam, Cam> keyframe_from_cam;  // of a frame
  };
  enum class Readiness { kReady, kWaits, kNever };

  Readiness readiness(const Waiting& waiting, ArmTrack* arm) const;
  void forget_removed();
  bool take(const Waiting& waiting, ArmTrack arm);
  /// Multiples of the spacing between two hands.
  double distance(const Pose<Base, Ee>& a, const Pose<Base, Ee>& b) const;
  bool knows(KeyframeId keyframe_id) const;
  void push(const Waiting& waiting);
  template <class IsOut>
  void discard(const IsOut& is_out);
  void thin();

  PairCollectorOptions options_;
  const ArmHistory& arm_;
  const MapStore& map_;
  std::map<KeyframeId, KeyframePair> keyframes_;
  std::vector<FramePair> frames_;
  std::deque<Waiting> waiting_;
  std::set<KeyframeId> excluded_;
};

}  // namespace foresight::calibration
