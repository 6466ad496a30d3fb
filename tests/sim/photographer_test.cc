// Pictures that take longer than they should: the world waits for them, or loses frames.
#include "sim/robot/photographer.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "tests/sim/test_arms.h"

namespace foresight::sim {
namespace {

// A host whose worker is done when the test says so.
class SlowHost : public Host {
 public:
  Time now() const override { return {1'000'000}; }
  bool is_simulated() const override { return false; }
  void publish(Domain, const std::string& channel, std::span<const uint8_t>) override {
    ++published_[channel];
  }
  void subscribe(Domain, const std::string&, Queue, int64_t*, Handler) override {}
  void call_every(Duration, std::function<void()>) override {}
  void call_at(Time, std::function<void()>) override {}
  void run_job(Job job, Duration) override { result_ = job(); }
  void stop(int) override {}

  void finish_job() { std::exchange(result_, nullptr)(); }
  int count(const std::string& channel) { return published_[channel]; }

 private:
  std::function<void()> result_;
  std::map<std::string, int> published_;
};

class PhotographerTest : public testing::Test {
 protected:
  PhotographerTest() {
    RayCameraParams camera;
    camera.model = {.width_px = 16, .height_px = 12, .fx_px = 16, .fy_px = 16};
    rig_ = std::make_shared<CameraRig>(open_scene(SimParams{}), CameraRigParams{.camera = camera});
    photographer_.start(rig_, robot_.now(), [this] { ++done_; });
  }
  static SimParams params() {
    SimParams params;
    params.camera_rate_hz = 50;
    params.camera_latency_s = 0.03;
    return params;
  }
  void run(Duration duration) {
    for (Duration t; t < duration; t = t + kTick) {
      robot_.tick();
      photographer_.on_tick(robot_);
    }
  }
  SlowHost host_;
  Node node_{"camera", host_, {}};
  Robot robot_{load_arm("wam4"), {}, Time{0}};
  Photographer photographer_{node_, params()};
  std::shared_ptr<CameraRig> rig_;
  int done_ = 0;
};

TEST_F(PhotographerTest, LosesFramesWhileOneIsBeingRendered) {
  run(milliseconds(60));  // exposed at 20, 40, 60 ms
  EXPECT_EQ(photographer_.skipped(), 2);
  EXPECT_EQ(host_.count("IMAGE"), 0);
  host_.finish_job();
  EXPECT_EQ(done_, 1);
  run(milliseconds(2));
  EXPECT_EQ(host_.count("IMAGE"), 1);
  EXPECT_EQ(host_.count("TRUTH_FRAME"), 1) << "lost frames have no truth";
  EXPECT_EQ(photographer_.published(), 1);
}

TEST_F(PhotographerTest, IsLateWhenTheRendererIsNotFreeForTheNextFrame) {
  run(milliseconds(20));
  EXPECT_FALSE(photographer_.is_late_for(robot_.now() + kTick));
  run(milliseconds(18));
  EXPECT_TRUE(photographer_.is_late_for(robot_.now() + kTick)) << "the next is due at 40 ms";
  host_.finish_job();
  EXPECT_FALSE(photographer_.is_late_for(robot_.now() + kTick));
}

TEST_F(PhotographerTest, PublishesNoSoonerThanItsLatency) {
  run(milliseconds(20));
  host_.finish_job();
  run(milliseconds(18));
  EXPECT_EQ(host_.count("IMAGE"), 0);
  run(milliseconds(12));
  EXPECT_EQ(host_.count("IMAGE"), 1);
}

}  // namespace
}  // namespace foresight::sim
