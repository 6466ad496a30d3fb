// sim-pendant: presses a button of the simulated arm's pendant, as a person would.
#include <chrono>
#include <map>

#include "common/live_host.h"
#include "common/node.h"
#include "common/tool_main.h"
#include "foresight/pendant_t.hpp"

int main(int argc, char** argv) {
  using namespace foresight;
  const std::map<std::string, int> buttons{{"estop", int{pendant_t::BUTTON_ESTOP}},
                                           {"idle", int{pendant_t::BUTTON_IDLE}},
                                           {"activate", int{pendant_t::BUTTON_ACTIVATE}}};
  std::string button, url = default_url(Domain::kRobot);
  CLI::App app(
      "Presses a button of the simulated arm's pendant. After a fault: idle (which resets an "
      "E-STOP), then activate.",
      "sim-pendant");
  app.add_option("button", button, "estop, idle or activate")
      ->required()
      ->check(CLI::IsMember({"estop", "idle", "activate"}));
  app.add_option("--robot-url", url, "LCM URL of the robot site");
  return tool_main(app, argc, argv, [&] {
    LcmBus bus(url);
    pendant_t message{};
    message.utime = std::chrono::duration_cast<std::chrono::microseconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
    message.button = static_cast<int8_t>(buttons.at(button));
    bus.publish("PENDANT", encode(message));
    return kExitDone;
  });
}
