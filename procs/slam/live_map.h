// A map in use: all that belongs to one epoch. The next epoch is a new value in its place, so that
// nothing of the old one is left. (A map at rest: stored_map.h.)
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/camera_model.h"
#include "common/time.h"
#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/frame.h"
#include "procs/slam/initializer.h"
#include "procs/slam/loop_closer.h"
#include "procs/slam/mapper.h"
#include "procs/slam/motion_model.h"
#include "procs/slam/place_index.h"
#include "procs/slam/published_map.h"
#include "procs/slam/relocalizer.h"
#include "procs/slam/slam.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"
#include "procs/slam/still_camera.h"
#include "procs/slam/stored_map.h"
#include "procs/slam/tracker.h"

namespace foresight::slam {

/// What the slow work (mapping_tasks.h) has to do.
struct Agenda {
  bool adjust_newest = false;          // keyframe and its neighbours
  std::deque<KeyframeId> unlooped;     // keyframes that have not been compared with older ones
  std::optional<LoopClosure> closure;  // recognised, not yet solved
  int keyframes_since_all = 0;         // were adjusted
  bool adjust_all = false;             // a loop was closed
  int keyframes_to_check = 5;          // from now to the next check of the focal length

  void note_keyframe(KeyframeId id, const SlamOptions& options);
  void note_loop_closed();
};

/// Where an image is that follows one that was placed.
struct Placement {
  TrackingAttempt attempt;
  bool is_good = false;       // else: lost
  bool is_elsewhere = false;  // another place than the predicted one
};

struct LiveMap {
  LiveMap(const CameraModel& camera, const SlamOptions& options);

  /// Fills an empty one. Tracking goes on from its second view.
  void begin(const InitialMap& initial);
  /// Fills an empty one. The camera is lost in it at first.
  void restore(const StoredMap& stored);

  Placement follow(const Frame& frame);
  /// What moves may have hidden, when a map began, that all else stands still. If the newest
  /// keyframe of a young map shows that, what it shows.
  std::optional<StillEvidence> refutation_by_newest_keyframe() const;

  CameraModel camera;
  SlamOptions options;
  SlamMap map;
  Mapper mapper;
  MotionModel motion;
  Relocalizer relocalizer;
  PublishedMap published;
  PlaceIndex places;
  TrackingState state = TrackingState::kInitialising;
  Time lost_since;
  int good_frames = 0;  // in a row
  Agenda agenda;
  FocalCheck focal;          // the last one of use
  bool is_restored = false;  // it was stored: never given up
  std::string reset_reason;  // why the one before it ended; empty once there is a map

 private:
  TrackingAttempt attempt(const Frame& frame, const Pose<Map, Cam>& pose, SearchWidth width) const;
  bool is_good(const TrackingAttempt& attempt) const;
  bool same_place(const TrackingAttempt& a, const TrackingAttempt& b) const;
};

}  // namespace foresight::slam
