// Did the camera move between two images, or do things move before a still camera? Tracks cannot
// tell: what moves rigidly (a cloth that a hand draws along, a belt, a film on a screen) looks like
// a scene that is passed by. The rest of the picture can: where it has texture, it has changed if
// the camera moved as a first map claims, and is as it was if the camera stands still.
//
//   const StillEvidence evidence = still_evidence(camera, {first, second, second_from_first,
//   depth}); if (evidence.says_still()) …  // no map can come of these two
//
// A pure function.
#pragma once

#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/image_pyramid.h"

namespace foresight::slam {

/// A motion that two images are said to show, in any unit.
struct ClaimedMotion {
  const ImagePyramid& first;
  const ImagePyramid& second;
  Pose<Cam, Cam> second_from_first;
  double depth = 0;  // median of the points, in the first camera
};

/// What became of a piece of the picture.
enum class CellFate {
  kUntold,   // no texture, or it would look the same after the claimed motion
  kSame,     // looks as before, though the claimed motion would have changed it
  kChanged,  // does not
};

struct StillEvidence {
  std::vector<CellFate> cells;  // row by row; their number depends on the image size alone
  int same = 0, changed = 0;    // cells
  int enclosed = 0;             // changed cells that have cells which are the same on all sides

  /// Most of the picture stayed as it was, or what surrounds the rest did. What a camera carries in
  /// its view (fingers, a tool) stays, too, but it enters from a side and surrounds nothing.
  bool says_still() const;
  /// Most of what stayed as it was in `earlier` still is as it was.
  bool confirms(const StillEvidence& earlier) const;
};

StillEvidence still_evidence(const CameraModel& camera, const ClaimedMotion& claim);

}  // namespace foresight::slam
