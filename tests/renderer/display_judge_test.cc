#include "procs/renderer/display_judge.h"

#include <gtest/gtest.h>

namespace foresight {
namespace {

constexpr Time kStart{1'000'000'000};

// A display to which all comes, and that is judged every second.
class Display {
 public:
  Display() {
    facts_.has_video = facts_.has_prediction = true;
    facts_.redraw_after = milliseconds(200);
    facts_.streams = {{"VIEW", {}, seconds(1)}, {"JOINT_STATE", {}, seconds(1)}};
  }
  // Up to a second's end, with messages at 30 and 100 Hz.
  DisplayVerdict run(double for_s, bool view = true, bool joints = true, bool draws = true) {
    const Time end = now_ + seconds(for_s);
    DisplayVerdict verdict;
    for (int i = 1; now_ < end; ++i) {
      now_ = now_ + milliseconds(10);
      if (view && i % 3 == 0) facts_.streams[0].watch.arrive(now_);
      if (joints) facts_.streams[1].watch.arrive(now_);
      if (draws && i % 3 == 0) ++facts_.pictures;
      if (i % 100 == 0) verdict = judge();
    }
    return verdict;
  }
  DisplayVerdict judge() {
    facts_.now = now_;
    return judge_.judge(facts_);
  }
  Time now_ = kStart;
  DisplayFacts facts_;
  DisplayJudge judge_;
};

TEST(DisplayJudge, IsOkWhileAllComes) {
  Display display;
  const DisplayVerdict verdict = display.run(10);
  EXPECT_EQ(verdict.state, DisplayState::kOk);
  EXPECT_EQ(verdict.reason, "");
}

TEST(DisplayJudge, WaitsBeforeThereIsAnything) {
  DisplayJudge judge;
  EXPECT_EQ(judge.judge({.now = kStart}).state, DisplayState::kWaiting);
  EXPECT_EQ(judge.judge({.now = kStart}).reason, "no video yet");
  DisplayFacts facts{.now = kStart + seconds(1), .pictures = 3, .has_video = true};
  facts.prediction_reason = "no BASE_POSE yet";
  EXPECT_EQ(judge.judge(facts).state, DisplayState::kWaiting);
  EXPECT_EQ(judge.judge(facts).reason, "no prediction yet: no BASE_POSE yet");
}

TEST(DisplayJudge, SilentStreamsAreSaidWithTheirAge) {
  Display display;
  display.run(10);
  EXPECT_EQ(display.run(1, false).state, DisplayState::kOk) << "a second is nothing to speak of";
  const DisplayVerdict verdict = display.run(4, false);
  EXPECT_EQ(verdict.state, DisplayState::kDegraded);
  EXPECT_EQ(verdict.reason, "no VIEW for 5.0 s");
  EXPECT_EQ(display.run(2).state, DisplayState::kOk) << "it comes again";
}

TEST(DisplayJudge, ASlowStreamIsGivenItsInterval) {
  StreamWatch watch;
  for (int i = 0; i < 20; ++i) watch.arrive(kStart + seconds(5) * i);
  const Time last = kStart + seconds(5) * 19;
  EXPECT_FALSE(watch.is_silent(last + seconds(5.9), seconds(1)));
  EXPECT_TRUE(watch.is_silent(last + seconds(6.1), seconds(1)));
  EXPECT_FALSE(StreamWatch().is_silent(last, seconds(1))) << "never came: nothing has ended";
}

TEST(DisplayJudge, AFrozenDisplayIsNotOk) {
  Display display;
  display.run(10);
  EXPECT_EQ(display.run(3, true, true, false).reason, "nothing drawn for 3.0 s");
  display.facts_.stood_still = seconds(4.2);
  ++display.facts_.pictures;
  EXPECT_EQ(display.judge().reason, "the display stood still for 4.2 s");
}

TEST(DisplayJudge, ADelayThatDoublesIsSaid) {
  Display display;
  display.facts_.normal_delay = milliseconds(300);
  display.facts_.delay = milliseconds(590);
  EXPECT_EQ(display.run(1).state, DisplayState::kOk);
  display.facts_.delay = milliseconds(620);
  EXPECT_EQ(display.run(1).reason, "delay 0.62 s instead of 0.30 s");
  display.facts_.normal_delay = milliseconds(10);
  display.facts_.delay = milliseconds(40);
  EXPECT_EQ(display.run(1).state, DisplayState::kOk) << "nobody notices 30 ms";
}

TEST(DelayWatch, TheRecentNormalIsTheMedianOfTheLastMinute) {
  DelayWatch delay;
  const auto pass = [&](int seconds, Duration d) {
    for (int i = 0; i < seconds; ++i) {
      for (int k = 0; k < 30; ++k) delay.measure(d + milliseconds(k == 7 ? 900 : 0));
      delay.end_second();
    }
  };
  pass(5, milliseconds(300));
  EXPECT_FALSE(delay.normal()) << "too little is known";
  pass(20, milliseconds(300));
  pass(1, milliseconds(620));
  EXPECT_EQ(delay.current(), milliseconds(620));
  EXPECT_EQ(delay.normal(), milliseconds(300));
  pass(90, milliseconds(620));
  EXPECT_EQ(delay.normal(), milliseconds(620)) << "it has become normal";
  delay.end_second();
  EXPECT_FALSE(delay.current()) << "nothing was measured";
}

// As many forged messages as genuine ones, for a minute: what was normal is not forgotten.
TEST(DelayWatch, LearnsNothingFromWhatContradictsItselfOrIsFromTheFuture) {
  DelayWatch delay;
  const auto pass = [&](int seconds, std::initializer_list<int> delays_ms) {
    for (int i = 0; i < seconds; ++i) {
      for (int k = 0; k < 10; ++k) {
        for (const int ms : delays_ms) delay.measure(milliseconds(ms));
      }
      delay.end_second();
    }
  };
  pass(20, {300});
  pass(90, {300, -500, 20, 5000});
  EXPECT_EQ(delay.normal(), milliseconds(300));
  pass(90, {-300, -310});
  EXPECT_EQ(delay.normal(), milliseconds(300));
  pass(90, {500, 600, 650});
  EXPECT_EQ(delay.normal(), milliseconds(600)) << "jitter is none";
}

TEST(LatencyJump, IsOneUntilItIsUsualOrOver) {
  LatencyJump latency;
  auto pass = [&, now = kStart](int count, Duration d) mutable {
    for (int i = 0; i < count; ++i) latency.add(now = now + milliseconds(10), d);
  };
  pass(100, milliseconds(150));
  EXPECT_FALSE(latency.jump());
  pass(1, milliseconds(3150));
  EXPECT_EQ(latency.jump(), seconds(3));
  pass(1, milliseconds(150));
  EXPECT_FALSE(latency.jump()) << "over";
  pass(300, milliseconds(3150));
  EXPECT_TRUE(latency.jump());
  pass(200, milliseconds(3150));
  EXPECT_FALSE(latency.jump()) << "usual";
}

// One complaint used to overwrite another.
TEST(DisplayJudge, AllReasonsStandInOneLineWorstFirst) {
  Display display;
  display.run(10);
  display.facts_.recording = "recording stopped";
  display.facts_.commanders = "2 senders command the arm at once";
  display.facts_.clocks = "the robot's clock is 300 ms ahead";
  display.facts_.note = "limits are followed";
  display.facts_.has_prediction = false;
  display.facts_.prediction_reason = "no JOINT_STATE for 4.0 s";
  const DisplayVerdict verdict = display.run(4, true, false);
  EXPECT_EQ(verdict.state, DisplayState::kDegraded);
  EXPECT_EQ(verdict.reason,
            "the robot's clock is 300 ms ahead; no prediction: no JOINT_STATE for 4.0 s; "
            "2 senders command the arm at once; recording stopped; limits are followed");
}

TEST(DisplayJudge, ANoteAloneDegradesNothing) {
  Display display;
  display.facts_.note = "limits are followed";
  const DisplayVerdict verdict = display.run(1);
  EXPECT_EQ(verdict.state, DisplayState::kOk);
  EXPECT_EQ(verdict.reason, "limits are followed");
}

TEST(DisplayJudge, ALostPredictionIsWorseThanNoneYet) {
  DisplayJudge judge;
  DisplayFacts facts{.now = kStart, .pictures = 1, .has_video = true, .has_prediction = true};
  EXPECT_EQ(judge.judge(facts).state, DisplayState::kOk);
  facts.has_prediction = false;
  facts.prediction_reason = "lost";
  EXPECT_EQ(judge.judge(facts).state, DisplayState::kDegraded);
  EXPECT_EQ(judge.judge(facts).reason, "no prediction: lost");
}

}  // namespace
}  // namespace foresight
