// What goes when a map's carving outgrows its memory: the oldest constraints first, but a point
// keeps its newest ones. Nothing else is touched: vertices, cells and labels stay exact for the
// constraints that are left.
#pragma once

#include <cstdint>

#include "procs/carver/map_state.h"

namespace foresight::carving {

/// Forgets up to `count` traced rays: keyframe by keyframe, oldest first, those whose points have
/// more than 4 rays, then more than 2, then more than 1. Returns how many there were.
int64_t thin_oldest(MapState& map, int64_t count);

}  // namespace foresight::carving
