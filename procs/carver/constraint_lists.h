// The constraints that cross each cell, and those that end in front of it: lists of 4-byte entries
// in pooled blocks.
//
// An entry is a ray number and how the ray enters the cell (segment_walker.h). The code tells, when
// the cell is destroyed, at which facet of the changed region the ray must be taken up again, so no
// ray is ever tested against a cell to find out. Counted by code, the entries are the cell's votes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/carving_delta.h"
#include "procs/carver/grow.h"
#include "procs/carver/segment_walker.h"

namespace foresight::carving {

inline constexpr int32_t kMaxRays = 1 << 29;

constexpr uint32_t make_entry(int32_t ray, uint32_t code) {
  return static_cast<uint32_t>(ray) << 3 | code;
}
constexpr int32_t entry_ray(uint32_t entry) { return static_cast<int32_t>(entry >> 3); }
constexpr uint32_t entry_code(uint32_t entry) { return entry & 7U; }

class ConstraintLists {
 public:
  /// Makes room for cells 0 … cells − 1; new ones have empty lists.
  void resize(size_t cells) { grow_to(lists_, cells); }
  /// Forgets all lists and frees the memory.
  void reset();

  std::span<const uint32_t> entries(int32_t cell) const {
    const List& list = at(cell);
    return {list.data, list.count.entries};
  }
  /// Constraints that cross the cell; entries of those that end in front of it are not among them.
  uint32_t constraints(int32_t cell) const {
    return at(cell).count.entries - at(cell).count.by_code[kEntryEnd];
  }
  CellVotes votes(int32_t cell) const;
  size_t cells() const { return lists_.size(); }
  void push(int32_t cell, uint32_t entry) {
    List& list = at(cell);
    touch(cell, list);
    if (list.count.entries == list.capacity()) grow(list);
    list.data[list.count.entries] = entry;
    list.count.add(entry, 1);
    pairs_ += entry_code(entry) != kEntryEnd;
  }
  void replace(int32_t cell, size_t index, uint32_t entry) {
    List& list = at(cell);
    touch(cell, list);
    list.count.add(list.data[index], -1);
    list.count.add(entry, 1);
    list.data[index] = entry;
  }
  /// Drops the entries for which `drop(entry)` holds; keeps the order of the others.
  template <class Drop>
  void filter(int32_t cell, Drop&& drop);
  /// The cell is gone: its list is emptied and its memory reused.
  void release(int32_t cell);

  /// Cells whose counts are not what they were when this was last called (or are gone since).
  std::vector<int32_t> take_changed();

  /// Sum of all cells' constraints.
  int64_t pairs() const { return pairs_; }
  size_t memory_bytes() const;
  /// Of memory_bytes(), what the lists themselves need: the rest is room for others.
  size_t list_bytes() const { return list_entries_ * sizeof(uint32_t); }
  /// Moves all lists to new memory and frees the old; for a moment there are both.
  void compact();

 private:
  struct Count {
    uint32_t entries = 0;
    std::array<uint32_t, kCountedCodes> by_code{};
    void add(uint32_t entry, int32_t one) {
      entries += static_cast<uint32_t>(one);
      if (entry_code(entry) < kCountedCodes)
        by_code[entry_code(entry)] += static_cast<uint32_t>(one);
    }
    bool operator==(const Count&) const = default;
  };
  struct List {
    uint32_t* data = nullptr;
    Count count;
    uint8_t log_capacity = 0;  // 0: no block
    bool touched = false;
    uint32_t capacity() const { return log_capacity == 0 ? 0 : 1U << log_capacity; }
  };
  struct Touched {
    int32_t cell = 0;
    int32_t before = -1;  // in counts_before_; −1: all zero
  };
  static constexpr size_t kChunk = 1 << 16;  // entries

  List& at(int32_t cell) { return lists_[static_cast<size_t>(cell)]; }
  const List& at(int32_t cell) const { return lists_[static_cast<size_t>(cell)]; }
  void touch(int32_t cell, List& list) {
    if (list.touched) return;
    list.touched = true;
    const bool empty = list.count.entries == 0;
    touched_.push_back({cell, empty ? -1 : static_cast<int32_t>(counts_before_.size())});
    if (!empty) counts_before_.push_back(list.count);
  }
  void grow(List& list);
  uint32_t* take_block(uint8_t log_capacity);
  void give_block(List& list);

  std::vector<List> lists_;
  std::array<std::vector<uint32_t*>, 32> spare_;  // by log2 of the capacity
  std::vector<std::unique_ptr<uint32_t[]>> chunks_;
  size_t chunk_used_ = kChunk;
  size_t pool_entries_ = 0;  // allocated
  size_t list_entries_ = 0;  // of these, in lists
  std::vector<Touched> touched_;
  std::vector<Count> counts_before_;
  int64_t pairs_ = 0;
};

template <class Drop>
void ConstraintLists::filter(int32_t cell, Drop&& drop) {
  List& list = at(cell);
  uint32_t kept = 0;
  while (kept < list.count.entries && !drop(list.data[kept])) ++kept;
  if (kept == list.count.entries) return;
  touch(cell, list);
  for (uint32_t n = kept, all = list.count.entries; n < all; ++n) {
    const uint32_t entry = list.data[n];
    if (!drop(entry)) {
      list.data[kept++] = entry;
      continue;
    }
    list.count.add(entry, -1);
    pairs_ -= entry_code(entry) != kEntryEnd;
  }
}

}  // namespace foresight::carving
