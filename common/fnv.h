// FNV-1a (Fowler, Noll, Vo), 64 bits: whether bytes are the same. No protection from malice.
//
//   Fnv1a hash;
//   hash.add(bytes);             // anything that is a range of plain values without padding
//   hash.add_value(number);
//   hash.value()
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace foresight {

class Fnv1a {
 public:
  template <class Range>
  void add(const Range& range) {
    for (const std::byte b : std::as_bytes(std::span(range))) {
      value_ = (value_ ^ static_cast<uint64_t>(b)) * 1099511628211u;
    }
  }
  template <class T>
  void add_value(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    add(std::span(&value, 1));
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 14695981039346656037u;
};

}  // namespace foresight
