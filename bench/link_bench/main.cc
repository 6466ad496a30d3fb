// How exactly a running link delays: sends messages at one side, receives them at the other, and
// prints the error of the delay.
//
//   scripts/run link --set to_operator_delay_s=0.15 --set to_operator_channels=LINK_BENCH &
//   scripts/run link-bench --delay 0.15
#include <algorithm>
#include <cstdio>

#include "common/errors.h"
#include "common/live_host.h"
#include "common/node.h"
#include "common/realtime.h"
#include "common/tool_main.h"
#include "foresight/image_t.hpp"

namespace foresight {
namespace {

struct Options {
  std::string robot_url = default_url(Domain::kRobot);
  std::string operator_url = default_url(Domain::kOperator);
  std::string channel = "LINK_BENCH";
  double delay_s = 0.15, rate_hz = 100;
  int count = 1000, bytes = 1000;
};

class Bench {
 public:
  Bench(const Options& options, LiveHost& host)
      : options_(options),
        host_(host),
        node_("link-bench", host, {}),
        out_(node_.advertise<image_t>({.channel = options.channel, .domain = Domain::kRobot})) {
    node_.subscribe<image_t>(
        {.channel = options.channel, .domain = Domain::kOperator}, Queue::kAll,
        [this](const image_t& m) { delays_s_.push_back((node_.now() - Time{m.utime}).seconds()); });
    message_.data.resize(static_cast<size_t>(options.bytes));
    message_.n_data = options.bytes;
    node_.every(seconds(1 / options.rate_hz), "send", [this] { send(); });
  }

  /// Exit code.
  int report() {
    if (delays_s_.empty()) {
      std::fprintf(stderr, "link-bench: nothing came back: does a link carry %s?\n",
                   options_.channel.c_str());
      return kExitUnavailable;
    }
    std::sort(delays_s_.begin(), delays_s_.end());
    const auto error_ms = [&](double share) {
      const auto last = static_cast<double>(delays_s_.size() - 1);
      return 1e3 * (delays_s_[static_cast<size_t>(share * last)] - options_.delay_s);
    };
    std::printf(
        "%zu of %d messages of %d bytes; delay error "
        "p0 %.2f  p50 %.2f  p99 %.2f  max %.2f ms\n",
        delays_s_.size(), sent_, options_.bytes, error_ms(0), error_ms(0.5), error_ms(0.99),
        error_ms(1));
    return kExitDone;
  }

 private:
  void send() {
    if (sent_ == options_.count) {
      if (!ending_)
        node_.at(node_.now() + seconds(options_.delay_s + 0.5), [this] { host_.stop(0); });
      ending_ = true;
      return;
    }
    ++sent_;
    message_.utime = node_.now().us;
    out_.publish(message_);
  }
  const Options& options_;
  LiveHost& host_;
  Node node_;
  Publisher<image_t> out_;
  image_t message_{};
  std::vector<double> delays_s_;
  int sent_ = 0;
  bool ending_ = false;
};

int run(int argc, char** argv) {
  Options o;
  CLI::App app("Measures how exactly a running link delays.", "link-bench");
  app.add_option("--robot-url", o.robot_url)->capture_default_str();
  app.add_option("--operator-url", o.operator_url)->capture_default_str();
  app.add_option("--channel", o.channel, "that the link carries to the operator")
      ->capture_default_str();
  app.add_option("--delay", o.delay_s, "that the link is set to, in seconds")
      ->capture_default_str();
  app.add_option("--rate", o.rate_hz, "messages per second")
      ->check(CLI::Range(0.1, 10'000.0))
      ->capture_default_str();
  app.add_option("--count", o.count, "messages")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  app.add_option("--bytes", o.bytes, "of each")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  return tool_main(app, argc, argv, [&] {
    LiveHost host(o.robot_url, o.operator_url);
    Bench bench(o, host);
    if (!schedule_in_real_time(20)) {
      std::fprintf(stderr,
                   "link-bench: no right to real-time scheduling: its own delays count too\n");
    }
    host.run();
    return bench.report();
  });
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) { return foresight::run(argc, argv); }
