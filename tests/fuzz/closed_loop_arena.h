// The complete system as an arena: small slow pictures, a base that stands still. Everything is as
// it should be when the map is aligned and the predicted camera is where the truth will be.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/swarm/closed_loop.h"
#include "tests/fuzz/attack.h"

namespace foresight::fuzz {

class ClosedLoopArena : public Arena {
 public:
  ClosedLoopArena();
  Simulation& world() override { return loop_.world(); }
  std::vector<std::string> processes() const override { return ClosedLoop::processes(); }
  void run_for(double seconds) override;
  double warm_up_s() const override { return 16; }
  void on_message(Domain domain, const std::string& channel,
                  std::span<const uint8_t> bytes) override;
  void begin_judging() override { pictures_.clear(); }
  std::string find_fault() override;

 private:
  struct Picture {
    Time instant;  // that was predicted
    Eigen::Vector3d camera_in_world;
  };
  void learn_beliefs(const std::string& channel, std::span<const uint8_t> bytes);
  std::string beliefs() const;

  ClosedLoop loop_;
  std::vector<Picture> pictures_;
  std::map<std::string, std::string> beliefs_;  // at the robot's site, for who looks for the fault
  std::vector<double> true_joints_rad_;
  std::map<Time, Eigen::Vector3d> truth_;  // the camera, in the last seconds
  bool is_aligned_ = false;
};

}  // namespace foresight::fuzz
