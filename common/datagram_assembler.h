// LCM's messages from the datagrams that carry them (its protocol "udpm"): whole ones, and those in
// fragments. liblcm's own receiver writes outside its memory when a fragment's offset wraps, and
// keeps whatever is announced; this one believes nothing that it has not checked and is bounded in
// memory.
//
//   DatagramAssembler assembler;
//   if (auto message = assembler.feed(sender, datagram, now)) use(message->channel,
//   message->bytes);
//
// Wire format (big endian), as liblcm 1.3 sends it:
//   whole:    "LC02", u32 number, channel, 0, payload
//   fragment: "LC03", u32 number, u32 size of the payload, u32 offset in it, u16 which fragment,
//             u16 how many; the first one goes on with channel, 0; then a piece of the payload
// A sender is an address and a port. It sends the fragments of one message after another, so a new
// number of its ends the message that was under way.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace foresight {

struct LcmMessage {
  std::string channel;
  std::vector<uint8_t> bytes;
};

class DatagramAssembler {
 public:
  static constexpr size_t kLargestMessage_bytes = size_t{64} << 20;
  static constexpr size_t kMemory_bytes = size_t{128} << 20;  // of all unfinished messages
  static constexpr size_t kSenders = 1024;                    // that may have an unfinished one
  static constexpr int64_t kPatience_us = 2'000'000;          // then an unfinished one is given up

  /// The message that this datagram completes. `sender`: any number that stands for its address
  /// and port; `now_us`: of a clock that does not go back.
  std::optional<LcmMessage> feed(uint64_t sender, std::span<const uint8_t> datagram,
                                 int64_t now_us);

  /// Datagrams that are none of LCM's, or contradict themselves or each other.
  int64_t malformed() const { return malformed_; }
  /// Messages that were given up because fragments were missing.
  int64_t incomplete() const { return incomplete_; }
  /// Of the unfinished messages.
  size_t memory_bytes() const { return memory_bytes_; }

 private:
  struct Piece {
    size_t offset = 0;
    std::vector<uint8_t> bytes;
  };
  struct Unfinished {
    uint32_t number = 0;
    size_t size = 0;
    std::string channel;
    std::map<uint16_t, Piece> pieces;  // by which fragment
    uint16_t piece_count = 0;
    int64_t newest_us = 0;
  };
  struct Fragment;

  static std::optional<Fragment> parse(std::span<const uint8_t> datagram);
  std::optional<LcmMessage> feed_fragment(uint64_t sender, const Fragment& fragment,
                                          int64_t now_us);
  Unfinished* find(uint64_t sender, const Fragment& fragment);
  void give_up(std::map<uint64_t, Unfinished>::iterator unfinished);
  void forget_old(int64_t now_us);
  void forget_most_stale();
  void forget(std::map<uint64_t, Unfinished>::iterator unfinished);
  static std::optional<LcmMessage> join(Unfinished& message);
  std::optional<LcmMessage> reject();

  std::map<uint64_t, Unfinished> unfinished_;  // by sender
  size_t memory_bytes_ = 0;
  int64_t looked_for_old_us_ = 0;
  int64_t malformed_ = 0, incomplete_ = 0;
};

}  // namespace foresight
