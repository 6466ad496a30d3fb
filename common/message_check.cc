#include "common/message_check.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/byte_order.h"

namespace foresight {
namespace {

constexpr size_t kMaxFields = 64;

size_t size_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::kInt8:
    case FieldKind::kByte:
      return 1;
    case FieldKind::kInt16:
      return 2;
    case FieldKind::kInt32:
    case FieldKind::kFloat:
      return 4;
    case FieldKind::kInt64:
    case FieldKind::kDouble:
      return 8;
    case FieldKind::kString:
      return 5;  // at least: length and NUL
    case FieldKind::kStruct:
      return 0;  // see smallest_size
  }
  return 0;
}

// The least number of bytes that one element of a field occupies.
size_t smallest_size(const FieldSchema& field) {
  if (field.kind != FieldKind::kStruct) return size_of(field.kind);
  size_t sum = 0;
  for (const FieldSchema& f : field.nested->fields) {
    size_t n = smallest_size(f);
    for (const FieldDimension& d : f.dimensions) n *= d.size_field < 0 ? d.constant : 0;
    sum += n;
  }
  return sum;
}

bool is_instant(const FieldSchema& field) {
  const std::string_view name = field.name;
  return name.find("utime") != std::string_view::npos || name.ends_with("epoch") ||
         name.ends_with("session");
}

// Walks the bytes once; `error` stays empty while all is well.
class Walker {
 public:
  explicit Walker(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  bool walk(const MessageSchema& schema) {
    std::array<int64_t, kMaxFields> integers{};
    for (size_t i = 0; i < schema.fields.size(); ++i) {
      const FieldSchema& field = schema.fields[i];
      size_t count = 1;
      if (!count_elements(field, integers, &count)) return false;
      if (!walk_elements(field, count, &integers[i])) return false;
    }
    return true;
  }
  size_t position() const { return position_; }
  const std::string& error() const { return error_; }

 private:
  bool fail(const FieldSchema& field, const std::string& what) {
    error_ = std::string(field.name) + ": " + what;
    return false;
  }
  size_t remaining() const { return bytes_.size() - position_; }

  bool count_elements(const FieldSchema& field, const std::array<int64_t, kMaxFields>& integers,
                      size_t* count) {
    const size_t smallest = smallest_size(field);
    for (const FieldDimension& d : field.dimensions) {
      const int64_t n = d.size_field < 0 ? d.constant : integers[d.size_field];
      if (n < 0) return fail(field, "negative count " + std::to_string(n));
      // Bounding after each factor keeps the product from overflowing.
      if (n > 0 && *count > remaining() / static_cast<size_t>(n)) {
        return fail(field, "count " + std::to_string(n) + " exceeds the message");
      }
      *count *= static_cast<size_t>(n);
    }
    if (smallest > 0 && *count > remaining() / smallest) return fail(field, "truncated");
    return true;
  }

  bool walk_elements(const FieldSchema& field, size_t count, int64_t* integer) {
    if (field.kind == FieldKind::kByte || field.kind == FieldKind::kInt8) {
      if (count == 1) *integer = static_cast<int8_t>(bytes_[position_]);
      position_ += count;
      return true;
    }
    for (size_t i = 0; i < count; ++i) {
      if (!walk_one(field, integer)) return false;
    }
    return true;
  }

  bool walk_one(const FieldSchema& field, int64_t* integer) {
    if (field.kind == FieldKind::kStruct) return walk(*field.nested);
    if (field.kind == FieldKind::kString) return walk_string(field);
    const size_t size = size_of(field.kind);
    if (remaining() < size) return fail(field, "truncated");
    const uint64_t raw = read_big_endian(&bytes_[position_], size);
    position_ += size;
    switch (field.kind) {
      case FieldKind::kFloat:
        if (!std::isfinite(std::bit_cast<float>(static_cast<uint32_t>(raw)))) {
          return fail(field, "not finite");
        }
        break;
      case FieldKind::kDouble:
        if (!std::isfinite(std::bit_cast<double>(raw))) return fail(field, "not finite");
        break;
      case FieldKind::kInt16:
        *integer = static_cast<int16_t>(raw);
        break;
      case FieldKind::kInt32:
        *integer = static_cast<int32_t>(raw);
        break;
      default:
        *integer = static_cast<int64_t>(raw);
        if ((*integer >= kMaxInstant_us || *integer <= -kMaxInstant_us) && is_instant(field)) {
          return fail(field, "no instant of this age: " + std::to_string(*integer));
        }
    }
    return true;
  }

  bool walk_string(const FieldSchema& field) {
    if (remaining() < 5) return fail(field, "truncated");
    const auto length = static_cast<int32_t>(read_big_endian(&bytes_[position_], 4));
    position_ += 4;
    if (length < 1 || static_cast<size_t>(length) > remaining()) return fail(field, "bad length");
    if (std::memchr(&bytes_[position_], 0, length) != &bytes_[position_ + length - 1]) {
      return fail(field, "string without its end");
    }
    position_ += length;
    return true;
  }

  std::span<const uint8_t> bytes_;
  size_t position_ = 8;  // behind the fingerprint
  std::string error_;
};

}  // namespace

size_t max_message_bytes(const MessageSchema& schema) {
  const std::string_view name = schema.name;
  if (name == "image_t" || name == "view_t") return 64'000'000;
  if (name == "mesh_t") return 32'000'000;
  if (name == "map_delta_t" || name == "carving_delta_t") return 1'000'000;
  return 64'000;
}

std::string find_layout_error(const MessageSchema& schema, std::span<const uint8_t> bytes) {
  if (bytes.size() < 8) return "shorter than a fingerprint";
  if (bytes.size() > max_message_bytes(schema)) {
    return std::string(schema.name) + ": " + std::to_string(bytes.size()) +
           " bytes, its kind has at most " + std::to_string(max_message_bytes(schema));
  }
  Walker walker(bytes);
  if (!walker.walk(schema)) return std::string(schema.name) + "." + walker.error();
  if (walker.position() != bytes.size()) {
    return std::string(schema.name) + ": " + std::to_string(bytes.size() - walker.position()) +
           " bytes too long";
  }
  return {};
}

}  // namespace foresight
