// What goes when a map's carving outgrows its memory: the oldest constraints first, but a point
// keeps its newest ones. Vertices and cells stay; labels, votes and evidence are those of the
// constraints that are left.
#pragma once

#include <cstdint>

#include "procs/carver/map_state.h"

namespace foresight::carving {

/// Forgets up to `count` constraints, all of which have been traced by now: keyframe by keyframe,
/// oldest first, those whose points have more than 4 constraints, then more than 2, then more
/// than 1. Returns how many there were.
int64_t thin_oldest(MapState& map, int64_t count);

}  // namespace foresight::carving
