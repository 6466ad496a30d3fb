// State that grows travels as numbered deltas with a snapshot for whoever joins late or has a gap.
//
//   DeltaSender<map_delta_t> sender(publisher, node.now());
//   sender.send_delta(time, epoch, delta);
//
// and in a process that receives it (delta_input.h has the port, the requests and the timers):
//
//   DeltaInput<map_delta_t, MapDelta> map(node, {.channel = "MAP_DELTA"}, [&](const auto& step) {
//     if (step.is_snapshot) core.reset();
//     return core.apply(step.delta);          // why it does not fit, or ""
//   });
//
// A stream is named by (epoch, session): a new map or a restarted sender begins a new one, whose
// first delta is a snapshot. A gap is noticed by `seq` and repaired on request, never ignored.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/fnv.h"
#include "common/messages.h"
#include "common/node.h"
#include "common/snapshot_gate.h"
#include "common/snapshot_requester.h"

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
  kDelta,       // take(): apply to the present state
  kSnapshot,    // take(): apply to an empty state
  kIgnored,     // already known, or meant for somebody else
  kGap,         // something is missing: ask for a snapshot
  kHeld,        // of another stream, which may have followed the present one: ask for a snapshot
  kBad,         // contradicts itself
};

/// A state larger than this many parts (200 MB) is none.
constexpr int32_t kMaxDeltaParts = 500;

/// What is to be applied to the state, in order.
template <class Delta>
struct DeltaStep {
  bool is_snapshot = false;  // apply to an empty state
  Time time;                 // of the data
  int64_t epoch = 0;
  Delta delta;
};

// Puts the parts of one delta together. Parts arrive in order; any other order is a loss.
template <class Message, class Delta>
class DeltaAssembler {
 public:
  enum class Result { kIncomplete, kComplete, kLost, kBad };

  Result add(const Message& message) {
    const delta_header_t& h = message.header;
    if (h.part == 0) {
      step_ = {};
      header_ = h;
    } else if (h.epoch != header_.epoch || h.session != header_.session || h.seq != header_.seq ||
               h.is_snapshot != header_.is_snapshot || h.part_count != header_.part_count ||
               h.part != header_.part + 1) {
      clear();
      return Result::kLost;
    }
    header_.part = h.part;
    if (!append(message, &step_.delta)) {
      clear();
      return Result::kBad;
    }
    if (h.part + 1 < h.part_count) return Result::kIncomplete;
    step_.is_snapshot = h.is_snapshot != 0;
    step_.time = {message.utime};
    step_.epoch = h.epoch;
    header_ = {};
    return Result::kComplete;
  }
  DeltaStep<Delta> take() { return std::exchange(step_, {}); }

 private:
  void clear() {
    header_ = {};
    step_ = {};
  }
  delta_header_t header_{};
  DeltaStep<Delta> step_;
};

// Whoever is on the network may send anything, so one message ends no stream: the stream that keeps
// coming wins (docs/decisions/0008). A message that does not go on the present stream (another
// epoch or session, or an unexpected number) raises a doubt: the receiver goes on as it was, holds
// what the other stream sends and asks for a snapshot. Whoever sends the present stream answers at
// once, or, when he has answered somebody just before, kSnapshotInterval after that. If he is not
// heard until then, the other stream takes over, with all that it has sent meanwhile. The
// first stream of all is taken at once, and so is the snapshot that fills a gap in the present one.
template <class Message, class Delta>
class DeltaReceiver {
 public:
  static constexpr Duration kAnswer = milliseconds(250);  // so long may the sender take to answer
  static constexpr size_t kMaxHeld = 200;                 // deltas of another stream

  [[nodiscard]] Received receive(const Message& message, Time now) {
    const delta_header_t& h = message.header;
    const bool is_possible =
        h.part >= 0 && h.part < h.part_count && h.part_count <= kMaxDeltaParts && h.seq >= 0;
    if (!is_possible) return Received::kBad;
    if (!present_) return h.is_snapshot != 0 ? begin(message, now) : Received::kGap;
    if (present_->stream != Stream{h.epoch, h.session}) return contend(message, now);
    return h.is_snapshot != 0 ? receive_snapshot(message, now) : receive_delta(message, now);
  }
  /// Call when deadline() has come: takes another stream over that the present one has not denied.
  void settle(Time now) {
    if (deadline() && now >= *deadline()) take_over(now);
  }
  std::optional<Time> deadline() const {
    if (!contender_ || contender_->held.empty()) return std::nullopt;
    return std::max(contender_->since, present_->answered + kSnapshotInterval) + kAnswer;
  }
  /// What is to be applied now, in order; empty after most messages.
  std::vector<DeltaStep<Delta>> take() { return std::exchange(steps_, {}); }
  /// The core has refused the last step that was taken: only a snapshot, or the right delta, helps.
  void refuse(const DeltaStep<Delta>& step) {
    if (!present_) return;
    doubts_ = true;
    if (step.is_snapshot) {
      is_synchronised_ = false;
    } else {
      --present_->next_seq;
    }
  }
  /// Something is missing, or another stream wants to take over.
  bool wants_snapshot() const {
    return !present_ || !is_synchronised_ || doubts_ || suspects_ || contender_;
  }
  bool is_synchronised() const { return present_ && is_synchronised_; }
  int64_t epoch() const { return present_ ? present_->stream.epoch : 0; }
  int64_t gaps() const { return gaps_; }

