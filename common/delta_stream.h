// State that grows travels as numbered deltas with a snapshot for whoever joins late or has a gap.
//
//   DeltaSender<map_delta_t> sender(publisher, node.now());
//   sender.send_delta(time, epoch, delta);
//
//   DeltaReceiver<map_delta_t, MapDelta> receiver;
//   switch (receiver.receive(message)) {
//     case kDelta: core.apply(receiver.take()); break;
//     case kSnapshot: core.reset(); core.apply(receiver.take()); break;
//     case kGap: requester.want(); break;              // and nothing is applied until it comes
//     …
//   }
//
// A stream is named by (epoch, session): a new map or a restarted sender begins a new one, whose
// first delta is a snapshot. A gap is noticed by `seq` and repaired on request, never ignored.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "common/messages.h"
#include "common/node.h"
#include "foresight/snapshot_request_t.hpp"

namespace foresight {

template <class Message>
class DeltaSender {
 public:
  DeltaSender(Publisher<Message> publisher, Time session)
      : publisher_(std::move(publisher)), session_(session.us) {}

  /// Sends the next delta; the first of an epoch must be applicable to an empty state.
  template <class Delta>
  void send_delta(Time time, int64_t epoch, const Delta& delta) {
    const bool first = epoch != epoch_;
    if (first) {
      epoch_ = epoch;
      seq_ = 0;
    } else {
      ++seq_;
    }
    send(time, delta, first);
  }
  /// Begins a new stream: the next delta is a snapshot, and receivers of the old one notice.
  void restart(Time session) {
    session_ = std::max(session_ + 1, session.us);
    epoch_ = 0;
  }
  /// Repeats the whole state as of the last delta.
  template <class Delta>
  void send_snapshot(Time time, const Delta& whole) {
    if (epoch_ != 0) send(time, whole, true);
  }

 private:
  template <class Delta>
  void send(Time time, const Delta& delta, bool is_snapshot) {
    for (Message& part : split(delta, kMaxDeltaBytes)) {
      part.utime = time.us;
      part.header.epoch = epoch_;
      part.header.session = session_;
      part.header.seq = seq_;
      part.header.is_snapshot = is_snapshot ? 1 : 0;
      publisher_.publish(part);
    }
  }
  Publisher<Message> publisher_;
  int64_t session_;
  int64_t epoch_ = 0;
  int32_t seq_ = 0;
};

enum class Received {
  kIncomplete,  // a part; more to come
  kDelta,       // take() and apply to the present state
  kSnapshot,    // take() and apply to an empty state
  kIgnored,     // already known, or meant for somebody else
  kGap,         // something is missing: ask for a snapshot
  kBad,         // contradicts itself
};

template <class Message, class Delta>
class DeltaReceiver {
 public:
  [[nodiscard]] Received receive(const Message& message) {
    const delta_header_t& h = message.header;
    if (h.part < 0 || h.part_count < 1 || h.part >= h.part_count || h.seq < 0) return kBadPart();
    const bool same_stream = is_synchronised_ && h.epoch == epoch_ && h.session == session_;
    if (h.is_snapshot != 0) {
      if (same_stream && h.seq < next_seq_) return Received::kIgnored;
    } else {
      if (!same_stream) return lose();
      if (h.seq < next_seq_) return Received::kIgnored;
      if (h.seq > next_seq_) return lose();
    }
    return collect(message);
  }
  /// The completed delta, after kDelta or kSnapshot.
  Delta take() { return std::exchange(complete_, Delta{}); }
  /// Forget the stream, e.g. because the core refused a delta: only a snapshot helps.
  void desynchronise() { is_synchronised_ = false; }
  bool is_synchronised() const { return is_synchronised_; }
  int64_t epoch() const { return epoch_; }

 private:
  Received kBadPart() {
    is_synchronised_ = false;
    return Received::kBad;
  }
  Received lose() {
    is_synchronised_ = false;
    return Received::kGap;
  }
  // Parts arrive in order; any other order is a loss.
  Received collect(const Message& message) {
    const delta_header_t& h = message.header;
    if (h.part == 0) {
      parts_ = Delta{};
      part_header_ = h;
    } else if (h.epoch != part_header_.epoch || h.session != part_header_.session ||
               h.seq != part_header_.seq || h.is_snapshot != part_header_.is_snapshot ||
               h.part_count != part_header_.part_count || h.part != part_header_.part + 1) {
      part_header_ = {};
      return lose();
    }
    part_header_.part = h.part;
    if (!append(message, &parts_)) return kBadPart();
    if (h.part + 1 < h.part_count) return Received::kIncomplete;
    complete_ = std::exchange(parts_, Delta{});
    part_header_ = {};
    is_synchronised_ = true;
    epoch_ = h.epoch;
    session_ = h.session;
    next_seq_ = h.seq + 1;
    return h.is_snapshot != 0 ? Received::kSnapshot : Received::kDelta;
  }

  bool is_synchronised_ = false;
  int64_t epoch_ = 0, session_ = 0;
  int32_t next_seq_ = 0;
  delta_header_t part_header_{};
  Delta parts_, complete_;
};

/// Asks for a snapshot of `channel`, at once and then every second until satisfied.
class SnapshotRequester {
 public:
  SnapshotRequester(Node& node, const std::string& channel, Domain domain)
      : node_(node),
        channel_(channel),
        publisher_(node.advertise<snapshot_request_t>(
            {.channel = "SNAPSHOT_REQUEST",
             .domain = domain,
             .doc = "asks for the whole state after a gap or a late start"})) {
    node.every(seconds(1), "request " + channel, [this] {
      if (wanted_) publish();
    });
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
