// Recognises that the camera is back at a place that it mapped before, and says how far the map has
// drifted meanwhile: the similarity between the geometry that the newest keyframes see (the new
// side) and that of the keyframes that saw the place before (the old side).
//
// The newest keyframe is placed among the old side's points as a lost camera would be (features,
// perspective-n-point, search for all points), its depth there and here gives the scale, the other
// keyframes of the new side are placed with it, and all their observations of old points together
// give the similarity (seven unknowns, robust Gauss–Newton).
//
// A wrong closure ruins a map, and rooms hold the same poster twice. So nothing is believed on one
// view, nearly all points have to be found, those of the new side in the old image as well, and the
// drift has to be one that the way between can have caused.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/place_index.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

/// Work for the worker: it owns what it needs (images and features are shared and never change).
struct LoopSearch {
  KeyframeId keyframe_id;
  std::vector<KeyframeId> new_side;  // that keyframe first, then its neighbours
  struct OldSide {
    std::vector<KeyframeId> keyframe_ids;  // a similar keyframe, then its neighbours
    double way = 0;                        // from there to here, along the keyframes; mu
  };
  std::vector<OldSide> old_sides;
  SlamMap map;  // of all these keyframes and their points
};

/// A point of the old side, seen by a keyframe of the new one.
struct LoopObservation {
  PointId point_id;
  Observation observation;
};

struct LoopClosure {
  KeyframeId keyframe_id;            // of the new side
  std::vector<KeyframeId> new_side;  // of its keyframes, those that were placed
  std::vector<KeyframeId> old_side;
  Similarity<Map, Map> old_from_new;  // where the new side's geometry belongs
  std::vector<LoopObservation> observations;
  double rms_px = 0;
};

/// Keyframes that look like this one though they share none of its points. Nothing if there is
/// none, or if its features have not been detected. Cheap.
std::optional<LoopSearch> loop_search(const SlamMap& map, const PlaceIndex& places,
                                      KeyframeId keyframe_id);

/// Pure; about 20 ms for each old side.
std::optional<LoopClosure> find_loop(const CameraModel& camera, const SlamOptions& options,
                                     const LoopSearch& search);

}  // namespace foresight::slam
