// The kinds of slow work that Slam hands to a worker, and what comes back. Each owns copies of all
// that it needs (images are shared and never written), so that it may run on any thread while
// tracking goes on. A new kind: a struct here, its do_work() and cost in the .cc, a place in
// Slam::take_job() and Slam::apply().
#pragma once

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/depth_seeds.h"
#include "procs/slam/initializer.h"
#include "procs/slam/loop_closer.h"
#include "procs/slam/pose_graph.h"
#include "procs/slam/slam.h"

namespace foresight {
namespace slam {

struct SeedWork {
  CameraModel camera;
  SlamOptions options;
  SeedSearch search;
};
struct FoundSeeds {
  int32_t keyframe_id = 0;
  std::vector<Seed> seeds;
};

/// A keyframe whose features have not been detected.
struct UndescribedKeyframe {
  int32_t id = 0;
  ImagePyramid pyramid;
};
struct DescribedKeyframe {
  int32_t id = 0;
  std::shared_ptr<const Features> features;
};

struct AdjustedBundle {
  BundleProblem problem;
  BundleSolution solution;
};

struct LoopWork {
  CameraModel camera;
  SlamOptions options;
  LoopSearch search;
};
using FoundLoop = std::optional<LoopClosure>;

struct GraphWork {
  LoopClosure closure;
  PoseGraph graph;
};
struct SolvedGraph {
  LoopClosure closure;
  PoseGraph before, solved;
  bool usable = false;
};

struct FocalWork {
  BundleProblem problem;
};

}  // namespace slam

struct MappingJob::Data {
  int epoch = 0;
  std::variant<slam::Initializer::Attempt, slam::SeedWork, slam::UndescribedKeyframe,
               slam::BundleProblem, slam::LoopWork, slam::GraphWork, slam::FocalWork>
      work;
};

struct MappingResult::Data {
  int epoch = 0;
  std::variant<slam::Initializer::Answer, slam::FoundSeeds, slam::DescribedKeyframe,
               slam::AdjustedBundle, slam::FoundLoop, slam::SolvedGraph, slam::FocalCheck>
      result;
};

}  // namespace foresight
