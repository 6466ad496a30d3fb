// evaluate: does the predicted view help? On recorded video (scorer.h), and in the closed loop of
// the simulated robot (closed_loop_scorer.h).
#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/evaluate/figures.h"
#include "common/output_file.h"
#include "common/tool_main.h"

namespace foresight {
namespace {

struct Options {
  std::vector<std::string> sequences;
  bool sim = false;
  std::vector<std::string> base_motions{"still", "waves"};
  double seconds = 60;
  std::vector<double> delays_s{0.3};
  std::string json, csv, grid, series, log;
  int frames = 0, first_frame = 0, every = 3;
  std::vector<std::string> settings;
};

void declare(CLI::App& app, Options& o) {
  app.add_option("sequence", o.sequences, "folders in TUM layout, or videos");
  app.add_flag("--sim", o.sim, "the simulated robot in the loop instead of recorded video");
  app.add_option("--base", o.base_motions,
                 "with --sim: how the base moves: still, push, ramp, waves, random_walk")
      ->capture_default_str();
  app.add_option("--seconds", o.seconds, "with --sim: length of the session")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 86400.0));
  app.add_option("--delay", o.delays_s,
                 "delays in s: age of the video; with --sim there and back, half each way")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--frames", o.frames, "frames to use; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--first-frame", o.first_frame, "frames to skip")->check(CLI::NonNegativeNumber);
  app.add_option("--every", o.every, "score the picture of each Nth predicted frame")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--set", o.settings, "process.key=value (repeatable)")->allow_extra_args(false);
  app.add_option("--json", o.json, "write one object per run");
  app.add_option("--csv", o.csv, "write one line per run");
  app.add_option("--grid", o.grid, "write a PNG: truth, delayed, homography, predicted, error");
  app.add_option("--series", o.series, "with --sim: folder for CSV files of errors over time");
  app.add_option("--log", o.log,
                 "with --sim: folder for robot.lcmlog and operator.lcmlog, all that was published "
                 "(session-report and --replay read them)");
}

Report evaluate_one(const Options& o, const std::string& sequence, double delay_s,
                    RunErrors* errors) {
  const RecordedLineOptions line{sequence, delay_s, o.first_frame, o.frames, o.settings};
  const auto result = evaluate(line, {.every = o.every}, [&](int frames, int scored) {
    std::fprintf(stderr, "\r%s, delay %.2f s: frame %d, %d scored ", sequence.c_str(), delay_s,
                 frames, scored);
  });
  std::fprintf(stderr, "\n");
  print_table(result);
  if (!result.input.complete()) errors->add(sequence + ": " + result.input.complaint());
  return report_of(result);
}

std::vector<Report> evaluate_recorded(const Options& o, RunErrors* errors) {
  check_settings(o.settings, {"camera", "slam", "carver", "mesher", "link", "renderer"});
  std::vector<Report> reports;
  for (const std::string& sequence : o.sequences) {
    for (double delay_s : o.delays_s) {
      errors->attempt([&] { reports.push_back(evaluate_one(o, sequence, delay_s, errors)); });
    }
  }
  return reports;
}

Report simulate_one(const Options& o, const std::string& motion, double delay_s,
                    RunErrors* errors) {
  ClosedLoopOptions loop{o.seconds, delay_s, {"sim.base_motion=" + motion}};
  loop.settings.insert(loop.settings.end(), o.settings.begin(), o.settings.end());
  ClosedLoopScoring scoring{.every = o.every};
  if (!o.log.empty()) {
    char delay[16];
    std::snprintf(delay, sizeof delay, "%.2f", delay_s);
    scoring.log_folder = o.log + "/base_" + motion + "_" + delay;
    check_output_folder("--log", scoring.log_folder);
  }
  auto result = evaluate(loop, scoring, [&](double share) {
    std::fprintf(stderr, "\rbase %s, delay %.2f s: %3.0f %% ", motion.c_str(), delay_s,
                 100 * share);
  });
  std::fprintf(stderr, "\n");
  result.name = "base_" + motion;
  print_table(result);
  if (!o.series.empty()) {
    errors->attempt([&] { write_series(o.series + "/" + result.name, result); });
  }
  return report_of(result);
}

std::vector<Report> evaluate_simulated(const Options& o, RunErrors* errors) {
  check_settings(o.settings, ClosedLoop::processes());
  std::vector<Report> reports;
  for (const std::string& motion : o.base_motions) {
    for (double delay_s : o.delays_s) {
      errors->attempt([&] { reports.push_back(simulate_one(o, motion, delay_s, errors)); });
    }
  }
  return reports;
}

int run(const Options& o) {
  if (o.sim == !o.sequences.empty()) throw UsageError("give a sequence or --sim, one of the two");
  check_output("--json", o.json);
  check_output("--csv", o.csv);
  check_output("--grid", o.grid, kPictureExtensions);
  check_output_folder("--series", o.series);
  check_output_folder("--log", o.log);
  RunErrors errors;
  const std::vector<Report> reports =
      o.sim ? evaluate_simulated(o, &errors) : evaluate_recorded(o, &errors);
  errors.attempt([&] { write_json(o.json, reports); });
  errors.attempt([&] { write_csv(o.csv, reports); });
  errors.attempt([&] { write_grid(o.grid, reports); });
  errors.report();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  Options options;
  CLI::App app(
      "Runs the whole system deterministically, on recorded video or with the simulated robot in "
      "the loop, and scores the predicted view against the delayed video and the best homography.",
      "evaluate");
  declare(app, options);
  return tool_main(app, argc, argv, [&] { return run(options); });
}
