// What a recognised loop changes: the drift is spread over the keyframes by a pose graph, points go
// with the keyframe that their patch is from, and points that are the same are made one.
#pragma once

#include <cstdint>
#include <map>

#include "common/frames.h"
#include "procs/slam/loop_closer.h"
#include "procs/slam/pose_graph.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

/// All keyframes, as they are; edges between those that share points, and across the loop. The
/// first keyframe is fixed: it holds the map's place.
PoseGraph pose_graph_of(const SlamMap& map, const LoopClosure& closure);

/// How the map moves around each of its keyframes. Keyframes that the graph does not know (made
/// meanwhile) go with the newest that it does.
using MapCorrection = std::map<KeyframeId, Similarity<Map, Map>>;
MapCorrection correction_by(const PoseGraph& before, const PoseGraph& solved, const SlamMap& map);

void correct_map(const MapCorrection& correction, SlamMap* map);

/// New observations of old points; the new side's own point in the same place becomes one with it.
/// Call it after correct_map(). Returns how many points became one.
int fuse_points(const LoopClosure& closure, SlamMap* map);

}  // namespace foresight::slam
