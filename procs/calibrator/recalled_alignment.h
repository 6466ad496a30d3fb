// The alignment of before a restart, until the first frames after it confirm or contradict it.
//
// A frame confirms it when eq. (8) puts the base where it was last seen: within what a base that
// stands still is allowed (BaseBounds), and as far beyond as it may have gone meanwhile, by how
// fast it moved of late. kFrames of them running over kConfirm are enough; as many running over
// kContradict that say otherwise drop it, and so do frames of another time.
//
//   RecalledAlignment recalled(kept);
//   switch (recalled.judge(frame_time, world_from_base, bounds)) …
#pragma once

#include "procs/calibrator/kept_alignment.h"

namespace foresight::calibration {

/// How far the base may seem to be from where it was, if it has not moved.
struct BaseBounds {
  double position_m = 0, rotation_rad = 0;
};

class RecalledAlignment {
 public:
  static constexpr Duration kLongestAge = seconds(60);  // between the last frame and the first
  static constexpr int kFrames = 6;
  static constexpr Duration kConfirm = milliseconds(400);
  static constexpr Duration kContradict = milliseconds(1500);

  enum class Verdict { kOpen, kConfirmed, kContradicted, kTooOld };

  explicit RecalledAlignment(const KeptAlignment& kept) : kept_(kept) {}
  const KeptAlignment& kept() const { return kept_; }

  /// One tracked frame, by which the base is at `world_from_base`. Times increase.
  Verdict judge(Time time, const Pose<World, Base>& world_from_base, const BaseBounds& bounds);

 private:
  enum class Opinion { kNone, kAgrees, kContradicts, kOfAnotherTime };
  Opinion opinion(Time time, const Pose<World, Base>& world_from_base,
                  const BaseBounds& bounds) const;

  KeptAlignment kept_;
  Opinion running_ = Opinion::kNone;
  Time since_;
  int frames_ = 0;
};

}  // namespace foresight::calibration
