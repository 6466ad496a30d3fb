#include "procs/slam/mapping_tasks.h"

#include <optional>
#include <utility>
#include <vector>

#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/depth_seeds.h"
#include "procs/slam/features.h"
#include "procs/slam/loop_closer.h"
#include "procs/slam/loop_correction.h"
#include "procs/slam/map_adjustment.h"
#include "procs/slam/pose_graph.h"

namespace foresight::slam {
namespace {

constexpr int kFocalCheckKeyframes = 12;  // from one check of the focal length to the next

using TaskPointer = std::unique_ptr<MappingTask>;

class SolveFirstMap : public MappingTask {
 public:
  explicit SolveFirstMap(Initializer::Attempt attempt) : attempt_(std::move(attempt)) {}
  static TaskPointer take(Mapping* m) {
    if (m->live.state != TrackingState::kInitialising) return nullptr;
    auto attempt = m->initializer.take_attempt();
    return attempt ? std::make_unique<SolveFirstMap>(std::move(*attempt)) : nullptr;
  }

  double relative_cost() const override { return 1; }
  void run() override { answer_ = Initializer::run(std::move(attempt_)); }
  void apply(Mapping* m) override {
    if (m->live.state != TrackingState::kInitialising) return;
    const Initializer::Outcome outcome = m->initializer.apply(answer_);
    if (!outcome.map) return;
    m->live.begin(*outcome.map);
    m->initializer.restart();
  }

 private:
  Initializer::Attempt attempt_;
  Initializer::Answer answer_;
};

class FindSeeds : public MappingTask {
 public:
  FindSeeds(const Mapping& m, SeedSearch search)
      : camera_(m.live.camera), options_(m.live.options), search_(std::move(search)) {}
  static TaskPointer take(Mapping* m) {
    auto search = m->live.mapper.take_seed_search(m->live.map);
    return search ? std::make_unique<FindSeeds>(*m, std::move(*search)) : nullptr;
  }

  double relative_cost() const override { return 0.2; }
  void run() override {
    keyframe_id_ = search_.keyframe_id;
    seeds_ = find_seeds(camera_, options_, std::move(search_));
  }
  void apply(Mapping* m) override {
    m->live.mapper.add_seeds(keyframe_id_, std::move(seeds_), &m->live.map);
  }

 private:
  CameraModel camera_;
  SlamOptions options_;
  SeedSearch search_;
  KeyframeId keyframe_id_;
  std::vector<Seed> seeds_;
};

class AdjustBundle : public MappingTask {
 public:
  explicit AdjustBundle(BundleProblem problem) : problem_(std::move(problem)) {}
  static TaskPointer take_newest(Mapping* m) {
    if (!std::exchange(m->live.agenda.adjust_newest, false)) return nullptr;
    return std::make_unique<AdjustBundle>(bundle_problem(m->live.map, m->live.options));
  }
  static TaskPointer take_all(Mapping* m) {
    Agenda& agenda = m->live.agenda;
    const int every = m->live.options.adjust_all_keyframes;
    if (!agenda.adjust_all && (every <= 0 || agenda.keyframes_since_all < every)) return nullptr;
    agenda.keyframes_since_all = 0;
    agenda.adjust_all = false;
    return std::make_unique<AdjustBundle>(global_problem(m->live.map, m->live.options));
  }

  double relative_cost() const override {
    constexpr size_t kLocal = 30;  // keyframes of a local one, those held fixed included
    return problem_.keyframes.size() > kLocal ? 2 : 1;
  }
  void run() override { solution_ = adjust_bundle(problem_); }
  void apply(Mapping* m) override {
    m->live.motion.correct(m->live.mapper.apply(problem_, solution_, &m->live.map));
  }

 private:
  BundleProblem problem_;
  BundleSolution solution_;
};

/// Detects a keyframe's features.
class DescribeKeyframe : public MappingTask {
 public:
  DescribeKeyframe(KeyframeId id, ImagePyramid pyramid) : id_(id), pyramid_(std::move(pyramid)) {}
  static TaskPointer take(Mapping* m) {
    const auto& keyframes = m->live.map.keyframes();
    for (auto k = keyframes.rbegin(); k != keyframes.rend(); ++k) {
      if (!k->second.features) {
        return std::make_unique<DescribeKeyframe>(k->first, k->second.pyramid);
      }
    }
    return nullptr;
  }

