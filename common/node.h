// A process's view of its host: typed and validated ports, timers, the worker, health.
//
//   class Mesher : public Process {
//     Mesher(Node& node, const MesherParams& params)
//         : meshes_(node.advertise<mesh_t>({.channel = "MESH", .doc = "…"})) {
//       node.subscribe<carving_delta_t>({.channel = "CARVING_DELTA", .doc = "…"}, Queue::kAll,
//                                       [this](const carving_delta_t& m) { on_delta(m); });
//       node.every(seconds(1), "update", [this] { update(); });
//     }
//   };
//
// The constructor is the contract: everything it declares is recorded and printed by --describe.
// A datagram that is truncated, oversized, of another type, carries NaN or an absurd stamp is
// counted in health and never reaches a handler; a port on which most are rejected degrades it.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/errors.h"
#include "common/host.h"
#include "common/message_bytes.h"
#include "common/message_check.h"
#include "common/stamp_gate.h"
#include "common/stream_losses.h"
#include "foresight/health_t.hpp"

namespace foresight {

struct PortSpec {
  std::string channel;
  Domain domain = Domain::kRobot;
  double rate_hz = 0;  // expected; 0: on events
  const char* doc = "";
  bool optional = false;  // of an input: nothing is missing if nobody publishes it
};

struct PortRecord {
  PortSpec spec;
  std::string type;
  bool is_input = false;
  bool judges_stamps = true;  // false: what comes here has stamps of any time
  // Counters since start; `arrived` counts the rejected ones too.
  int64_t messages = 0, arrived = 0, rejected = 0, skipped = 0, bytes = 0;
  StampGate stamps;
  StreamLosses losses;
  // Of the second that is running: worst cases, and the marks from which rates are taken.
  std::optional<Duration> latency;
  Duration handling{0};
  int64_t messages_mark = 0, bytes_mark = 0;
  // Of the last whole second.
  std::optional<Duration> last_latency;
  Duration last_handling{0};
  double rate_hz = 0, bytes_per_s = 0;
  // Rejections: as they were one and two seconds ago, and what was said last.
  struct Mark {
    int64_t arrived = 0, rejected = 0;
  };
  std::array<Mark, 2> marks;
  std::string last_rejection;
  std::optional<Time> rejection_logged;
};

/// The number by which losses on a stream are counted, of messages that bear one.
template <class Message>
std::optional<StreamNumber> stream_number(const Message& message) {
  if constexpr (requires { message.frame_number; }) {
    return StreamNumber{0, message.frame_number};
  } else if constexpr (requires { message.session, message.seq; }) {
    return StreamNumber{message.session, message.seq};
  } else {
    return std::nullopt;
  }
}

struct TimerRecord {
  std::string name;
  Duration period;
};

class Node;

/// Sends messages of one type on one channel.
template <class Message>
class Publisher {
 public:
  void publish(const Message& message) const;

 private:
  friend class Node;
  Publisher(Node* node, PortRecord* port) : node_(node), port_(port) {}
  Node* node_;
  PortRecord* port_;
};

/// One subscription: to refuse what came on it, at once or later.
class Input {
 public:
  Input() = default;  // none; of a member that the constructor assigns
  /// Counts a message that was refused after decoding (unknown ids, impossible sizes).
  void reject(const std::string& why) const;

 private:
  friend class Node;
  Input(Node* node, PortRecord* port) : node_(node), port_(port) {}
  Node* node_ = nullptr;
  PortRecord* port_ = nullptr;
};

enum class ProcessState : int8_t {
  kStarting = health_t::STATE_STARTING,
  kOk = health_t::STATE_OK,
  kWaiting = health_t::STATE_WAITING,
  kDegraded = health_t::STATE_DEGRADED,
  kFailed = health_t::STATE_FAILED,
  kDone = health_t::STATE_DONE,
};

class Node {
 public:
  /// `health_domains`: where HEALTH is published (the home domain; both for link).
  Node(std::string name, Host& host, std::vector<Domain> health_domains);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  const std::string& name() const { return name_; }
  Time now() const { return host_.now(); }
  bool is_simulated() const { return host_.is_simulated(); }
  int64_t clock_changes() const { return host_.clock_changes(); }

