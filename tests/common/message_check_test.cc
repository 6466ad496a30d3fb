// Hostile datagrams: whatever arrives, the check neither crashes nor allocates, and what it accepts
// the generated decoder can decode.
#include "common/message_check.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <limits>
#include <random>

#include "common/byte_order.h"
#include "tests/common/all_messages.h"

namespace foresight {
namespace {

using Bytes = std::vector<uint8_t>;

class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  uint32_t operator()() { return static_cast<uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

void overwrite(Bytes* bytes, size_t at, uint64_t value, size_t size) {
  Bytes replacement;
  append_big_endian(&replacement, value, size);
  std::copy(replacement.begin(), replacement.end(), bytes->begin() + static_cast<long>(at));
}

// Writes random valid messages and remembers where what is in them.
class MessageWriter {
 public:
  explicit MessageWriter(uint32_t seed) : random_(seed) {}

  Bytes write(const MessageSchema& schema, int64_t fingerprint) {
    bytes_.clear();
    floats_.clear();
    counts_.clear();
    append_big_endian(&bytes_, static_cast<uint64_t>(fingerprint), 8);
    write_fields(schema);
    return bytes_;
  }
  struct Place {
    size_t offset, size;
  };
  const std::vector<Place>& floats() const { return floats_; }
  const std::vector<Place>& counts() const { return counts_; }

 private:
  static bool is_count(const MessageSchema& schema, size_t index) {
    for (const FieldSchema& f : schema.fields) {
      for (const FieldDimension& d : f.dimensions) {
        if (d.size_field == static_cast<int>(index)) return true;
      }
    }
    return false;
  }
  static size_t width(FieldKind kind) {
    switch (kind) {
      case FieldKind::kInt8:
      case FieldKind::kByte:
        return 1;
      case FieldKind::kInt16:
        return 2;
      case FieldKind::kInt32:
      case FieldKind::kFloat:
        return 4;
      default:
        return 8;
    }
  }
  void write_fields(const MessageSchema& schema) {
    std::array<uint64_t, 64> values{};
    for (size_t i = 0; i < schema.fields.size(); ++i) {
      const FieldSchema& field = schema.fields[i];
      size_t count = 1;
      for (const FieldDimension& d : field.dimensions) {
        count *= d.size_field < 0 ? static_cast<size_t>(d.constant) : values[d.size_field];
      }
      if (is_count(schema, i)) {
        values[i] = random_() % 4;
        counts_.push_back({bytes_.size(), width(field.kind)});
        append_big_endian(&bytes_, values[i], width(field.kind));
        continue;
      }
      for (size_t k = 0; k < count; ++k) write_element(field);
    }
  }
  void write_element(const FieldSchema& field) {
    switch (field.kind) {
      case FieldKind::kStruct:
        return write_fields(*field.nested);
      case FieldKind::kString:
        return write_string();
      case FieldKind::kFloat:
        floats_.push_back({bytes_.size(), 4});
        return append_big_endian(&bytes_,
                                 std::bit_cast<uint32_t>(static_cast<float>(random_()) * 1e-6f), 4);
      case FieldKind::kDouble:
        floats_.push_back({bytes_.size(), 8});
        return append_big_endian(&bytes_,
                                 std::bit_cast<uint64_t>(static_cast<double>(random_()) * 1e-6), 8);
      default:
        return append_big_endian(&bytes_, random_(), width(field.kind));
    }
  }
  void write_string() {
    const uint32_t length = random_() % 12;
    append_big_endian(&bytes_, length + 1, 4);
    for (uint32_t i = 0; i < length; ++i)
      bytes_.push_back(static_cast<uint8_t>('a' + random_() % 26));
    bytes_.push_back(0);
  }

  Random random_;
  Bytes bytes_;
  std::vector<Place> floats_, counts_;
};

template <class Message>
const MessageSchema& schema_of() {
  return *find_schema(Message::getTypeName());
}

template <class Message>
std::string check(const Bytes& bytes) {
  return find_layout_error(schema_of<Message>(), bytes);
}

// What the check accepts must decode to its end. False when it was refused.
template <class Message>
bool accepted_and_decoded(const Bytes& bytes) {
  if (!check<Message>(bytes).empty()) return false;
  Message message;
  EXPECT_EQ(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())),
            static_cast<int>(bytes.size()))
      << Message::getTypeName();
  return true;
}

template <class Call>
void for_each_valid(int rounds, const Call& call) {
  for_each_message(AllMessages{}, [&]<class Message>() {
    for (int i = 0; i < rounds; ++i) {
      MessageWriter writer(static_cast<uint32_t>(1000 + i));
      const Bytes bytes = writer.write(schema_of<Message>(), Message::getHash());
      call.template operator()<Message>(bytes, writer);
    }
  });
}

TEST(MessageCheck, AcceptsValidMessagesAndTheyDecodeToTheSameBytes) {
  for_each_valid(200, []<class Message>(const Bytes& bytes, const MessageWriter&) {
    ASSERT_EQ(check<Message>(bytes), "");
    Message message;
    const int size = static_cast<int>(bytes.size());
    ASSERT_EQ(message.decode(bytes.data(), 0, size), size);
    ASSERT_EQ(message.getEncodedSize(), size);
    Bytes again(bytes.size());
    message.encode(again.data(), 0, size);
    ASSERT_EQ(again, bytes) << Message::getTypeName();
  });
}

TEST(MessageCheck, RefusesEveryTruncation) {
  for_each_valid(20, []<class Message>(const Bytes& bytes, const MessageWriter&) {
    for (size_t size = 0; size < bytes.size(); ++size) {
      // An own allocation of just this size, so that the sanitizer sees a read beyond it.
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<long>(size));
      ASSERT_NE(check<Message>(cut), "") << Message::getTypeName() << " cut to " << size;
    }
  });
}

