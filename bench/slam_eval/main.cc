// slam-eval SEQUENCE_DIR…: scores the SLAM core on image sequences in TUM RGB-D layout; see
// evaluation.h. scripts/slam_eval builds and runs it.
#include <cstdio>
#include <vector>

#include "bench/slam_eval/evaluation.h"
#include "bench/slam_eval/option_override.h"
#include "bench/slam_eval/plot.h"
#include "bench/slam_eval/relocalisation.h"
#include "bench/slam_eval/reports.h"
#include "common/output_file.h"
#include "common/tool_main.h"

namespace foresight {
namespace {

struct Arguments {
  std::vector<std::string> folders, overrides, degradations = {"none"};
  bool all_degradations = false;
  int runs = 1;
  std::string json, table, plots;
  EvaluationRange range;
  std::string queries;  // folder
  RelocalisationRange relocalisation;
};

std::vector<Degradation> chosen_degradations(const Arguments& arguments) {
  if (arguments.all_degradations) return known_degradations();
  std::vector<Degradation> chosen;
  for (const std::string& name : arguments.degradations) chosen.push_back(degradation_named(name));
  return chosen;
}

void relocalise(const Arguments& arguments, const Sequence& mapped, const SlamOptions& options,
                const Evaluation& e) {
  const Sequence queries = load_sequence(arguments.queries);
  const std::vector<RelocalisationTrial> trials =
      try_to_relocalise(e.map, mapped, queries, options, arguments.relocalisation);
  std::printf("%s, a lost camera shown single images of %s:\n%s", e.sequence.c_str(),
              queries.name.c_str(), describe(trials).c_str());
  if (!arguments.range.verbose) return;
  for (const RelocalisationTrial& t : trials) {
    std::printf(
        "  %s: %.2f m, %.0f deg off; %s after %d images, quality %.2f, error %.3f m, %.1f deg\n",
        t.path.c_str(), t.distance_m, t.angle_deg, t.placed() ? "placed" : "lost", t.images,
        t.quality, t.error_m, t.error_deg);
  }
}

// One sequence under each degradation.
void evaluate_one(const Arguments& arguments, const std::string& source, const SlamOptions& options,
                  std::vector<Evaluation>* evaluations, RunErrors* errors) {
  const Sequence sequence = load_sequence(source);
  for (const Degradation& degradation : chosen_degradations(arguments)) {
    EvaluationRange range = arguments.range;
    range.degradation = degradation;
    std::vector<Evaluation> runs;
    for (int i = 0; i < arguments.runs; ++i) runs.push_back(evaluate(sequence, options, range));
    Evaluation e = median_of(runs);
    print(e);
    if (!arguments.queries.empty()) {
      errors->attempt([&] { relocalise(arguments, sequence, options, e); });
    }
    std::fflush(stdout);
    if (!arguments.plots.empty()) {
      errors->attempt([&] {
        plot_trajectory(e, arguments.plots + "/" + e.sequence + "_" + e.degradation + ".png");
      });
    }
    if (!complaint(e).empty()) errors->add(complaint(e));
    e.map = {};  // holds images
    evaluations->push_back(std::move(e));
  }
}

int evaluate_all(const Arguments& arguments) {
  SlamOptions options;
  for (const std::string& o : arguments.overrides) override_option(o, &options);
  chosen_degradations(arguments);  // refuses unknown ones before the first run
  check_output("--json", arguments.json);
  check_output("--table", arguments.table);
  check_output_folder("--plots", arguments.plots);
  check_output_folder("--save", arguments.range.save_folder);
  RunErrors errors;
  std::vector<Evaluation> evaluations;
  for (const std::string& source : arguments.folders) {
    errors.attempt([&] { evaluate_one(arguments, source, options, &evaluations, &errors); });
  }
  errors.attempt([&] { write_json(evaluations, arguments.json); });
  errors.attempt([&] { write_table(evaluations, arguments.table); });
  errors.report();
  return kExitDone;
}

std::string degradation_help() {
  std::string help = "what is done to the images:";
  for (const Degradation& d : known_degradations()) help += "\n  " + d.name + ": " + d.doc;
  return help;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  CLI::App app("Scores the SLAM core on image sequences in TUM RGB-D layout", "slam-eval");
  Arguments a;
  app.add_option("sequence", a.folders,
                 "folders with rgb.txt, camera.yaml, groundtruth.txt; or videos")
      ->required();
  app.add_option("--runs", a.runs,
                 "repeat, and report the medians of times; fails if results differ")
      ->check(CLI::PositiveNumber);
  app.add_option("--degrade", a.degradations, degradation_help());
  app.add_flag("--degrade-all", a.all_degradations, "each of these in turn");
  app.add_option("--json", a.json, "write the numbers to this file");
  app.add_option("--table", a.table, "write a Markdown table, peers' figures beside, to this file");
  app.add_option("--plots", a.plots, "draw each trajectory and the truth as PNG into this folder");
  app.add_option(
      "--save", a.range.save_folder,
      "save each map (COLMAP text model, slam's map_folder) and trajectory (TUM) in here");
  app.add_option("--start", a.range.play.start, "first image");
  app.add_option("--frames", a.range.play.frames, "number of images; -1: all");
  app.add_option("--step", a.range.play.step, "take every so many images")
      ->check(CLI::PositiveNumber);
  app.add_option("--focal-factor", a.range.focal_factor,
                 "multiply the given focal length by this: a wrong camera file");
  app.add_option("--relocalise", a.queries,
                 "then show single images of this sequence (same world) to a lost camera");
  app.add_option("--relocalise-start", a.relocalisation.start, "first of these images")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--relocalise-every", a.relocalisation.every, "take every so many of them")
      ->check(CLI::PositiveNumber);
  app.add_flag("--relocalise-hint", a.relocalisation.hint,
               "tell it the pose, off by 3 cm and 2 degrees, as an arm might");
  app.add_flag("--verbose", a.range.verbose, "one line per image");
  app.add_option("--set", a.overrides, "option=value, see procs/slam/slam_options.h");
  return tool_main(app, argc, argv, [&] { return evaluate_all(a); });
}
