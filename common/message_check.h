// Checks a datagram against the layout of its type before it is decoded, because lcm-gen's decoders
// resize vectors by counts they have not checked: a 50-byte datagram could make them allocate 2 GB
// or read out of bounds. The tables are generated from the .lcm files (lcmtypes/).
//
// Checked too, for all processes at once, is what no message of ours can mean: numbers that are not
// finite, instants (fields with `utime` in their name, `epoch`, `session`) that no clock of this
// age shows, and more bytes than its kind ever has (max_message_bytes).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace foresight {

enum class FieldKind { kInt8, kByte, kInt16, kInt32, kInt64, kFloat, kDouble, kString, kStruct };

struct MessageSchema;

struct FieldDimension {
  int64_t constant;  // used when size_field < 0
  int size_field;    // index of the earlier integer field that holds the size
};

struct FieldSchema {
  const char* name;
  FieldKind kind;
  const MessageSchema* nested;
  std::vector<FieldDimension> dimensions;
};

struct MessageSchema {
  const char* name;
  std::vector<FieldSchema> fields;
  int64_t (*fingerprint)();  // lcm-gen's hash of the type
};

/// Layout of a message type by its name ("image_t"), or nullptr.
const MessageSchema* find_schema(std::string_view type_name);
const std::vector<const MessageSchema*>& all_schemas();

/// Greatest size of a message on the wire, by its kind; with it all counts are bounded. Images:
/// 64 MB (uncompressed, 21 megapixels); meshes: 32 MB (700 000 vertices); parts of deltas: 1 MB
/// (our senders split at kMaxDeltaBytes); all others: 64 kB.
size_t max_message_bytes(const MessageSchema& schema);

/// Instants lie within ± this many microseconds of 1970 (until the year 2255): differences and sums
/// of two do not overflow.
constexpr int64_t kMaxInstant_us = int64_t{1} << 53;

/// Empty when `bytes` (8 bytes fingerprint, then the fields) is exactly one message of that layout
/// with non-negative counts, finite floats, possible instants and no more bytes than its kind may
/// have; otherwise one line that says what is wrong where.
/// The fingerprint itself is not compared. Allocates nothing that depends on the contents.
std::string find_layout_error(const MessageSchema& schema, std::span<const uint8_t> bytes);

/// The message, or nothing when `bytes` are not exactly one of its type.
template <class Message>
std::optional<Message> decode_checked(std::span<const uint8_t> bytes) {
  Message message;
  if (!find_layout_error(*find_schema(Message::getTypeName()), bytes).empty() ||
      message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0) {
    return std::nullopt;
  }
  return message;
}

}  // namespace foresight
