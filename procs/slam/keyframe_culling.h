// Which keyframes go: those that add nothing, and, when memory is short, those that add least. The
// first stays, because it holds the map's place, and so do the newest, which have yet to show what
// they are good for.
#pragma once

#include <cstdint>
#include <optional>

#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

/// After a keyframe has come: the oldest one that others make superfluous. Either it stands in a
/// crowd and three others see its points, or those that see what the newest one sees cover its
/// points (view_coverage.h).
std::optional<KeyframeId> superfluous_keyframe(const SlamMap& map, const SlamOptions& options);

/// The one whose points have the most other observers; none if only those are left that stay.
std::optional<KeyframeId> least_needed_keyframe(const SlamMap& map);

}  // namespace foresight::slam
