#include "common/datagram_assembler.h"

#include <gtest/gtest.h>

#include <random>

namespace foresight {
namespace {

using Bytes = std::vector<uint8_t>;
constexpr uint64_t kSender = 7;

void put(Bytes* bytes, uint64_t value, int count) {
  for (int i = count - 1; i >= 0; --i) bytes->push_back(static_cast<uint8_t>(value >> (8 * i)));
}

void put(Bytes* bytes, const std::string& text) {
  bytes->insert(bytes->end(), text.begin(), text.end());
  bytes->push_back(0);
}

Bytes whole(const std::string& channel, const Bytes& payload) {
  Bytes d;
  put(&d, 0x4c433032, 4);
  put(&d, 1, 4);
  put(&d, channel);
  d.insert(d.end(), payload.begin(), payload.end());
  return d;
}

struct Piece {
  uint32_t number = 1, size = 0, offset = 0;
  uint16_t which = 0, count = 1;
  std::string channel = "MESH";
  Bytes bytes;
};

Bytes datagram(const Piece& p) {
  Bytes d;
  put(&d, 0x4c433033, 4);
  put(&d, p.number, 4);
  put(&d, p.size, 4);
  put(&d, p.offset, 4);
  put(&d, p.which, 2);
  put(&d, p.count, 2);
  if (p.which == 0) put(&d, p.channel);
  d.insert(d.end(), p.bytes.begin(), p.bytes.end());
  return d;
}

Bytes counting(size_t size) {
  Bytes bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(i * 31 + i / 256);
  return bytes;
}

// `payload` in pieces of 1000 bytes.
std::vector<Piece> pieces(uint32_t number, const Bytes& payload) {
  std::vector<Piece> all;
  const auto count = static_cast<uint16_t>((payload.size() + 999) / 1000);
  for (uint16_t i = 0; i < count; ++i) {
    const size_t from = i * size_t{1000}, to = std::min(payload.size(), from + 1000);
    all.push_back({number,
                   static_cast<uint32_t>(payload.size()),
                   static_cast<uint32_t>(from),
                   i,
                   count,
                   "MESH",
                   {payload.begin() + static_cast<std::ptrdiff_t>(from),
                    payload.begin() + static_cast<std::ptrdiff_t>(to)}});
  }
  return all;
}

TEST(DatagramAssembler, TakesAWholeMessage) {
  DatagramAssembler assembler;
  const auto message = assembler.feed(kSender, whole("VIEW", {1, 2, 3}), 0);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, "VIEW");
  EXPECT_EQ(message->bytes, (Bytes{1, 2, 3}));
  EXPECT_TRUE(assembler.feed(kSender, whole("V", {}), 0)->bytes.empty());
}

TEST(DatagramAssembler, JoinsFragmentsInAnyOrderAndOfManySenders) {
  DatagramAssembler assembler;
  const Bytes payload = counting(12'345);
  auto all = pieces(5, payload);
  std::shuffle(all.begin(), all.end(), std::mt19937(1));
  int done = 0;
  for (const Piece& p : all) {
    for (uint64_t sender = 1; sender <= 3; ++sender) {
      if (const auto message = assembler.feed(sender, datagram(p), 0)) {
        EXPECT_EQ(message->channel, "MESH");
        EXPECT_EQ(message->bytes, payload);
        ++done;
      }
    }
  }
  EXPECT_EQ(done, 3);
  EXPECT_EQ(assembler.memory_bytes(), 0u);
  EXPECT_EQ(assembler.malformed() + assembler.incomplete(), 0);
}

// What makes liblcm write outside its memory: an offset near 2^32 that wraps with the size added.
TEST(DatagramAssembler, RefusesAnOffsetThatWraps) {
  DatagramAssembler assembler;
  for (const uint32_t offset : {0xffffffffu, 0xfffffff0u, 0x80000000u, 101u}) {
    EXPECT_FALSE(assembler.feed(
        kSender,
        datagram({.size = 100, .offset = offset, .which = 1, .count = 2, .bytes = counting(50)}),
        0));
  }
  EXPECT_EQ(assembler.malformed(), 4);
  EXPECT_EQ(assembler.memory_bytes(), 0u);
}

TEST(DatagramAssembler, RefusesWhatContradictsItself) {
  DatagramAssembler assembler;
  const std::vector<Piece> wrong = {
      {.size = 0xffffffff, .count = 1, .bytes = {}},               // absurd size
      {.size = 10, .which = 3, .count = 3, .bytes = counting(1)},  // the fourth of three
      {.size = 10, .which = 0, .count = 0, .bytes = {}},           // one of none
      {.size = 10, .count = 1, .bytes = counting(11)},             // more than announced
      {.size = 10, .count = 1, .bytes = counting(9)},              // less
      {.size = 10, .count = 1, .channel = std::string(80, 'C'), .bytes = counting(10)},
      {.size = 10, .count = 1, .channel = "", .bytes = counting(10)},
  };
  for (const Piece& p : wrong) EXPECT_FALSE(assembler.feed(kSender, datagram(p), 0));
  EXPECT_FALSE(assembler.feed(kSender, {}, 0));
  EXPECT_FALSE(assembler.feed(kSender, counting(500), 0));
  EXPECT_FALSE(assembler.feed(kSender, whole(std::string(64, 'C'), {1}), 0));
  EXPECT_EQ(assembler.malformed(), 10);
  EXPECT_EQ(assembler.memory_bytes(), 0u);
}

TEST(DatagramAssembler, RefusesOverlapsAndHoles) {
  DatagramAssembler assembler;
  const auto second_at = [&](uint32_t offset, size_t size) {
    Piece a{.size = 20, .which = 0, .count = 2, .bytes = counting(10)};
    Piece b{.size = 20, .offset = offset, .which = 1, .count = 2, .bytes = counting(size)};
    static uint32_t number = 0;
    a.number = b.number = ++number;
    EXPECT_FALSE(assembler.feed(kSender, datagram(a), 0));
    return assembler.feed(kSender, datagram(b), 0).has_value();
  };
  EXPECT_TRUE(second_at(10, 10));
  EXPECT_FALSE(second_at(9, 10));
  EXPECT_FALSE(second_at(11, 9));
  EXPECT_FALSE(second_at(0, 10));
}

TEST(DatagramAssembler, ANewNumberEndsTheOldMessage) {
  DatagramAssembler assembler;
  const Bytes payload = counting(2500);
  const auto old = pieces(1, payload), now = pieces(2, payload);
  assembler.feed(kSender, datagram(old[0]), 0);
  assembler.feed(kSender, datagram(now[0]), 0);
  assembler.feed(kSender, datagram(now[1]), 0);
  EXPECT_TRUE(assembler.feed(kSender, datagram(now[2]), 0));
  EXPECT_EQ(assembler.incomplete(), 1);
}

// Announced, never finished, from ever new senders: memory stays bounded, real messages get
// through.
TEST(DatagramAssembler, IsBoundedInMemory) {
  DatagramAssembler assembler;
  const Bytes part = counting(60'000);
  const Bytes payload = counting(5000);
  size_t most = 0;
  int arrived = 0;
  for (uint64_t i = 0; i < 6000; ++i) {
    assembler.feed(1000 + i,
                   datagram({.size = 60'000'000, .which = 0, .count = 2000, .bytes = part}),
                   static_cast<int64_t>(i) * 10);
    if (i % 100 == 0) {
      for (const Piece& p : pieces(static_cast<uint32_t>(i), payload)) {
        arrived += assembler.feed(kSender, datagram(p), static_cast<int64_t>(i) * 10) ? 1 : 0;
      }
    }
    most = std::max(most, assembler.memory_bytes());
  }
  EXPECT_LE(most, DatagramAssembler::kMemory_bytes + part.size());
  EXPECT_EQ(arrived, 60);
  assembler.feed(kSender, whole("C", {}), 60'000'000);
  EXPECT_EQ(assembler.memory_bytes(), 0u) << "what is old is given up";
}

// Flipped bits and cuts of real traffic: whole messages only, and none that nobody sent.
TEST(DatagramAssembler, SurvivesDamagedTraffic) {
  std::mt19937 random(3);
  DatagramAssembler assembler;
  const Bytes payload = counting(4200);
  for (uint32_t number = 1; number < 20'000; ++number) {
    for (const Piece& p : pieces(number, payload)) {
      Bytes d = datagram(p);
      const bool is_damaged = random() % 4 == 0;
      if (is_damaged) d[random() % 24] ^= static_cast<uint8_t>(1u << random() % 8);
      if (is_damaged && random() % 2 == 0) d.resize(random() % (d.size() + 1));
      const auto message = assembler.feed(random() % 3, d, number);
      if (message) {
        EXPECT_LE(message->bytes.size(), payload.size());
      }
    }
  }
  EXPECT_LT(assembler.memory_bytes(), 100'000u);
  EXPECT_GT(assembler.malformed(), 1000);
}

}  // namespace
}  // namespace foresight
