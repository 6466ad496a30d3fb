#include "common/datagram_assembler.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr uint32_t kWhole = 0x4c433032, kFragment = 0x4c433033;
constexpr size_t kWholeHeader = 8, kFragmentHeader = 20;
constexpr size_t kLongestChannel = 63;
// What a piece costs beside its bytes: a sender of tiny fragments must not get memory for nothing.
constexpr size_t kPieceCost_bytes = 128;

uint32_t read_u32(std::span<const uint8_t> bytes, size_t at) {
  return uint32_t{bytes[at]} << 24 | uint32_t{bytes[at + 1]} << 16 | uint32_t{bytes[at + 2]} << 8 |
         uint32_t{bytes[at + 3]};
}

uint16_t read_u16(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

// The name at the front, which is taken off; nothing when it does not end in time.
std::optional<std::string> take_channel(std::span<const uint8_t>* bytes) {
  const auto limit =
      bytes->begin() + static_cast<std::ptrdiff_t>(std::min(bytes->size(), kLongestChannel + 1));
  const auto end = std::find(bytes->begin(), limit, uint8_t{0});
  if (end == limit || end == bytes->begin()) return std::nullopt;
  std::string channel(bytes->begin(), end);
  *bytes = bytes->subspan(channel.size() + 1);
  return channel;
}

}  // namespace

struct DatagramAssembler::Fragment {
  uint32_t number;
  size_t size, offset;
  uint16_t which, count;
  std::string channel;  // of the first fragment
  std::span<const uint8_t> bytes;
};

std::optional<DatagramAssembler::Fragment> DatagramAssembler::parse(
    std::span<const uint8_t> datagram) {
  if (datagram.size() < kFragmentHeader) return std::nullopt;
  Fragment f{.number = read_u32(datagram, 4),
             .size = read_u32(datagram, 8),
             .offset = read_u32(datagram, 12),
             .which = read_u16(datagram, 16),
             .count = read_u16(datagram, 18),
             .channel = {},
             .bytes = datagram.subspan(kFragmentHeader)};
  if (f.size > kLargestMessage_bytes || f.which >= f.count) return std::nullopt;
  if (f.which == 0) {
    auto channel = take_channel(&f.bytes);
    if (!channel) return std::nullopt;
    f.channel = *std::move(channel);
  }
  if (f.offset > f.size || f.bytes.size() > f.size - f.offset) return std::nullopt;
  return f;
}

std::optional<LcmMessage> DatagramAssembler::feed(uint64_t sender,
                                                  std::span<const uint8_t> datagram,
                                                  int64_t now_us) {
  forget_old(now_us);
  if (datagram.size() < kWholeHeader) return reject();
  const uint32_t magic = read_u32(datagram, 0);
  if (magic == kWhole) {
    std::span<const uint8_t> rest = datagram.subspan(kWholeHeader);
    auto channel = take_channel(&rest);
    if (!channel) return reject();
    return LcmMessage{*std::move(channel), {rest.begin(), rest.end()}};
  }
  if (magic != kFragment) return reject();
  const auto fragment = parse(datagram);
  if (!fragment) return reject();
  return feed_fragment(sender, *fragment, now_us);
}

std::optional<LcmMessage> DatagramAssembler::reject() {
  ++malformed_;
  return std::nullopt;
}

void DatagramAssembler::give_up(std::map<uint64_t, Unfinished>::iterator unfinished) {
  ++incomplete_;
  forget(unfinished);
}

void DatagramAssembler::forget(std::map<uint64_t, Unfinished>::iterator unfinished) {
  for (const auto& [which, piece] : unfinished->second.pieces) {
    memory_bytes_ -= piece.bytes.size() + kPieceCost_bytes;
  }
  unfinished_.erase(unfinished);
}

void DatagramAssembler::forget_old(int64_t now_us) {
  if (now_us - looked_for_old_us_ < kPatience_us / 10) return;
  looked_for_old_us_ = now_us;
  for (auto it = unfinished_.begin(); it != unfinished_.end();) {
    const auto next = std::next(it);
    if (now_us - it->second.newest_us > kPatience_us) give_up(it);
    it = next;
  }
}

void DatagramAssembler::forget_most_stale() {
  give_up(std::min_element(
      unfinished_.begin(), unfinished_.end(),
      [](const auto& a, const auto& b) { return a.second.newest_us < b.second.newest_us; }));
}

// The message that a fragment belongs to; nullptr when it contradicts those before it.
DatagramAssembler::Unfinished* DatagramAssembler::find(uint64_t sender, const Fragment& fragment) {
  const auto found = unfinished_.find(sender);
  if (found != unfinished_.end() && found->second.number != fragment.number) give_up(found);
  if (!unfinished_.contains(sender) && unfinished_.size() >= kSenders) forget_most_stale();
  Unfinished& message = unfinished_[sender];
  if (message.piece_count == 0) {
    message.number = fragment.number;
    message.size = fragment.size;
    message.piece_count = fragment.count;
  }
  const bool fits = message.size == fragment.size && message.piece_count == fragment.count &&
                    !message.pieces.contains(fragment.which);
  return fits ? &message : nullptr;
}

std::optional<LcmMessage> DatagramAssembler::feed_fragment(uint64_t sender,
                                                           const Fragment& fragment,
                                                           int64_t now_us) {
  Unfinished* message = find(sender, fragment);
  if (message == nullptr) return reject();
  message->newest_us = now_us;
  if (fragment.which == 0) message->channel = fragment.channel;
  message->pieces[fragment.which] = {fragment.offset,
                                     {fragment.bytes.begin(), fragment.bytes.end()}};
  memory_bytes_ += fragment.bytes.size() + kPieceCost_bytes;
  while (memory_bytes_ > kMemory_bytes) forget_most_stale();
  const auto found = unfinished_.find(sender);
  if (found == unfinished_.end() || found->second.pieces.size() < found->second.piece_count) {
    return std::nullopt;
  }
  auto whole = join(found->second);
  forget(found);
  return whole ? std::move(whole) : reject();
}

// Nothing when the pieces overlap or leave holes.
std::optional<LcmMessage> DatagramAssembler::join(Unfinished& message) {
  size_t end = 0;
  for (const auto& [which, piece] : message.pieces) {
    if (piece.offset != end) return std::nullopt;
    end += piece.bytes.size();
  }
  if (end != message.size) return std::nullopt;
  LcmMessage whole{std::move(message.channel), {}};
  whole.bytes.reserve(end);
  for (const auto& [which, piece] : message.pieces) {
    whole.bytes.insert(whole.bytes.end(), piece.bytes.begin(), piece.bytes.end());
  }
  return whole;
}

}  // namespace foresight
