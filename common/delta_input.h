// A process's side of a delta stream: the port, requests for what is missing, and answers.
//
//   DeltaInput<map_delta_t, MapDelta> map_;        // a member: applies what arrives, asks for gaps
//   SnapshotResponder responder_;                  // a member: sends the whole state to who asks
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/delta_stream.h"
#include "common/snapshot_gate.h"
#include "common/snapshot_requester.h"

namespace foresight {

/// Answers requests for `channel` by `send`, at once but at most once in
/// kSnapshotInterval, however many ask.
class SnapshotResponder {
 public:
  SnapshotResponder(Node& node, const std::string& channel, const char* doc,
                    std::function<void()> send)
      : node_(node), channel_(channel), send_(std::move(send)) {
    node.subscribe<snapshot_request_t>({.channel = "SNAPSHOT_REQUEST", .doc = doc}, Queue::kAll,
                                       [this](const snapshot_request_t& m) { on_request(m); });
  }

 private:
  void on_request(const snapshot_request_t& request) {
    if (request.channel != channel_) return;
    const auto due = gate_.request(node_.now());
    if (!due) return;
    if (*due <= node_.now()) return answer();
    node_.at(*due, [this] { answer(); });
  }
  void answer() {
    gate_.answered(node_.now());
    send_();
  }

  Node& node_;
  std::string channel_;
  std::function<void()> send_;
  SnapshotGate gate_;
};

/// Subscribes a delta stream and hands on what is to be applied, in order.
template <class Message, class Delta>
class DeltaInput {
 public:
  using Step = DeltaStep<Delta>;
  /// Applies one step; why it does not fit the state (which a refused delta leaves alone), or "".
  using Apply = std::function<std::string(const Step& step)>;

  DeltaInput(Node& node, const PortSpec& spec, Apply apply)
      : node_(node),
        channel_(spec.channel),
        apply_(std::move(apply)),
        requester_(node, spec.channel, spec.domain) {
    input_ =
        node.subscribe<Message>(spec, Queue::kAll, [this](const Message& m) { on_message(m); });
  }
  bool is_synchronised() const { return receiver_.is_synchronised(); }

 private:
  void on_message(const Message& message) {
    if (receiver_.receive(message, node_.now()) == Received::kBad) {
      input_.reject("contradicts itself");
    }
    go_on();
  }
  void go_on() {
    for (const Step& step : receiver_.take()) {
      const std::string misfit = apply_(step);
      if (misfit.empty()) continue;
      input_.reject("does not fit what is known so far: " + misfit);
      receiver_.refuse(step);
      break;
    }
    if (receiver_.wants_snapshot()) {
      requester_.want();
    } else {
      requester_.satisfied();
    }
    node_.set_metric(channel_ + "_gaps", static_cast<double>(receiver_.gaps()));
    watch_deadline();
  }
  // One timer at a time: a doubt that ends meanwhile leaves it nothing to do.
  void watch_deadline() {
    const auto deadline = receiver_.deadline();
    if (!deadline || is_watching_) return;
    is_watching_ = true;
    node_.at(*deadline, [this] {
      is_watching_ = false;
      receiver_.settle(node_.now());
      go_on();
    });
  }

  Node& node_;
  Input input_;
  std::string channel_;
  Apply apply_;
  SnapshotRequester requester_;
  DeltaReceiver<Message, Delta> receiver_;
  bool is_watching_ = false;
};

}  // namespace foresight
