// Random re-targets against limits, continuity and an independent search for the shortest motion.
// FORESIGHT_TRAPEZOID_CASES=10000000 runs more of them than the default.
#include "common/trapezoid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace foresight {
namespace {

constexpr double kTiny = 1e-9;

// The motion that pulls towards the velocity `side`·limit for `pull_s` and then brakes to rest.
struct PullThenBrake {
  double end = 0, duration_s = 0;
};
PullThenBrake pull_then_brake(const MotionState& start, double side, double pull_s,
                              const MotionLimits& limits) {
  const double wanted = side * limits.velocity;
  const double change_s = std::min(pull_s, std::abs(wanted - start.velocity) / limits.acceleration);
  const double push = std::copysign(limits.acceleration, wanted - start.velocity);
  const double velocity = start.velocity + push * change_s;
  const double brake_s = std::abs(velocity) / limits.acceleration;
  return {start.position + 0.5 * (start.velocity + velocity) * change_s +
              velocity * (pull_s - change_s) + 0.5 * velocity * brake_s,
          pull_s + brake_s};
}

// The shortest duration by bisection over how long to pull: where such a motion ends moves
// monotonically towards `side` with the length of the pull.
double search_duration_s(const MotionState& start, double target, const MotionLimits& limits) {
  const double side = target >= pull_then_brake(start, 1, 0, limits).end ? 1 : -1;
  double low = 0, high = 1;
  while (side * (target - pull_then_brake(start, side, high, limits).end) > 0) high *= 2;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    const bool is_short = side * (target - pull_then_brake(start, side, middle, limits).end) > 0;
    (is_short ? low : high) = middle;
  }
  return pull_then_brake(start, side, high, limits).duration_s;
}

void expect_sound(const Trapezoid& motion, const MotionState& start, double target,
                  const MotionLimits& limits, std::mt19937& random) {
  const double end_s = motion.duration_s();
  ASSERT_TRUE(std::isfinite(end_s) && end_s >= 0);
  const double top = std::max(limits.velocity, std::abs(start.velocity));
  const MotionState first = motion.at(0), last = motion.at(end_s);
  ASSERT_NEAR(first.position, start.position, kTiny);
  ASSERT_NEAR(first.velocity, start.velocity, kTiny);
  ASSERT_EQ(last.position, target);
  ASSERT_EQ(last.velocity, 0);
  ASSERT_EQ(motion.target(), target);
  std::uniform_real_distribution<double> when(0, end_s);
  MotionState before = first;
  double time_s = 0;
  for (int i = 1; i <= 24; ++i) {
    const double now_s = i < 24 ? std::max(time_s, when(random) * i / 24) : end_s;
    const MotionState now = motion.at(now_s);
    const double step_s = now_s - time_s;
    ASSERT_LE(std::abs(now.velocity), top + kTiny);
    ASSERT_LE(std::abs(now.acceleration), limits.acceleration + kTiny);
    ASSERT_LE(std::abs(now.velocity - before.velocity), limits.acceleration * step_s + kTiny);
    const double mean = 0.5 * (now.velocity + before.velocity);
    const double bend = 0.25 * limits.acceleration * step_s * step_s;
    ASSERT_LE(std::abs(now.position - before.position - mean * step_s), bend + kTiny);
    before = now;
    time_s = now_s;
  }
}

long case_count() {
  const char* wanted = std::getenv("FORESIGHT_TRAPEZOID_CASES");
  return wanted != nullptr ? std::atol(wanted) : 200'000;
}

TEST(Trapezoid, RandomRetargetsKeepEveryPromise) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double a, double b) { return a + (b - a) * unit(random); };
  Trapezoid motion;
  for (long i = 0; i < case_count(); ++i) {
    const MotionLimits limits{std::pow(10, between(-1, 1)), std::pow(10, between(-1, 1))};
    MotionState start = motion.at(between(0, 1.1) * motion.duration_s());
    if (i % 16 == 0) start = {between(-4, 4), between(-4, 4), 0};  // also above the limit
    double target = between(-4, 4);
    if (i % 32 == 1) target = start.position;
    if (i % 32 == 2)
      target =
          start.position + start.velocity * std::abs(start.velocity) / (2 * limits.acceleration);
    motion = Trapezoid::fit(start, target, limits);
    expect_sound(motion, start, target, limits, random);
    // Where braking at once ends at the target, the duration is as ill-conditioned as a square
    // root.
    const double off = target - pull_then_brake(start, 1, 0, limits).end;
    const double tolerance_s = std::abs(off) > 1e-6 ? 1e-8 : 1e-6;
    const double shortest_s = search_duration_s(start, target, limits);
    ASSERT_NEAR(motion.duration_s(), shortest_s, tolerance_s) << i;
    if (testing::Test::HasFatalFailure()) return;
  }
}

