// slam-eval SEQUENCE_DIR… [--json FILE] [--plot FILE.png] [--start N] [--frames N] [--step N]
// [--depth-scale M] [--verbose] Scores the SLAM core on image sequences in TUM RGB-D layout; see
// evaluation.h.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <vector>

#include "bench/slam_eval/evaluation.h"
#include "bench/slam_eval/option_override.h"
#include "bench/slam_eval/plot.h"
#include "common/errors.h"

namespace foresight {
namespace {

void print(const Evaluation& e) {
  const SlamStatistics& s = e.statistics;
  std::printf(
      "%-12s tracked %5.1f %% of %d, first pose frame %d (%.2f s), ATE %.2f cm (max %.1f, %d over "
      "10 cm)\n"
      "             track %.1f ms median, %.1f p95; %d jobs %.0f ms median, %.0f max; %.0f MB\n"
      "             %d keyframes, %d points (%d published), %d losses, %d relocalisations, %d "
      "restarts\n",
      e.sequence.c_str(), 100 * e.tracked_fraction, e.frames, e.first_frame, e.init_s,
      100 * e.ate_rmse_m, 100 * e.ate_max_m, e.wrong_by_10_cm, e.track_ms_median, e.track_ms_p95,
      e.jobs, e.job_ms_median, e.job_ms_max, e.peak_mb, s.keyframes, s.points, s.published_points,
      s.losses, s.relocalisations, s.restarts);
  std::printf(
      "             quality: %.2f 5th percentile of right poses, %.2f highest of those off by "
      "10 cm\n",
      e.right_quality_p05, e.wrong_quality_max);
  if (e.depth.compared == 0) return;
  std::printf(
      "             depth of %d points: median error %.2f %%, %.1f %% within 5 %%, %.1f %% "
      "float more than 10 %% in front\n",
      e.depth.compared, e.depth.median_error_percent, 100 * e.depth.within_5_percent,
      100 * e.depth.in_front_10_percent);
}

void write_json(const std::vector<Evaluation>& evaluations, const std::string& path) {
  std::ofstream file(path);
  file << "[\n";
  for (size_t i = 0; i < evaluations.size(); ++i) {
    const Evaluation& e = evaluations[i];
    file << "  {\"sequence\": \"" << e.sequence << "\", \"frames\": " << e.frames
         << ", \"tracked_fraction\": " << e.tracked_fraction << ", \"init_s\": " << e.init_s
         << ", \"ate_rmse_m\": " << e.ate_rmse_m << ", \"track_ms_median\": " << e.track_ms_median
         << ", \"track_ms_p95\": " << e.track_ms_p95 << ", \"job_ms_median\": " << e.job_ms_median
         << ", \"job_ms_max\": " << e.job_ms_max << ", \"keyframes\": " << e.statistics.keyframes
         << ", \"points\": " << e.statistics.published_points
         << ", \"losses\": " << e.statistics.losses
         << ", \"relocalisations\": " << e.statistics.relocalisations
         << ", \"restarts\": " << e.statistics.restarts << ", \"peak_mb\": " << e.peak_mb << "}"
         << (i + 1 < evaluations.size() ? ",\n" : "\n");
  }
  file << "]\n";
  if (!file) throw UnavailableError(path + ": cannot be written");
}

int run(int argc, char** argv) {
  CLI::App app("Scores the SLAM core on image sequences in TUM RGB-D layout");
  std::vector<std::string> folders;
  std::string json, plot;
  EvaluationRange range;
  std::vector<std::string> overrides;
  app.add_option("sequence", folders, "folders with rgb.txt, camera.yaml, groundtruth.txt")
      ->required();
  app.add_option("--json", json, "write the numbers to this file");
  app.add_option("--plot", plot, "draw the (last) trajectory and the truth to this image file");
  app.add_option("--start", range.start, "first image");
  app.add_option("--frames", range.frames, "number of images; −1: all");
  app.add_option("--step", range.step, "take every so many images")->check(CLI::PositiveNumber);
  app.add_option("--depth-scale", range.depth_scale,
                 "check points against registered depth images; metres per unit");
  app.add_flag("--verbose", range.verbose, "one line per image");
  app.add_option("--set", overrides, "option=value, see procs/slam/slam_options.h");
  CLI11_PARSE(app, argc, argv);
  SlamOptions options;
  for (const std::string& o : overrides) override_option(o, &options);
  std::vector<Evaluation> evaluations;
  for (const std::string& folder : folders) {
    evaluations.push_back(evaluate(load_sequence(folder), options, range));
    print(evaluations.back());
    if (!plot.empty()) plot_trajectory(evaluations.back(), plot);
  }
  if (!json.empty()) write_json(evaluations, json);
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  try {
    return foresight::run(argc, argv);
  } catch (const foresight::StartupError& e) {
    std::fprintf(stderr, "slam-eval: %s\n", e.what());
    return e.code();
  }
}