 private:
  using Assembler = DeltaAssembler<Message, Delta>;
  using Result = typename Assembler::Result;
  struct Stream {
    int64_t epoch = 0, session = 0;
    bool operator==(const Stream&) const = default;
  };
  struct Present {
    Stream stream;
    int64_t next_seq = 0;
    Time answered;               // when its last snapshot came
    std::vector<uint64_t> last;  // what the parts of the last delta were, to know its copies
  };
  struct Contender {
    Stream stream;
    Time since;
    int64_t next_seq = -1;
    std::vector<DeltaStep<Delta>> held;  // a snapshot and what followed
  };

  Received begin(const Message& message, Time now) {
    const Received received = assemble(&snapshots_, message);
    if (received != Received::kSnapshot) return received;
    const delta_header_t& h = message.header;
    steps_ = {snapshots_.take()};
    present_ = Present{{h.epoch, h.session}, h.seq + int64_t{1}, now, {}};
    become_sure();
    return received;
  }

  Received receive_delta(const Message& message, Time now) {
    const int64_t seq = message.header.seq;
    const uint64_t print = print_of(message);
    if (seq == present_->next_seq - 1) {
      const auto& last = present_->last;
      if (last.empty() || std::find(last.begin(), last.end(), print) != last.end()) {
        return Received::kIgnored;
      }
      suspects_ = true;  // two deltas of one number: one of them is forged
      return gap();
    }
    if (seq != present_->next_seq) return out_of_order(message, now);
    const Received received = assemble(&deltas_, message);
    if (received == Received::kGap) doubts_ = true;
    if (received == Received::kGap || received == Received::kBad) return received;
    if (message.header.part == 0) prints_.clear();
    prints_.push_back(print);
    if (received != Received::kDelta) return received;
    ++present_->next_seq;
    present_->last = std::exchange(prints_, {});
    steps_ = {deltas_.take()};
    settle_doubts();
    return received;
  }

  // Something was lost, or this one is forged, or what put the receiver where it is was.
  Received out_of_order(const Message& message, Time now) {
    doubts_ = true;
    const bool follows_a_contender =
        contender_ && contender_->stream == present_->stream && !contender_->held.empty();
    return follows_a_contender ? contend(message, now) : gap();
  }

  // A snapshot of the present stream: the answer to a doubt, or to somebody else's.
  Received receive_snapshot(const Message& message, Time now) {
    const int64_t seq = message.header.seq;
    const bool says_nothing_new = seq == present_->next_seq - 1;
    if (says_nothing_new && is_synchronised_ && !suspects_) {
      present_->answered = now;
      settle_doubts();
      return Received::kIgnored;
    }
    const bool is_wanted = doubts_ || suspects_ || !is_synchronised_;
    if (seq >= present_->next_seq - 1 && is_wanted) return begin(message, now);
    return contend(message, now);
  }

  // Of another stream, or of another place in the present one.
  Received contend(const Message& message, Time now) {
    const delta_header_t& h = message.header;
    const Stream stream{h.epoch, h.session};
    if (!contender_ || contender_->stream != stream) contender_ = Contender{stream, now, -1, {}};
    Contender& c = *contender_;
    const bool goes_on = h.is_snapshot == 0 && !c.held.empty() && h.seq == c.next_seq;
    if (h.is_snapshot == 0 && !goes_on) return gap();
    const Received received = assemble(&contenders_, message);
    if (received != Received::kSnapshot && received != Received::kDelta) return received;
    if (h.is_snapshot != 0) c.held.clear();
    if (c.held.size() >= kMaxHeld) {  // more than a doubt lasts: begin with a new snapshot
      c.held.clear();
      return gap();
    }
    c.held.push_back(contenders_.take());
    c.next_seq = h.seq + int64_t{1};
    if (now < *deadline()) return Received::kHeld;
    take_over(now);
    return received;
  }

  void take_over(Time now) {
    steps_ = std::move(contender_->held);
    present_ = Present{contender_->stream, contender_->next_seq, now, {}};
    become_sure();
  }

  void become_sure() {
    settle_doubts();
    suspects_ = false;
    is_synchronised_ = true;
  }
  void settle_doubts() {
    contender_.reset();
    doubts_ = false;
  }
  Received gap() {
    ++gaps_;
    return Received::kGap;
  }
  Received assemble(Assembler* assembler, const Message& message) {
    switch (assembler->add(message)) {
      case Result::kIncomplete:
        return Received::kIncomplete;
      case Result::kBad:
        return Received::kBad;
      case Result::kLost:
        return gap();
      case Result::kComplete:
        break;
    }
    return message.header.is_snapshot != 0 ? Received::kSnapshot : Received::kDelta;
  }
  static uint64_t print_of(const Message& message) {
    Fnv1a hash;
    hash.add(encode(message));
    return hash.value();
  }

  std::optional<Present> present_;
  std::optional<Contender> contender_;
  bool is_synchronised_ = false;  // the state is that of the present stream
  bool doubts_ = false;           // whether nothing is missing
  bool suspects_ = false;         // whether what was applied last was genuine
  int64_t gaps_ = 0;
  Assembler deltas_, snapshots_, contenders_;
  std::vector<uint64_t> prints_;
  std::vector<DeltaStep<Delta>> steps_;
};

}  // namespace foresight
