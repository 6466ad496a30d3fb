// Checks a datagram against the layout of its type before it is decoded, because lcm-gen's decoders
// resize vectors by counts they have not checked: a 50-byte datagram could make them allocate 2 GB
// or read out of bounds. The tables are generated from the .lcm files (lcmtypes/).
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

/// Empty when `bytes` (8 bytes fingerprint, then the fields) is exactly one message of that layout
/// with non-negative counts and finite floats; otherwise one line that says what is wrong where.
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
