// What the arm's controller costs: profile re-fits, dynamics, whole control steps; and, as the unit
// to compare with, the forward kinematics of the same arm in the same run.
//
//   scripts/run controller-bench --arm deploy/arms/wam4.yaml
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "common/errors.h"
#include "common/tool_main.h"
#include "common/trapezoid.h"
#include "procs/wam_controller/arm_controller.h"
#include "procs/wam_controller/puck_codec.h"

namespace foresight {
namespace {

volatile double g_sink = 0;  // keeps results alive

// Median over rounds of the time per call.
double measure_ns(int count, const std::function<double(int)>& call) {
  constexpr int kRounds = 9;
  std::array<double, kRounds> rounds_ns{};
  for (double& round : rounds_ns) {
    double sum = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < count; ++i) sum += call(i);
    const auto end = std::chrono::steady_clock::now();
    g_sink = g_sink + sum;
    round = std::chrono::duration<double, std::nano>(end - begin).count() / count;
  }
  std::sort(rounds_ns.begin(), rounds_ns.end());
  return rounds_ns[kRounds / 2];
}

void row(const char* what, double ns, double unit_ns) {
  std::printf("%-44s %9.1f ns   %6.3f\n", what, ns, ns / unit_ns);
}

class Bench {
 public:
  Bench(const ArmModel& arm, int count) : arm_(arm), count_(count), controller_(arm, {}) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-1.5, 1.5);
    for (int i = 0; i < 1024; ++i) {
      targets_.push_back(JointVector::NullaryExpr(arm.size(), [&] { return any(random); }));
    }
    reading_ = {Time{1'000'000}, arm.home(), Safety::kActive, false, {}};
    command_ = {reading_.time, 1, 0, true, arm.home()};
  }

  void print() {
    const double unit_ns =
        measure_ns(count_, [&](int i) { return arm_.base_from_ee(target(i)).translation().x(); });
    std::printf("%-44s %12s   %6s\n", arm_.name.c_str(), "per call", "ratio");
    row("forward kinematics (the unit)", unit_ns, unit_ns);
    row("trapezoid: re-fit and evaluate, one joint", refit_ns(), unit_ns);
    row("reference: re-fit and evaluate, all joints", reference_ns(), unit_ns);
    row("dynamics: torques of a motion", dynamics_ns(), unit_ns);
    row("CAN: two torque frames packed", packing_ns(), unit_ns);
    row("control step", step_ns(1 << 30), unit_ns);
    row("control step with a command in each", step_ns(1), unit_ns);
  }

 private:
  const JointVector& target(int i) const { return targets_[static_cast<size_t>(i) & 1023]; }

  double refit_ns() const {
    MotionState state;
    return measure_ns(10 * count_, [&](int i) {
      state = Trapezoid::fit(state, target(i)[0], {1, 1}).at(0.033);
      return state.position;
    });
  }
  double reference_ns() const {
    JointReference reference({1, 1});
    Time now{0};
    reference.rest(now, arm_.home());
    return measure_ns(count_, [&](int i) {
      now = now + milliseconds(33);
      reference.follow(now, target(i));
      return reference.at(now + milliseconds(2)).position_rad[0];
    });
  }
  double dynamics_ns() const {
    const ArmDynamics dynamics(arm_, {0, 0, -9.81});
    return measure_ns(count_, [&](int i) {
      return dynamics.torque_nm(target(i), target(i + 1), target(i + 2))[0];
    });
  }
  double packing_ns() const {
    return measure_ns(count_, [&](int i) {
      const std::array<int32_t, 4> torques{i, -i, 2 * i, -2 * i};
      return torque_frame(kGroupLowerTorques, torques).data[3] +
             torque_frame(kGroupUpperTorques, torques).data[5];
    });
  }
  // An engage that counts begins with a button that is not pressed.
  void let_go() {
    reading_.time = command_.time = reading_.time + milliseconds(2);
    (void)controller_.step(reading_);
    command_.is_engaged = false;
    ++command_.seq;
    (void)controller_.on_command(reading_.time, command_);
    command_.is_engaged = true;
  }
  // The arm stands where the reference is, so that it goes on following.
  double step_ns(int steps_per_command) {
    let_go();
    return measure_ns(count_, [&](int i) {
      reading_.time = reading_.time + milliseconds(2);
      if (i % steps_per_command == 0) {
        command_.time = reading_.time;
        ++command_.seq;
        command_.position_rad = target(i);
        if (controller_.on_command(reading_.time, command_) != CommandVerdict::kAccepted) return 0.;
      }
      const double torque = controller_.step(reading_)[0];
      reading_.position_rad = controller_.snapshot().reference_rad;
      return torque;
    });
  }

  ArmModel arm_;
  int count_;
  ArmController controller_;
  ArmReading reading_;
  JointCommand command_;
  std::vector<JointVector> targets_;
};

int run(int argc, char** argv) {
  std::vector<std::string> arms{"deploy/arms/wam4.yaml", "deploy/arms/wam7.yaml"};
  int count = 100'000;
  CLI::App app("Times the arm controller's core.", "controller-bench");
  app.add_option("--arm", arms, "description files of arms")->capture_default_str();
  app.add_option("--count", count, "calls per round, of which there are nine")
      ->check(CLI::Range(100, 10'000'000))
      ->capture_default_str();
  return tool_main(app, argc, argv, [&] {
    for (const std::string& path : arms) Bench(load_arm_file(path), count).print();
    return kExitDone;
  });
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) { return foresight::run(argc, argv); }
