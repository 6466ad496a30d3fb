// carve-bench: times the cores of carver and mesher on a recorded map sequence, and writes the
// mesh. Times are CPU times of the thread: of `Carver::apply` per event; of `Mesher::apply` and
// `update` after it ("cut": from a delta to the mesh).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "bench/carve_bench/measure.h"
#include "bench/carve_bench/reports.h"
#include "common/output_file.h"
#include "common/tool_main.h"

namespace {

struct Arguments {
  std::string input, json, events, mesh, energy = "visibility", lambda_unit = "relative";
  foresight::CarveMeasurement measurement;
  bool reference_setup = false;
};

void add_carver_options(Arguments* arguments, CLI::App* app) {
  app->add_option("input", arguments->input, "NAME.carv.gz")->required();
  app->add_flag("--reference-setup", arguments->reference_setup,
                "hull of ±20 m, earlier observations of new points not carved, exact coordinates");
  app->add_option("--json", arguments->json, "write the results to this file");
  app->add_option("--events", arguments->events, "write the times of single events to this CSV");
  app->add_option("--repeat", arguments->measurement.repeat, "runs to average over")
      ->check(CLI::PositiveNumber);
  app->add_option("--max-constraints", arguments->measurement.carver.max_constraints_per_cell,
                  "per cell; 0 = all")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--rebuild-cost-ratio", arguments->measurement.carver.rebuild_cost_ratio,
                  "rebuild when an update seems this many times dearer")
      ->check(CLI::NonNegativeNumber);
}

void add_cut_options(Arguments* arguments, CLI::App* app) {
  app->add_option("--mesh", arguments->mesh, "write the final mesh to this OBJ file");
  app->add_flag("--no-cut", arguments->measurement.carver_only, "time the carver only");
  app->add_option("--energy", arguments->energy, "what the surface minimises; soft: visibility")
      ->check(CLI::IsMember({"visibility", "soft", "volume"}))
      ->capture_default_str();
  app->add_option("--surface-weight", arguments->measurement.mesher.visibility.surface,
                  "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--shape-weight", arguments->measurement.mesher.visibility.shape,
                  "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--pocket-weight", arguments->measurement.mesher.visibility.pocket,
                  "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--lambda", arguments->measurement.mesher.lambda, "volume: weight of the area")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_option("--lambda-unit", arguments->lambda_unit,
                  "volume: shares of the scene's size, or map units")
      ->check(CLI::IsMember({"relative", "map_unit"}))
      ->capture_default_str();
}

// Takes in the options that are words or stand for several.
foresight::CarvReadOptions complete(Arguments* arguments) {
  using foresight::Energy;
  foresight::CarvReadOptions reading;
  foresight::CarveMeasurement& how = arguments->measurement;
  how.mesher.energy = arguments->energy == "volume" ? Energy::kVolume : Energy::kVisibility;
  if (arguments->lambda_unit == "map_unit") {
    how.mesher.lambda_unit = foresight::LambdaUnit::kMapUnit;
  }
  if (arguments->reference_setup) {
    reading.earlier_observations = false;
    reading.mu_per_m = 1e5;
    how.carver.hull_half_size_mu = 20.0 * reading.mu_per_m;
  }
  return reading;
}

int run(Arguments* arguments) {
  if (arguments->measurement.carver_only && !arguments->mesh.empty()) {
    throw foresight::UsageError("--mesh needs the cut: leave out --no-cut");
  }
  foresight::check_output("--json", arguments->json);
  foresight::check_output("--events", arguments->events);
  foresight::check_output("--mesh", arguments->mesh);
  const foresight::CarvSequence sequence =
      foresight::read_carv(arguments->input, complete(arguments));
  if (!sequence.error.empty()) throw foresight::UsageError(sequence.error);
  const foresight::CarveResult result = measure(sequence, arguments->measurement);
  print(result);
  foresight::RunErrors errors;
  errors.attempt([&] { write_json(result, arguments->json); });
  errors.attempt([&] { write_events(sequence, result, arguments->events); });
  errors.attempt([&] { write_obj(result.mesh, arguments->mesh); });
  errors.report();
  return foresight::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Times free-space carving and the cut on a carvseq file", "carve-bench"};
  add_carver_options(&arguments, &app);
  add_cut_options(&arguments, &app);
  return foresight::tool_main(app, argc, argv, [&] { return run(&arguments); });
}
