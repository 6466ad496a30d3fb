// A hash table of the facets of a cell complex: three vertices → one of the (at most two) slots
// that lie on them. Open addressing with linear probing; deletion shifts back, so that it never
// fills up with markers. An entry holds the vertices too: looking one up touches the table alone.
// 32 to 64 bytes per facet.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/check.h"
#include "procs/mesher/vertex_table.h"

namespace foresight {

/// A corner of a cell, and the facet opposite to it: number 4 · cell + corner.
using Slot = Id<struct CellSlotTag>;

constexpr Slot slot_of(CellId cell, int32_t corner) { return Slot(4 * cell.value() + corner); }
constexpr CellId cell_of(Slot slot) { return CellId(slot.value() / 4); }
constexpr int32_t corner_of(Slot slot) { return slot.value() % 4; }
/// The four of a cell.
constexpr IdRange<Slot> slots_of(CellId cell) { return {slot_of(cell, 0), slot_of(cell, 4)}; }

/// A facet as one of its cells sees it: counter-clockwise from outside, the smallest vertex first.
/// The other cell sees it reversed.
struct FacetKey {
  std::array<VertexIndex, 3> vertices{};

  static FacetKey of(const std::array<VertexIndex, 3>& outward) {
    const auto [a, b, c] = outward;
    if (a < b && a < c) return {{a, b, c}};
    return b < c ? FacetKey{{b, c, a}} : FacetKey{{c, a, b}};
  }
  FacetKey reversed() const { return {{vertices[0], vertices[2], vertices[1]}}; }
  bool operator==(const FacetKey&) const = default;

  /// The same from both sides.
  uint32_t hash() const {
    const auto [low, high] = std::minmax(vertices[1], vertices[2]);
    uint64_t h = vertices[0].index();
    h = (h << 32 | low.index()) * 0x9E3779B97F4A7C15u;
    h = ((h ^ h >> 29) + high.index()) * 0xBF58476D1CE4E5B9u;
    return static_cast<uint32_t>(h >> 32);
  }
};

class FacetTable {
 public:
  struct Entry {
    Slot slot;     // none: empty
    FacetKey key;  // as the slot's cell sees it
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

  /// The entry of this facet, seen from either side, or a null pointer. Valid until the next insert
  /// or erase.
  Entry* find(const FacetKey& key) {
    if (entries_.empty()) return nullptr;
    const FacetKey reversed = key.reversed();
    for (size_t i = key.hash() & mask(); entries_[i].slot.is_valid(); i = (i + 1) & mask()) {
      if (entries_[i].key == key || entries_[i].key == reversed) return &entries_[i];
    }
    return nullptr;
  }

  void insert(const FacetKey& key, Slot slot) {
    if (std::ssize(entries_) < 2 * (size_ + 1)) {
      grow_to(std::max<size_t>(64, 2 * entries_.size()));
    }
    place({slot, key});
    ++size_;
  }

  void erase(const Entry* entry) {
    size_t hole = entry - entries_.data();
    FORESIGHT_CHECK(hole < entries_.size() && size_ > 0);
    for (size_t i = (hole + 1) & mask(); entries_[i].slot.is_valid(); i = (i + 1) & mask()) {
      // An entry may move back to the hole unless its home lies behind the hole.
      const size_t home = entries_[i].key.hash() & mask();
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
    size_t i = entry.key.hash() & mask();
    while (entries_[i].slot.is_valid()) i = (i + 1) & mask();
    entries_[i] = entry;
  }
  void grow_to(size_t capacity) {
    std::vector<Entry> old(capacity);
    old.swap(entries_);
    for (const Entry& entry : old) {
      if (entry.slot.is_valid()) place(entry);
    }
  }

  std::vector<Entry> entries_;  // a power of two, at most half full
  int32_t size_ = 0;
};

}  // namespace foresight
