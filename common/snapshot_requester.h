// Whoever needs a whole state that another process sends on request.
#pragma once

#include <string>

#include "common/node.h"
#include "common/snapshot_gate.h"
#include "foresight/snapshot_request_t.hpp"

namespace foresight {

/// Asks for a snapshot of `channel`, as soon as the process runs and then every half second
/// until satisfied; later at once when something is missing.
class SnapshotRequester {
 public:
  SnapshotRequester(Node& node, const std::string& channel, Domain domain)
      : node_(node),
        channel_(channel),
        publisher_(node.advertise<snapshot_request_t>(
            {.channel = "SNAPSHOT_REQUEST",
             .domain = domain,
             .doc = "asks for the whole state after a gap or a late start"})) {
    const auto ask = [this] {
      if (wanted_) publish();
    };
    node.at(node.now(), ask);
    node.every(kSnapshotInterval, "request " + channel, ask);
  }
  void want() {
    if (!wanted_) publish();
    wanted_ = true;
  }
  void satisfied() { wanted_ = false; }

 private:
  void publish() {
    snapshot_request_t request{};
    request.utime = node_.now().us;
    request.channel = channel_;
    request.requester = node_.name();
    publisher_.publish(request);
  }
  Node& node_;
  std::string channel_;
  Publisher<snapshot_request_t> publisher_;
  bool wanted_ = true;  // every receiver starts late
};

}  // namespace foresight
