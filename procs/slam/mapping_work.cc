#include "procs/slam/mapping_work.h"

#include <utility>

namespace foresight {
namespace slam {
namespace {

Initializer::Answer do_work(Initializer::Attempt attempt) {
  return Initializer::run(std::move(attempt));
}

FoundSeeds do_work(SeedWork work) {
  const int32_t id = work.search.keyframe_id;
  return {id, find_seeds(work.camera, work.options, std::move(work.search))};
}

DescribedKeyframe do_work(const UndescribedKeyframe& keyframe) {
  return {keyframe.id, detect_features(keyframe.pyramid)};
}

AdjustedBundle do_work(BundleProblem problem) {
  BundleSolution solution = adjust_bundle(problem);
  return {std::move(problem), std::move(solution)};
}

FoundLoop do_work(const LoopWork& work) {
  return find_loop(work.camera, work.options, work.search);
}

SolvedGraph do_work(GraphWork work) {
  SolvedGraph solved{std::move(work.closure), work.graph, std::move(work.graph)};
  solved.usable = optimize_pose_graph(&solved.solved).usable;
  return solved;
}

FocalCheck do_work(FocalWork work) { return check_focal_length(std::move(work.problem)); }

// In local bundle adjustments.
double cost(const Initializer::Attempt&) { return 1; }
double cost(const SeedWork&) { return 0.2; }
double cost(const UndescribedKeyframe&) { return 0.2; }
double cost(const BundleProblem& problem) {
  constexpr size_t kLocal = 30;  // keyframes of a local one, those held fixed included
  return problem.keyframes.size() > kLocal ? 2 : 1;
}
double cost(const LoopWork& work) {
  return 0.4 * static_cast<double>(work.search.old_sides.size());
}
double cost(const GraphWork&) { return 0.5; }
double cost(const FocalWork&) { return 2; }

}  // namespace
}  // namespace slam

MappingJob::MappingJob(std::unique_ptr<Data> job_data) : data(std::move(job_data)) {}
MappingJob::MappingJob(MappingJob&&) noexcept = default;
MappingJob& MappingJob::operator=(MappingJob&&) noexcept = default;
MappingJob::~MappingJob() = default;

double MappingJob::relative_cost() const {
  return std::visit([](const auto& work) { return slam::cost(work); }, data->work);
}

MappingResult::MappingResult(std::unique_ptr<Data> result_data) : data(std::move(result_data)) {}
MappingResult::MappingResult(MappingResult&&) noexcept = default;
MappingResult& MappingResult::operator=(MappingResult&&) noexcept = default;
MappingResult::~MappingResult() = default;

MappingResult Slam::run(MappingJob job) {
  auto data = std::make_unique<MappingResult::Data>();
  data->epoch = job.data->epoch;
  std::visit([&](auto& work) { data->result = slam::do_work(std::move(work)); }, job.data->work);
  return MappingResult(std::move(data));
}

}  // namespace foresight