// As the controller uses it: the same limits all the time, 30 commands a second.
TEST(Trapezoid, ThousandsOfRefitsNeverExceedTheLimits) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> anywhere(-2, 2);
  const MotionLimits limits{1, 1};
  Trapezoid motion;
  MotionState state;
  for (int i = 0; i < 100'000; ++i) {
    motion = Trapezoid::fit(state, anywhere(random), limits);
    for (int step = 0; step < 16; ++step) {
      const MotionState next = motion.at(0.002 * (step + 1));
      ASSERT_LE(std::abs(next.velocity), 1 + kTiny);
      ASSERT_LE(std::abs(next.velocity - state.velocity), 0.002 + kTiny);
      state = next;
    }
  }
}

TEST(Trapezoid, RestToRestIsATriangleOrATrapezoid) {
  const Trapezoid triangle = Trapezoid::fit({0, 0, 0}, 0.25, {1, 1});
  EXPECT_NEAR(triangle.duration_s(), 1.0, kTiny);
  EXPECT_NEAR(triangle.at(0.5).velocity, 0.5, kTiny);
  const Trapezoid trapezoid = Trapezoid::fit({0, 0, 0}, -3, {1, 1});
  EXPECT_NEAR(trapezoid.duration_s(), 4.0, kTiny);
  EXPECT_NEAR(trapezoid.at(2).velocity, -1, kTiny);
  EXPECT_NEAR(trapezoid.at(2).position, -1.5, kTiny);
}

TEST(Trapezoid, ZeroLengthTakesNoTime) {
  const Trapezoid motion = Trapezoid::fit({0.7, 0, 0}, 0.7, {1, 1});
  EXPECT_EQ(motion.duration_s(), 0);
  EXPECT_EQ(motion.at(0).position, 0.7);
  EXPECT_EQ(motion.at(1).velocity, 0);
  EXPECT_EQ(Trapezoid().at(3).position, 0);
}

TEST(Trapezoid, ReversalBrakesThroughZeroWithoutAPause) {
  const Trapezoid motion = Trapezoid::fit({0, 1, 0}, -1, {1, 1});
  EXPECT_NEAR(motion.at(1).velocity, 0, kTiny);
  EXPECT_NEAR(motion.at(0.5).acceleration, -1, kTiny);
  EXPECT_NEAR(motion.at(1.5).acceleration, -1, kTiny);
}

TEST(Trapezoid, AboveTheVelocityLimitItBrakesToItFirst) {
  const Trapezoid motion = Trapezoid::fit({0, 2, 0}, 10, {1, 1});
  EXPECT_NEAR(motion.at(0.5).velocity, 1.5, kTiny);
  EXPECT_NEAR(motion.at(1).velocity, 1, kTiny);
  EXPECT_NEAR(motion.at(2).velocity, 1, kTiny);
  EXPECT_NEAR(motion.duration_s(), 1 + 8 + 1, kTiny);
}

TEST(Trapezoid, StopEndsWhereBrakingEnds) {
  const Trapezoid motion = Trapezoid::stop({1, -0.8, 0.5}, {1, 2});
  EXPECT_NEAR(motion.target(), 1 - 0.8 * 0.8 / 4, kTiny);
  EXPECT_NEAR(motion.duration_s(), 0.4, kTiny);
}

// Three cases in which the arm manufacturer's trapezoid breaks its own promises (it raises the
// acceleration to stop short, takes a backward velocity for none, and its moves begin at v = 0).
TEST(Trapezoid, ShorterThanTheBrakingDistanceItOvershootsAndReturns) {
  const Trapezoid motion = Trapezoid::fit({0, 1, 0}, 0.1, {1, 1});
  double furthest = 0;
  for (double t = 0; t < motion.duration_s(); t += 1e-3) {
    EXPECT_LE(std::abs(motion.at(t).acceleration), 1 + kTiny);  // stopping short would take 5
    furthest = std::max(furthest, motion.at(t).position);
  }
  EXPECT_NEAR(furthest, 0.5, 1e-6);
  EXPECT_EQ(motion.at(motion.duration_s()).position, 0.1);
}

TEST(Trapezoid, ABackwardVelocityIsBrakedNotForgotten) {
  const Trapezoid motion = Trapezoid::fit({0, -0.5, 0}, 0.5, {1, 1});
  EXPECT_NEAR(motion.at(0).velocity, -0.5, kTiny);
  EXPECT_NEAR(motion.at(0.5).position, -0.125, kTiny);
  EXPECT_NEAR(motion.at(0.5).velocity, 0, kTiny);
}

TEST(Trapezoid, ARefitInMotionGoesOnWithItsVelocity) {
  const MotionLimits limits{1, 1};
  const MotionState moving = Trapezoid::fit({0, 0, 0}, 2, limits).at(0.7);
  const Trapezoid refit = Trapezoid::fit(moving, 2.5, limits);
  EXPECT_NEAR(refit.at(0).velocity, 0.7, kTiny);
  EXPECT_NEAR(refit.at(0.1).velocity, 0.8, kTiny);
}

}  // namespace
}  // namespace foresight