  template <class Message>
  Publisher<Message> advertise(const PortSpec& spec) {
    return {this, add_port(spec, Message::getTypeName(), false)};
  }
  template <class Message>
  Input subscribe(const PortSpec& spec, Queue queue, std::function<void(const Message&)> handler) {
    PortRecord* port = add_port(spec, Message::getTypeName(), true);
    const MessageSchema* schema = find_schema(Message::getTypeName());
    listen(port, queue, [this, port, schema, handler = std::move(handler)](auto bytes) {
      if (!accept(port, *schema, Message::getHash(), bytes)) return;
      Message message;
      if (message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0) {
        reject(port, "cannot be decoded");
        return;
      }
      if (const auto n = stream_number(message)) port->losses.add(*n, port->skipped);
      guard(port, [&] { handler(message); });
    });
    return {this, port};
  }
  /// Bytes as they come, for processes that pass messages on without reading them (link).
  void subscribe_raw(const PortSpec& spec, Queue queue, Host::Handler handler);
  /// Publishes bytes on a channel that advertise_raw() declared.
  PortRecord* advertise_raw(const PortSpec& spec) { return add_port(spec, "any", false); }
  void publish_raw(PortRecord* port, std::span<const uint8_t> bytes);

  void every(Duration period, const std::string& name, std::function<void()> call);
  void at(Time time, std::function<void()> call);

  /// One job at a time beside the main thread; false when one is running already. `simulated_cost`
  /// is how long it takes on a simulated clock.
  [[nodiscard]] bool run_beside(Job job, Duration simulated_cost);
  bool job_running() const { return job_running_; }

  void set_state(ProcessState state, const std::string& reason);
  ProcessState state() const { return state_; }
  void set_metric(const std::string& name_with_unit, double value);
  /// The source has ended: state DONE; ends the process too, with `exit_code`, when there is one.
  void finish(const std::string& reason, std::optional<ExitCode> exit_code);
  /// One line for the process's log (stderr), with its name: what an operator of the machine may
  /// look for later.
  void log(const std::string& line) const;

  const std::deque<PortRecord>& ports() const { return ports_; }
  const std::vector<TimerRecord>& timers() const { return timers_; }

 private:
  template <class Message>
  friend class Publisher;
  friend class Input;

  PortRecord* add_port(const PortSpec& spec, const std::string& type, bool is_input);
  void listen(PortRecord* port, Queue queue, Host::Handler handler);
  bool accept(PortRecord* port, const MessageSchema& schema, int64_t fingerprint,
              std::span<const uint8_t> bytes);
  std::string find_error(PortRecord* port, const MessageSchema& schema, int64_t fingerprint,
                         std::span<const uint8_t> bytes) const;
  void reject(PortRecord* port, const std::string& why);
  void guard(PortRecord* port, const std::function<void()>& call);
  void measure();
  void mark_rejections();
  std::string rejections() const;
  health_t make_health() const;
  void publish_health();

  std::string name_;
  Host& host_;
  Time started_;
  std::deque<PortRecord> ports_;  // addresses stay valid
  std::vector<TimerRecord> timers_;
  std::vector<PortRecord*> health_ports_;
  std::map<std::string, double> metrics_;
  ProcessState state_ = ProcessState::kStarting;
  std::string reason_;
  bool job_running_ = false;
  Time measured_at_;
  double cpu_mark_s_ = 0, cpu_share_ = 0;
};

/// A process: its constructor takes (Node&, const Params&) and declares; start() opens what may
/// fail.
class Process {
 public:
  virtual ~Process() = default;
  /// Called once before the first handler; throws StartupError.
  virtual void start() {}
};

template <class Message>
void Publisher<Message>::publish(const Message& message) const {
  node_->publish_raw(port_, encode(message));
}

}  // namespace foresight
