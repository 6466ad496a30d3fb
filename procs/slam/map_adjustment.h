// Which part of the map is adjusted together, and what its solution changes. The adjustment itself
// is bundle_adjustment.h; everything here is quick and runs on the main thread.
#pragma once

#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/loop_correction.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

/// The newest keyframe, those that share most with it, and their points.
BundleProblem bundle_problem(const SlamMap& map, const SlamOptions& options);
/// Keyframes spread over the whole map and some of their points, for check_focal_length().
BundleProblem focal_problem(const SlamMap& map, const SlamOptions& options);
/// All keyframes and the points that tie them together best, for when there is nothing to do.
BundleProblem global_problem(const SlamMap& map, const SlamOptions& options);

/// Moves what still exists; points that were not in the problem follow their source keyframe;
/// outliers and misfits go. Returns how each keyframe moved, growth of its surroundings included.
MapCorrection apply_solution(const BundleProblem& problem, const BundleSolution& solution,
                             SlamMap* map);

}  // namespace foresight::slam
