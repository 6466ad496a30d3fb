// slam-map: saves, loads or forgets the map of a running slam.
#include <chrono>
#include <filesystem>
#include <map>

#include "common/live_host.h"
#include "common/node.h"
#include "common/tool_main.h"
#include "foresight/slam_command_t.hpp"

int main(int argc, char** argv) {
  using namespace foresight;
  const std::map<std::string, int> orders{{"save", int{slam_command_t::COMMAND_SAVE_MAP}},
                                          {"load", int{slam_command_t::COMMAND_LOAD_MAP}},
                                          {"reset", int{slam_command_t::COMMAND_RESET_MAP}}};
  std::string order, folder, url = default_url(Domain::kRobot);
  CLI::App app(
      "Orders to a running slam: save its map as a folder (a COLMAP text model with the keyframes' "
      "images, and what slam needs to go on with it), load such a folder, or start anew.",
      "slam-map");
  app.add_option("order", order, "save, load or reset")->required()->check(CLI::IsMember(&orders));
  app.add_option("folder", folder, "of the map; on the machine where slam runs");
  app.add_option("--robot-url", url, "LCM URL of the robot site");
  return tool_main(app, argc, argv, [&] {
    if (folder.empty() != (order == "reset")) {
      throw UsageError(order == "reset" ? "reset takes no folder" : order + " needs a folder");
    }
    LcmBus bus(url);
    slam_command_t message{};
    message.utime = std::chrono::duration_cast<std::chrono::microseconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
    message.command = static_cast<int8_t>(orders.at(order));
    if (!folder.empty()) {
      message.folder = std::filesystem::absolute(folder).lexically_normal().string();
    }
    bus.publish("SLAM_COMMAND", encode(message));
    return kExitDone;
  });
}
