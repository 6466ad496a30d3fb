// Any message of ours as text, from its layout table: for people who look into logs, and for tests
// that compare recorded behaviour with a reference field by field.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/message_check.h"

namespace foresight {

/// One line of the text form: `path` names the field ("pose.quality", "point_ids"), `value` its
/// value. Arrays of up to 8 numbers are written out; longer ones as "n=… sum=… min=… max=…", byte
/// arrays as "n=… crc32=…".
struct MessageField {
  std::string path;
  std::string value;
};

/// `bytes` must have passed find_layout_error() for this schema.
std::vector<MessageField> message_fields(const MessageSchema& schema,
                                         std::span<const uint8_t> bytes);

/// Layout of the type that a datagram's fingerprint names, or nullptr.
const MessageSchema* identify_message(std::span<const uint8_t> bytes);

}  // namespace foresight
