#include "common/message_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>

#include "common/byte_order.h"

namespace foresight {
namespace {

constexpr size_t kWrittenOut = 8;

uint32_t crc32(std::span<const uint8_t> bytes) {
  uint32_t crc = 0xFFFFFFFFu;
  for (uint8_t b : bytes) {
    crc ^= b;
    for (int i = 0; i < 8; ++i) crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

std::string text_of(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", v);
  return text;
}

// Integers up to 64 bits exactly, floats as they are.
struct Number {
  bool is_integer = true;
  int64_t integer = 0;
  double real = 0;
  std::string text() const { return is_integer ? std::to_string(integer) : text_of(real); }
  double value() const { return is_integer ? static_cast<double>(integer) : real; }
};

class TextWalker {
 public:
  explicit TextWalker(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  void walk(const MessageSchema& schema, const std::string& prefix) {
    std::vector<int64_t> integers(schema.fields.size());
    for (size_t i = 0; i < schema.fields.size(); ++i) {
      const FieldSchema& field = schema.fields[i];
      size_t count = 1;
      for (const FieldDimension& d : field.dimensions) {
        count *= static_cast<size_t>(d.size_field < 0 ? d.constant : integers[d.size_field]);
      }
      write(field, prefix + field.name, count, &integers[i]);
    }
  }
  std::vector<MessageField> take() { return std::move(fields_); }

 private:
  uint64_t raw(size_t size) {
    position_ += size;
    return read_big_endian(&bytes_[position_ - size], size);
  }
  Number number(FieldKind kind) {
    switch (kind) {
      case FieldKind::kInt8:
        return {true, static_cast<int8_t>(raw(1)), 0};
      case FieldKind::kByte:
        return {true, static_cast<int64_t>(raw(1)), 0};
      case FieldKind::kInt16:
        return {true, static_cast<int16_t>(raw(2)), 0};
      case FieldKind::kInt32:
        return {true, static_cast<int32_t>(raw(4)), 0};
      case FieldKind::kFloat:
        return {false, 0, std::bit_cast<float>(static_cast<uint32_t>(raw(4)))};
      case FieldKind::kDouble:
        return {false, 0, std::bit_cast<double>(raw(8))};
      default:
        return {true, static_cast<int64_t>(raw(8)), 0};
    }
  }
  std::string string() {
    const auto length = static_cast<size_t>(raw(4));
    std::string text(reinterpret_cast<const char*>(&bytes_[position_]), length - 1);
    position_ += length;
    return '"' + text + '"';
  }
  void write(const FieldSchema& field, const std::string& path, size_t count, int64_t* integer) {
    if (field.kind == FieldKind::kStruct) {
      for (size_t i = 0; i < count; ++i) {
        walk(*field.nested,
             path + (field.dimensions.empty() ? "" : "[" + std::to_string(i) + "]") + ".");
      }
    } else if (field.kind == FieldKind::kString) {
      std::string text;
      for (size_t i = 0; i < count; ++i) text += (i > 0 ? " " : "") + string();
      fields_.push_back({path, text});
    } else if (field.kind == FieldKind::kByte) {
      fields_.push_back({path, "n=" + std::to_string(count) + " crc32=" +
                                   std::to_string(crc32(bytes_.subspan(position_, count)))});
      position_ += count;
    } else {
      write_numbers(field.kind, path, count, integer);
    }
  }
  void write_numbers(FieldKind kind, const std::string& path, size_t count, int64_t* integer) {
    std::string text;
    double sum = 0, least = 0, most = 0;
    for (size_t i = 0; i < count; ++i) {
      const Number n = number(kind);
      if (count == 1) *integer = n.integer;
      if (count <= kWrittenOut) text += (i > 0 ? " " : "") + n.text();
      least = i == 0 ? n.value() : std::min(least, n.value());
      most = i == 0 ? n.value() : std::max(most, n.value());
      sum += n.value();
    }
    if (count > kWrittenOut) {
      text = "n=" + std::to_string(count) + " sum=" + text_of(sum) + " min=" + text_of(least) +
             " max=" + text_of(most);
    }
    fields_.push_back({path, text});
  }

  std::span<const uint8_t> bytes_;
  size_t position_ = 8;
  std::vector<MessageField> fields_;
};

}  // namespace

std::vector<MessageField> message_fields(const MessageSchema& schema,
                                         std::span<const uint8_t> bytes) {
  TextWalker walker(bytes);
  walker.walk(schema, "");
  return walker.take();
}

const MessageSchema* identify_message(std::span<const uint8_t> bytes) {
  if (bytes.size() < 8) return nullptr;
  const uint64_t fingerprint = read_big_endian(bytes.data(), 8);
  for (const MessageSchema* schema : all_schemas()) {
    if (static_cast<uint64_t>(schema->fingerprint()) == fingerprint) return schema;
  }
  return nullptr;
}

}  // namespace foresight
