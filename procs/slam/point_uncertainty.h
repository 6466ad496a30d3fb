// How certain is a point? The largest standard deviation of its position, which is along the view.
#pragma once

#include "procs/slam/slam_map.h"

namespace foresight::slam {

/// In map units, from the geometry and the residuals of its observations; the keyframes are taken
/// for exact. At most the distance from the source keyframe (nothing is known).
double position_sigma(const SlamMap& map, const Point& point);

}  // namespace foresight::slam
