// Carver, mesher and calibrator as an arena, fed by a simulated robot whose camera sees a cloud of
// points: no pictures, so that 10^5 messages are thrown within seconds. Beside it runs a twin that
// nobody attacks: alignment, base and surface must end up as the twin's.
#pragma once

#include <memory>

#include "tests/fuzz/attack.h"

namespace foresight::fuzz {

class RobotLine : public Arena {
 public:
  RobotLine();
  ~RobotLine() override;
  Simulation& world() override;
  std::vector<std::string> processes() const override { return {"carver", "mesher", "calibrator"}; }
  void run_for(double seconds) override;
  double warm_up_s() const override { return 14; }
  void on_message(Domain domain, const std::string& channel,
                  std::span<const uint8_t> bytes) override;
  void begin_judging() override;
  std::string find_fault() override;

 private:
  class Line;
  std::unique_ptr<Line> attacked_, twin_;
};

}  // namespace foresight::fuzz
