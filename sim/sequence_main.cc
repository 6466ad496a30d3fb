// sim-sequence: a ray-traced image sequence of the lab, in TUM layout, with exact ground truth.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "common/errors.h"
#include "sim/sequence.h"

using foresight::sim::Antialiasing;
using foresight::sim::SequenceParams;
using foresight::sim::Trajectory;

namespace {

struct Options {
  std::string folder;
  SequenceParams params;
  bool no_depth = false;
};

void declare(CLI::App& app, Options& o) {
  const std::map<std::string, Trajectory::Kind> trajectories = {
      {"desk", Trajectory::Kind::kDesk},
      {"rotation", Trajectory::Kind::kRotation},
      {"static", Trajectory::Kind::kStatic},
      {"return", Trajectory::Kind::kReturn}};
  const std::map<std::string, Antialiasing> antialiasing = {{"none", Antialiasing::kNone},
                                                            {"edges", Antialiasing::kEdges},
                                                            {"full", Antialiasing::kFull}};
  app.add_option("OUTPUT_FOLDER", o.folder, "made if missing; files in it are replaced")
      ->required();
  app.add_option("--seed", o.params.seed, "of lab, trajectory and noise")->capture_default_str();
  app.add_option("--seconds", o.params.duration_s, "length")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  app.add_option("--fps", o.params.rate_hz, "pictures per second")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--width", o.params.width_px, "pixels; the height is 3/4 of it")
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  app.add_option("--trajectory", o.params.trajectory, "desk, rotation, static or return")
      ->transform(CLI::CheckedTransformer(trajectories))
      ->default_str("desk");
  app.add_option("--noise", o.params.noise_levels, "standard deviation in 8-bit levels")
      ->check(CLI::Range(0.0, 64.0))
      ->capture_default_str();
  app.add_flag("--distortion", o.params.distorted, "a lens with barrel distortion");
  app.add_option("--shutter", o.params.shutter_s, "exposure time in seconds; > 0 blurs")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  app.add_option("--antialiasing", o.params.antialiasing, "none, edges or full")
      ->transform(CLI::CheckedTransformer(antialiasing))
      ->default_str("edges");
  app.add_option("--depth-every", o.params.depth_every, "frames between depth images")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_flag("--no-depth", o.no_depth, "no depth images");
  app.add_flag("--mesh", o.params.with_mesh, "write mesh_true.ply");
}

void show_progress(int64_t done, int64_t total) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (!terminal && done % 100 != 0 && done != total) return;
  std::fprintf(stderr, "%ssim-sequence: %lld of %lld frames%s", terminal ? "\r" : "",
               static_cast<long long>(done), static_cast<long long>(total),
               terminal && done != total ? "" : "\n");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Writes a ray-traced image sequence of a furnished lab with exact ground truth: "
      "rgb/, rgb.txt, groundtruth.txt, depth/, depth.txt, camera.yaml.",
      "sim-sequence");
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "sim-sequence: %s (see --help)\n", error.what());
    return foresight::kExitUsage;
  }
  if (options.no_depth) options.params.depth_every = 0;
  try {
    foresight::sim::write_sequence(options.folder, options.params, show_progress);
  } catch (const foresight::StartupError& error) {
    std::fprintf(stderr, "sim-sequence: %s\n", error.what());
    return error.code();
  }
  return foresight::kExitDone;
}
