// A hash table of the facets of a cell complex: three vertices → one of the (at most two) slots
// that lie on them. Open addressing with linear probing; deletion shifts back, so that it never
// fills up with markers. 16 to 32 bytes per facet.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/check.h"

namespace foresight {

/// The vertices of a facet in ascending order, and whether sorting them took an odd permutation of
/// the outward order: the two cells of a facet see it with opposite parity.
struct FacetKey {
  std::array<int32_t, 3> vertices{};
  bool odd = false;

  static FacetKey sorted(std::array<int32_t, 3> v) {
    bool odd = false;
    const auto order = [&](int32_t& a, int32_t& b) {
      if (a > b) std::swap(a, b), odd = !odd;
    };
    order(v[0], v[1]);
    order(v[1], v[2]);
    order(v[0], v[1]);
    return {v, odd};
  }
  uint32_t hash() const {
    uint64_t h = static_cast<uint32_t>(vertices[0]);
    h = (h << 32 | static_cast<uint32_t>(vertices[1])) * 0x9E3779B97F4A7C15u;
    h = ((h ^ h >> 29) + static_cast<uint32_t>(vertices[2])) * 0xBF58476D1CE4E5B9u;
    return static_cast<uint32_t>(h >> 32);
  }
};

class FacetTable {
 public:
  struct Entry {
    int32_t slot = -1;  // −1: empty
    uint32_t hash = 0;
  };

  int32_t size() const { return size_; }
  void clear() {
    entries_.clear();
    size_ = 0;
  }

  /// Room for so many entries, at once.
  void reserve(size_t size) {
    size_t capacity = std::max<size_t>(entries_.size(), 64);
    while (capacity < 2 * size) capacity *= 2;
    if (capacity > entries_.size()) grow_to(capacity);
  }

  /// The entry with this hash whose slot satisfies `matches`, or a null pointer. Valid until the
  /// next insert or erase.
  template <typename Matches>
  Entry* find(uint32_t hash, const Matches& matches) {
    if (entries_.empty()) return nullptr;
    for (size_t i = hash & mask(); entries_[i].slot >= 0; i = (i + 1) & mask()) {
      if (entries_[i].hash == hash && matches(entries_[i].slot)) return &entries_[i];
    }
    return nullptr;
  }

  void insert(uint32_t hash, int32_t slot) {
    if (entries_.size() < 2 * static_cast<size_t>(size_ + 1)) {
      grow_to(std::max<size_t>(64, 2 * entries_.size()));
    }
    place({slot, hash});
    ++size_;
  }

  void erase(const Entry* entry) {
    size_t hole = static_cast<size_t>(entry - entries_.data());
    FORESIGHT_CHECK(hole < entries_.size() && size_ > 0);
    for (size_t i = (hole + 1) & mask(); entries_[i].slot >= 0; i = (i + 1) & mask()) {
      // An entry may move back to the hole unless its home lies behind the hole.
      const size_t home = entries_[i].hash & mask();
      if (((i - home) & mask()) < ((i - hole) & mask())) continue;
      entries_[hole] = entries_[i];
      hole = i;
    }
    entries_[hole] = Entry{};
    --size_;
  }

 private:
  size_t mask() const { return entries_.size() - 1; }
  void place(const Entry& entry) {
    size_t i = entry.hash & mask();
    while (entries_[i].slot >= 0) i = (i + 1) & mask();
    entries_[i] = entry;
  }
  void grow_to(size_t capacity) {
    std::vector<Entry> old(capacity);
    old.swap(entries_);
    for (const Entry& entry : old) {
      if (entry.slot >= 0) place(entry);
    }
  }

  std::vector<Entry> entries_;  // a power of two, at most half full
  int32_t size_ = 0;
};

}  // namespace foresight
