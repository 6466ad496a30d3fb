// slam-map: saves, loads or forgets the map of a running slam, and says what became of it.
#include <poll.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "common/lcm_bus.h"
#include "common/node.h"
#include "common/tool_main.h"
#include "foresight/slam_answer_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "procs/slam/map_shelf.h"

namespace foresight {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kSilence = std::chrono::seconds(5);        // after which nobody is there
constexpr auto kRepeat = std::chrono::milliseconds(500);  // of the order: datagrams get lost

// The order goes to both sites, and the answer may come from either: slam does it once.
class Asker {
 public:
  Asker(const std::string& robot_url, const std::string& operator_url, slam_command_t order)
      : buses_{std::make_unique<LcmBus>(robot_url), std::make_unique<LcmBus>(operator_url)},
        order_(std::move(order)) {
    for (auto& bus : buses_) {
      bus->subscribe("SLAM_ANSWER", [this](const std::string&, auto bytes) { on_answer(bytes); });
    }
  }

  /// The last answer; nothing when there was none for too long.
  std::optional<slam_answer_t> ask() {
    last_heard_ = Clock::now();
    auto sent = last_heard_ - kRepeat;
    while (Clock::now() - last_heard_ < kSilence) {
      if (Clock::now() - sent >= kRepeat) {
        for (auto& bus : buses_) bus->publish("SLAM_COMMAND", encode(order_));
        sent = Clock::now();
      }
      wait();
      for (auto& bus : buses_) bus->receive();
      if (answer_) return answer_;
    }
    return std::nullopt;
  }

 private:
  void on_answer(std::span<const uint8_t> bytes) {
    const auto answer = decode_checked<slam_answer_t>(bytes);
    if (!answer || answer->command_utime != order_.utime) return;
    last_heard_ = Clock::now();
    if (answer->outcome != slam_answer_t::OUTCOME_RUNNING) answer_ = answer;
  }
  void wait() const {
    std::array<pollfd, 2> fds{};
    for (size_t i = 0; i < fds.size(); ++i) fds[i] = {buses_[i]->file_descriptor(), POLLIN, 0};
    constexpr auto kWait_ms = std::chrono::milliseconds(kRepeat).count();
    poll(fds.data(), fds.size(), static_cast<int>(kWait_ms));
  }

  std::array<std::unique_ptr<LcmBus>, 2> buses_;
  slam_command_t order_;
  Clock::time_point last_heard_;
  std::optional<slam_answer_t> answer_;
};

// One line for a terminal, whoever sent it.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

int give_order(const std::string& robot_url, const std::string& operator_url,
               const slam_command_t& order) {
  const auto answer = Asker(robot_url, operator_url, order).ask();
  if (!answer) {
    throw UnavailableError("no slam answers within " + std::to_string(kSilence.count()) +
                           " s, neither at the robot's nor at the operator's site");
  }
  if (answer->outcome != slam_answer_t::OUTCOME_DONE)
    throw UnavailableError(printable(answer->text));
  std::printf("slam-map: %s\n", printable(answer->text).c_str());
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  const std::map<std::string, int> orders{{"save", int{slam_command_t::COMMAND_SAVE_MAP}},
                                          {"load", int{slam_command_t::COMMAND_LOAD_MAP}},
                                          {"reset", int{slam_command_t::COMMAND_RESET_MAP}}};
  std::string order, name, robot_url = default_url(Domain::kRobot);
  std::string operator_url = default_url(Domain::kOperator);
  CLI::App app(
      "Orders to a running slam, from either site: save its map (a COLMAP text model with the "
      "keyframes' images, and what slam needs to go on with it), load a saved one, or start anew. "
      "Maps lie below slam's map_root on slam's machine, by default ~/.local/share/foresight/maps.",
      "slam-map");
  app.add_option("order", order, "save, load or reset")->required()->check(CLI::IsMember(&orders));
  app.add_option("name", name, "of the map: letters, digits, '.', '_', '-'");
  app.add_option("--robot-url", robot_url, "LCM URL of the robot site");
  app.add_option("--operator-url", operator_url, "LCM URL of the operator site");
  return tool_main(app, argc, argv, [&] {
    if (order == "reset" && !name.empty()) throw UsageError("reset takes no name");
    const std::string trouble = order == "reset" ? "" : find_name_trouble(name);
    if (!trouble.empty()) throw UsageError(order + ": " + trouble);
    slam_command_t message{};
    message.utime = std::chrono::duration_cast<std::chrono::microseconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
    message.command = static_cast<int8_t>(orders.at(order));
    message.map_name = name;
    return give_order(robot_url, operator_url, message);
  });
}