  double relative_cost() const override { return 0.2; }
  void run() override { features_ = detect_features(pyramid_); }
  void apply(Mapping* m) override {
    if (m->live.map.keyframe(id_) == nullptr) return;  // culled meanwhile
    m->live.map.set_features(id_, std::move(features_));
  }

 private:
  KeyframeId id_;
  ImagePyramid pyramid_;
  std::shared_ptr<const Features> features_;
};

/// Is a new keyframe's place an old one?
class FindLoop : public MappingTask {
 public:
  FindLoop(const Mapping& m, LoopSearch search)
      : camera_(m.live.camera), options_(m.live.options), search_(std::move(search)) {}
  static TaskPointer take(Mapping* m) {
    std::deque<KeyframeId>& unlooped = m->live.agenda.unlooped;
    if (!unlooped.empty()) m->live.places.follow(m->live.map);
    while (!unlooped.empty()) {
      const KeyframeId id = unlooped.front();
      unlooped.pop_front();
      if (auto search = loop_search(m->live.map, m->live.places, id)) {
        return std::make_unique<FindLoop>(*m, std::move(*search));
      }
    }
    return nullptr;
  }

  double relative_cost() const override {
    return 0.4 * static_cast<double>(search_.old_sides.size());
  }
  void run() override {
    closure_ = find_loop(camera_, options_, search_);
    search_ = {};
  }
  void apply(Mapping* m) override { m->live.agenda.closure = std::move(closure_); }

 private:
  CameraModel camera_;
  SlamOptions options_;
  LoopSearch search_;
  std::optional<LoopClosure> closure_;
};

/// Spreads the drift that a loop has shown over the keyframes.
class CloseLoop : public MappingTask {
 public:
  CloseLoop(LoopClosure closure, PoseGraph graph)
      : closure_(std::move(closure)), before_(std::move(graph)) {}
  static TaskPointer take(Mapping* m) {
    std::optional<LoopClosure> closure = std::exchange(m->live.agenda.closure, std::nullopt);
    if (!closure) return nullptr;
    PoseGraph graph = pose_graph_of(m->live.map, *closure);
    return std::make_unique<CloseLoop>(std::move(*closure), std::move(graph));
  }

  double relative_cost() const override { return 0.5; }
  void run() override {
    solved_ = before_;
    usable_ = optimize_pose_graph(&solved_).usable;
  }
  void apply(Mapping* m) override {
    LiveMap& live = m->live;
    if (!usable_ || live.map.keyframe(closure_.keyframe_id) == nullptr) return;
    const MapCorrection correction = correction_by(before_, solved_, live.map);
    live.mapper.apply(correction, closure_, &live.map);
    live.motion.correct(correction.at(live.map.newest_keyframe().id));
    live.agenda.note_loop_closed();
    ++m->counters.loops;
  }

 private:
  LoopClosure closure_;
  PoseGraph before_, solved_;
  bool usable_ = false;
};

class CheckFocalLength : public MappingTask {
 public:
  explicit CheckFocalLength(BundleProblem problem) : problem_(std::move(problem)) {}
  static TaskPointer take(Mapping* m) {
    if (m->live.agenda.keyframes_to_check > 0) return nullptr;
    m->live.agenda.keyframes_to_check = kFocalCheckKeyframes;
    return std::make_unique<CheckFocalLength>(focal_problem(m->live.map, m->live.options));
  }

  double relative_cost() const override { return 2; }
  void run() override { check_ = check_focal_length(std::move(problem_)); }
  void apply(Mapping* m) override {
    if (check_.usable) m->live.focal = check_;
  }

 private:
  BundleProblem problem_;
  FocalCheck check_;
};

// While there is no map, the first alone finds work.
constexpr TaskPointer (*kByUrgency[])(Mapping*) = {
    SolveFirstMap::take, FindSeeds::take, AdjustBundle::take_newest, DescribeKeyframe::take,
    CloseLoop::take,     FindLoop::take,  AdjustBundle::take_all,    CheckFocalLength::take,
};

}  // namespace

TaskPointer next_task(Mapping* mapping) {
  for (const auto take : kByUrgency) {
    if (TaskPointer task = take(mapping)) return task;
  }
  return nullptr;
}

}  // namespace foresight::slam
