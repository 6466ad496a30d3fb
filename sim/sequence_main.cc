// sim-sequence: a ray-traced image sequence of the lab or of a scene file, in TUM layout, with
// exact ground truth.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "common/tool_main.h"
#include "sim/sequence.h"

using foresight::sim::Antialiasing;
using foresight::sim::SequenceParams;
using foresight::sim::Trajectory;

namespace {

const std::map<std::string, Trajectory::Kind> kTrajectories = {
    {"desk", Trajectory::Kind::kDesk},     {"rotation", Trajectory::Kind::kRotation},
    {"static", Trajectory::Kind::kStatic}, {"return", Trajectory::Kind::kReturn},
    {"loop", Trajectory::Kind::kLoop},     {"wander", Trajectory::Kind::kWander}};
const std::vector<std::string> kFollowFrom = {"world", "start"};
const std::map<std::string, Antialiasing> kAntialiasing = {
    {"none", Antialiasing::kNone}, {"edges", Antialiasing::kEdges}, {"full", Antialiasing::kFull}};

struct Options {
  std::string folder;
  SequenceParams params;
  std::string trajectory = "desk", antialiasing = "edges";
  std::string followed_file, follow_from = "world";
  std::optional<double> seconds;
  double scatter_deg = 0;
  bool no_depth = false;

  SequenceParams parsed() const {
    SequenceParams result = params;
    if (seconds) result.duration_s = *seconds;
    if (!followed_file.empty()) follow(result);
    result.scatter.turn_rad = scatter_deg * std::numbers::pi / 180;
    result.trajectory = kTrajectories.at(trajectory);
    result.antialiasing = kAntialiasing.at(antialiasing);
    if (no_depth) result.depth_every = 0;
    return result;
  }

  // As long as the file unless asked for less.
  void follow(SequenceParams& result) const {
    result.followed = foresight::load_pose_track(followed_file);
    if (follow_from == "start") {
      result.followed = foresight::sim::moved_to_start(std::move(result.followed), params.seed);
    }
    if (!seconds) result.duration_s = std::numeric_limits<double>::infinity();
  }
};

// A number within limits; unlike CLI::Range it refuses NaN.
CLI::Validator within(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& text) {
        double value = 0;
        const char* end = text.data() + text.size();
        const auto [read_to, error] = std::from_chars(text.data(), end, value);
        const bool good = error == std::errc() && read_to == end && value >= low && value <= high;
        return good ? std::string()
                    : text + " is not in [" + CLI::detail::to_string(low) + ", " +
                          CLI::detail::to_string(high) + "]";
      },
      "NUMBER");
}

void declare_path(CLI::App& app, Options& o) {
  auto* trajectory = app.add_option("--trajectory", o.trajectory, "how the camera moves")
                         ->check(CLI::IsMember(&kTrajectories))
                         ->capture_default_str();
  auto* follow = app.add_option("--follow", o.followed_file,
                                "goes as this file says (time tx ty tz qx qy qz qw per line, s and "
                                "m, camera to world), such as another run's groundtruth.txt")
                     ->excludes(trajectory);
  app.add_option("--follow-from", o.follow_from,
                 "world: the file's poses as they are; start: all moved together so that the first "
                 "is where the trajectory desk starts")
      ->check(CLI::IsMember(&kFollowFrom))
      ->needs(follow)
      ->capture_default_str();
  app.add_option("--scatter-m", o.params.scatter.distance_m,
                 "metres by which each picture's place is off the path at most, at random")
      ->check(within(0.0, 10.0))
      ->capture_default_str();
  app.add_option("--scatter-deg", o.scatter_deg,
                 "degrees by which each picture is turned at most, about any axis")
      ->check(within(0.0, 180.0))
      ->capture_default_str();
}

void declare(CLI::App& app, Options& o) {
  app.add_option("OUTPUT_FOLDER", o.folder, "made if missing; files in it are replaced")
      ->required();
  app.add_option("--seed", o.params.seed, "of lab, trajectory and noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--scene", o.params.scene_file,
                 "an .obj, .gltf or .glb file instead of the lab; put where an arm fits");
  app.add_option("--seconds", o.seconds, "length, at most that of a followed file")
      ->check(within(0.01, 3600.0))
      ->default_str("20, or a followed file's");
  app.add_option("--fps", o.params.rate_hz, "pictures per second")
      ->check(within(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--width", o.params.width_px, "pixels; the height is 3/4 of it")
      ->check(within(64, 4096))
      ->capture_default_str();
  app.add_option("--noise", o.params.noise_levels, "standard deviation in 8-bit levels")
      ->check(within(0.0, 64.0))
      ->capture_default_str();
  app.add_flag("--distortion", o.params.distorted, "a lens with barrel distortion");
  app.add_option("--shutter", o.params.shutter_s, "exposure time in seconds; > 0 blurs")
      ->check(within(0.0, 0.1))
      ->capture_default_str();
  app.add_option("--antialiasing", o.antialiasing, "where pixels get four rays instead of one")
      ->check(CLI::IsMember(&kAntialiasing))
      ->capture_default_str();
  app.add_option("--depth-every", o.params.depth_every, "frames between depth images")
      ->check(within(1, 1000000))
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
  declare_path(app, options);
  return foresight::tool_main(app, argc, argv, [&] {
    for (const std::string& warning :
         foresight::sim::write_sequence(options.folder, options.parsed(), show_progress)) {
      std::fprintf(stderr, "sim-sequence: %s\n", warning.c_str());
    }
    return foresight::kExitDone;
  });
}
