// The whole swarm in one thread on a simulated clock, on a sequence that sim renders from a seed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>

#include "bench/evaluate/image_scores.h"
#include "bench/evaluate/recorded_line_scorer.h"
#include "common/message_bytes.h"
#include "foresight/carving_delta_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/health_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "sim/sequence.h"
#include "sim/swarm/recorded_line.h"
#include "tests/swarm/traffic.h"

namespace foresight {
namespace {

constexpr double kSequence_s = 8;

// Rendered once for all tests.
const std::string& sequence() {
  static const std::string folder = [] {
    const auto path =
        std::filesystem::temp_directory_path() / ("foresight-swarm-" + std::to_string(getpid()));
    sim::SequenceParams params;
    params.duration_s = kSequence_s;
    params.rate_hz = 20;
    params.width_px = 320;
    params.depth_every = 0;
    sim::write_sequence(path.string(), params, [](int64_t, int64_t) {});
    return path.string();
  }();
  return folder;
}

class SwarmEnvironment : public testing::Environment {
 public:
  void TearDown() override { std::filesystem::remove_all(sequence()); }
};
const auto* const kEnvironment = testing::AddGlobalTestEnvironment(new SwarmEnvironment);

TEST(Swarm, SameInputsGiveTheSameTraffic) {
  const RecordedLineOptions options{.sequence = sequence(), .delay_s = 0.3, .frame_count = 80};
  RecordedLine first(options);
  const Traffic a = run_all(first);
  RecordedLine second(options);
  const Traffic b = run_all(second);
  EXPECT_EQ(a.counts, b.counts);
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_EQ(a.counts.at("IMAGE"), 80);
  EXPECT_EQ(a.counts.at("CAMERA_POSE"), 80);
  EXPECT_GT(a.counts.at("MESH"), 0);
}

TEST(Swarm, PredictedViewBeatsTheDelayedVideo) {
  const EvaluationResult r =
      evaluate({.sequence = sequence(), .delay_s = 0.3}, {.every = 5}, [](int, int) {});
  ASSERT_GT(r.scored_frames, 10);
  EXPECT_GT(r.predicted.mean_psnr_common_db(), r.delayed.mean_psnr_common_db() + 4);
  EXPECT_LT(percentile(r.predicted.displacement_px, 0.5), 2.5);
  EXPECT_GT(r.coverage, 0.85);
}

TEST(Swarm, ProcessesReportThemselvesOnce) {
  RecordedLine line({.sequence = sequence(), .delay_s = 0.1, .frame_count = 60});
  std::map<std::string, int> reports;
  line.world().listen(Domain::kRobot, "HEALTH",
                      [&](auto bytes) { ++reports[decode<health_t>(bytes).process]; });
  run_all(line);
  for (const char* name : {"camera", "slam", "carver", "mesher", "link"}) {
    EXPECT_GT(reports[name], 1) << name;
  }
  EXPECT_EQ(reports.count("renderer"), 0u) << "the operator's side is another domain";
}

// What still flows after an incident, and whether the picture on the screen is of the newest map.
struct Aftermath {
  int carvings = 0, meshes = 0, predictions = 0;
  int64_t map_epoch = 0, carving_epoch = 0, mesh_epoch = 0, shown_epoch = 0;
};

void watch(RecordedLine& line, Time since, Aftermath* after) {
  Simulation& world = line.world();
  world.listen(Domain::kRobot, "MAP_DELTA",
               [after](auto bytes) { after->map_epoch = decode<map_delta_t>(bytes).header.epoch; });
  world.listen(Domain::kRobot, "CARVING_DELTA", [=, &world](auto bytes) {
    if (world.now() < since) return;
    ++after->carvings;
    after->carving_epoch = decode<carving_delta_t>(bytes).header.epoch;
  });
  world.listen(Domain::kOperator, "MESH", [=, &world](auto bytes) {
    if (world.now() < since) return;
    ++after->meshes;
    after->mesh_epoch = decode<mesh_t>(bytes).epoch;
  });
  world.listen(Domain::kOperator, "DISPLAY_STATS", [=, &world](auto bytes) {
    if (world.now() < since) return;
    const auto stats = decode<display_stats_t>(bytes);
    after->shown_epoch = stats.epoch;
    if (stats.epoch != 0) ++after->predictions;
  });
}

class Killed : public testing::TestWithParam<const char*> {};

TEST_P(Killed, IsReplacedAndTheOthersGoOn) {
  RecordedLine line({.sequence = sequence(), .delay_s = 0.2});
  const Time start = line.world().now();
  Aftermath after;
  watch(line, start + seconds(4.5), &after);
  while (line.world().now() < start + seconds(4)) ASSERT_TRUE(line.step());
  line.restart(GetParam());
  run_all(line);
  EXPECT_GT(after.carvings, 0);
  EXPECT_GT(after.meshes, 0);
  EXPECT_GT(after.predictions, 10);
  EXPECT_NE(after.map_epoch, 0);
  EXPECT_EQ(after.carving_epoch, after.map_epoch);
  EXPECT_EQ(after.mesh_epoch, after.map_epoch);
  EXPECT_EQ(after.shown_epoch, after.map_epoch);
}

// (A camera that starts its recording again is a jump in the scene, which slam answers by
// relocalising or not: tests/system has that case, on a longer sequence.)
INSTANTIATE_TEST_SUITE_P(Processes, Killed,
                         testing::Values("slam", "carver", "mesher", "link", "renderer"),
                         [](const auto& param_info) { return std::string(param_info.param); });

TEST(Swarm, AllFollowANewMap) {
  RecordedLine line({.sequence = sequence(), .delay_s = 0.2});
  const Time start = line.world().now();
  Aftermath before, after;
  watch(line, start, &before);
  while (line.world().now() < start + seconds(3.5)) ASSERT_TRUE(line.step());
  ASSERT_NE(before.map_epoch, 0);
  const int64_t old_epoch = before.map_epoch;
  watch(line, start + seconds(4), &after);
  slam_command_t reset{};
  reset.utime = line.world().now().us;
  reset.command = slam_command_t::COMMAND_RESET_MAP;
  line.world().inject(line.world().now(), Domain::kOperator, "SLAM_COMMAND", encode(reset));
  run_all(line);
  EXPECT_NE(after.map_epoch, old_epoch);
  EXPECT_EQ(after.carving_epoch, after.map_epoch);
  EXPECT_EQ(after.mesh_epoch, after.map_epoch);
  EXPECT_EQ(after.shown_epoch, after.map_epoch);
}

TEST(Swarm, TheCarverSaysWhatItForgets) {
  const auto last_health = [](const std::string& limit_mb) {
    RecordedLine line({.sequence = sequence(),
                       .delay_s = 0.1,
                       .frame_count = 60,
                       .settings = {"carver.memory_limit_mb=" + limit_mb}});
    health_t last{};
    line.world().listen(Domain::kRobot, "HEALTH", [&](auto bytes) {
      const auto health = decode<health_t>(bytes);
      if (health.process == "carver") last = health;
    });
    run_all(line);
    return last;
  };
  const health_t free = last_health("0");
  EXPECT_TRUE(free.state == health_t::STATE_OK);
  EXPECT_EQ(free.reason, "");
  const auto memory = std::find(free.metric_names.begin(), free.metric_names.end(), "memory_mb");
  ASSERT_NE(memory, free.metric_names.end());
  const double needed_mb =
      free.metric_values[static_cast<size_t>(memory - free.metric_names.begin())];
  const health_t enough = last_health(std::to_string(0.8 * needed_mb));
  EXPECT_TRUE(enough.state == health_t::STATE_DEGRADED);
  EXPECT_NE(enough.reason.find("oldest constraints were forgotten"), std::string::npos)
      << enough.reason;
  const health_t tight = last_health("0.001");
  EXPECT_TRUE(tight.state == health_t::STATE_DEGRADED);
  EXPECT_NE(tight.reason.find("memory limit of 0.001 MB"), std::string::npos) << tight.reason;
}

TEST(Swarm, HostileBytesAreCountedAndHarmless) {
  RecordedLine line({.sequence = sequence(), .delay_s = 0.1, .frame_count = 60});
  const Time start = line.world().now();
  int64_t rejected = 0;
  line.world().listen(Domain::kRobot, "HEALTH", [&](auto bytes) {
    const auto health = decode<health_t>(bytes);
    if (health.process != "carver") return;
    for (const port_health_t& p : health.ports) rejected = std::max(rejected, p.rejected);
  });
  for (int i = 0; i < 50; ++i) {
    std::vector<uint8_t> bytes(static_cast<size_t>(i * 7), static_cast<uint8_t>(i * 37));
    for (const char* channel : {"MAP_DELTA", "CARVING_DELTA", "IMAGE", "CAMERA_INFO"}) {
      line.world().inject(start + milliseconds(20 * i), Domain::kRobot, channel, bytes);
    }
    line.world().inject(start + milliseconds(20 * i), Domain::kOperator, "MESH", bytes);
  }
  const Traffic traffic = run_all(line);
  EXPECT_EQ(rejected, 50);
  EXPECT_EQ(traffic.counts.at("CAMERA_POSE"), 60);
}

}  // namespace
}  // namespace foresight