TEST(MessageCheck, RefusesTrailingBytes) {
  for_each_valid(20, []<class Message>(Bytes bytes, const MessageWriter&) {
    bytes.push_back(0);
    EXPECT_NE(check<Message>(bytes), "") << Message::getTypeName();
  });
}

TEST(MessageCheck, RefusesHostileCounts) {
  for_each_valid(20, []<class Message>(const Bytes& bytes, const MessageWriter& writer) {
    for (const auto& place : writer.counts()) {
      for (const int64_t count : {INT64_C(-1), INT64_C(1000), INT64_C(0x7fffffff),
                                  INT64_C(-0x80000000), INT64_C(0x40000000)}) {
        Bytes hostile = bytes;
        overwrite(&hostile, place.offset, static_cast<uint64_t>(count), place.size);
        ASSERT_NE(check<Message>(hostile), "")
            << Message::getTypeName() << " with count " << count << " at " << place.offset;
      }
    }
  });
}

TEST(MessageCheck, RefusesNumbersThatAreNotFinite) {
  for_each_valid(20, []<class Message>(const Bytes& bytes, const MessageWriter& writer) {
    for (const auto& place : writer.floats()) {
      for (const double bad :
           {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()}) {
        Bytes hostile = bytes;
        const uint64_t raw = place.size == 8 ? std::bit_cast<uint64_t>(bad)
                                             : std::bit_cast<uint32_t>(static_cast<float>(bad));
        overwrite(&hostile, place.offset, raw, place.size);
        ASSERT_NE(check<Message>(hostile).find("not finite"), std::string::npos)
            << Message::getTypeName() << " at " << place.offset;
      }
    }
  });
}

TEST(MessageCheck, SurvivesRandomMutations) {
  Random random(5);
  int64_t accepted = 0, refused = 0;
  for_each_valid(300, [&]<class Message>(const Bytes& bytes, const MessageWriter&) {
    for (int i = 0; i < 20; ++i) {
      Bytes mutated = bytes;
      for (uint32_t n = 1 + random() % 6; n > 0; --n) {
        mutated[8 + random() % (mutated.size() - 8)] = static_cast<uint8_t>(random());
      }
      ++(accepted_and_decoded<Message>(mutated) ? accepted : refused);
    }
  });
  EXPECT_GT(accepted, 1000) << "the mutations are too wild to test the decoders";
  EXPECT_GT(refused, 1000) << "the mutations are too tame";
}

TEST(MessageCheck, SurvivesRandomBytes) {
  Random random(6);
  for_each_message(AllMessages{}, [&]<class Message>() {
    for (int i = 0; i < 5000; ++i) {
      Bytes bytes;
      append_big_endian(&bytes, static_cast<uint64_t>(Message::getHash()), 8);
      // Mostly small numbers, so that some counts are plausible.
      for (uint32_t n = random() % 300; n > 0; --n) {
        bytes.push_back(random() % 3 == 0 ? static_cast<uint8_t>(random()) : 0);
      }
      accepted_and_decoded<Message>(bytes);
    }
  });
}

TEST(MessageCheck, SurvivesDatagramsWithoutAFingerprint) {
  for_each_message(AllMessages{}, []<class Message>() {
    EXPECT_NE(check<Message>({}), "");
    EXPECT_NE(check<Message>({1, 2, 3}), "");
  });
}

TEST(MessageCheck, RefusesInstantsThatNoClockShows) {
  delta_header_t header{};
  header.epoch = INT64_C(9'000'000'000'000'000'000);
  map_delta_t delta{};
  delta.header = header;
  Bytes bytes(static_cast<size_t>(delta.getEncodedSize()));
  delta.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  EXPECT_EQ(check<map_delta_t>(bytes),
            "map_delta_t.epoch: no instant of this age: 9000000000000000000");
  delta.header.epoch = kMaxInstant_us - 1;
  delta.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  EXPECT_EQ(check<map_delta_t>(bytes), "");
}

TEST(MessageCheck, BoundsEveryKindOfMessage) {
  mesh_t mesh{};
  mesh.n_vertices = 10'000'000;  // well-formed
  mesh.vertex_ids.resize(10'000'000);
  mesh.vertex_confidences.resize(10'000'000);
  Bytes bytes(static_cast<size_t>(mesh.getEncodedSize()));
  mesh.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  EXPECT_NE(check<mesh_t>(bytes).find("its kind has at most 32000000"), std::string::npos);
  for (const MessageSchema* schema : all_schemas()) {
    EXPECT_GE(max_message_bytes(*schema), 64'000u) << schema->name;
    EXPECT_LE(max_message_bytes(*schema), 64'000'000u) << schema->name;
  }
}

TEST(MessageCheck, NamesTheFieldAndTheReason) {
  MessageWriter writer(1);
  const Bytes bytes = writer.write(schema_of<image_t>(), image_t::getHash());
  const Bytes cut(bytes.begin(), bytes.begin() + 20);
  EXPECT_EQ(check<image_t>(cut), "image_t.width_px: truncated");
}

TEST(MessageCheck, KnowsTypesByName) {
  EXPECT_EQ(find_schema("image_t")->name, std::string("image_t"));
  EXPECT_EQ(find_schema("no_such_t"), nullptr);
}

}  // namespace
}  // namespace foresight
