// A map at rest and back: StoredMap has no pyramids, patches or indices, which are made anew.
#pragma once

#include "procs/slam/slam_map.h"
#include "procs/slam/stored_map.h"

namespace foresight::slam {

/// Images are shared.
StoredMap store(const SlamMap& map, const CameraModel& camera);
/// With the ids it was stored with. `camera` is prepared.
SlamMap restored(const StoredMap& stored, const CameraModel& camera);

}  // namespace foresight::slam
