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
  void resize(size_t cells) {
    lists_.resize(cells);
    reported_.resize(cells);
  }
  /// Forgets all lists and frees the memory.
  void reset();

  std::span<const uint32_t> entries(int32_t cell) const {
    const List& list = at(cell);
    return {list.data, list.size};
  }
  /// Constraints that cross the cell; entries of those that end in front of it are not among them.
  uint32_t constraints(int32_t cell) const { return at(cell).size - at(cell).counts[kEntryEnd]; }
  CellVotes votes(int32_t cell) const;
  size_t cells() const { return lists_.size(); }
  void push(int32_t cell, uint32_t entry) {
    List& list = at(cell);
    touch(cell, list);
    if (list.size == list.capacity) grow(list);
    list.data[list.size++] = entry;
    ++list.counts[entry_code(entry)];
    pairs_ += entry_code(entry) != kEntryEnd;
  }
  void replace(int32_t cell, size_t index, uint32_t entry) {
    List& list = at(cell);
    touch(cell, list);
    --list.counts[entry_code(list.data[index])];
    ++list.counts[entry_code(entry)];
    list.data[index] = entry;
  }
  /// Drops the entries for which `drop(entry)` holds; keeps the order of the others.
  template <class Drop>
  void filter(int32_t cell, Drop&& drop);
  /// The cell is gone: its list is emptied and its memory reused.
  void release(int32_t cell);

  /// Whether the cell's counts differ from those that receivers know; then they know these.
  bool report(int32_t cell);
  void report_all();
  /// Cells whose counts may differ from the reported ones; then there are none.
  std::vector<int32_t> take_touched();

  /// Sum of all cells' constraints.
  int64_t pairs() const { return pairs_; }
  size_t memory_bytes() const;

 private:
  struct List {
    uint32_t* data = nullptr;
    uint32_t size = 0;
    uint32_t capacity = 0;                       // 0 or 4 · 2^n
    std::array<uint32_t, kEntryCodes> counts{};  // entries by code
    bool touched = false;
  };
  using Counts = std::array<uint32_t, kEntryCodes>;
  static constexpr size_t kChunk = 1 << 16;  // entries

  List& at(int32_t cell) { return lists_[static_cast<size_t>(cell)]; }
  const List& at(int32_t cell) const { return lists_[static_cast<size_t>(cell)]; }
  void touch(int32_t cell, List& list) {
    if (list.touched) return;
    list.touched = true;
    touched_.push_back(cell);
  }
  void grow(List& list);
  uint32_t* take_block(uint32_t capacity);
  void give_block(List& list);

  std::vector<List> lists_;
  std::vector<Counts> reported_;                  // parallel: what receivers know
  std::array<std::vector<uint32_t*>, 32> spare_;  // by log2 of the capacity
  std::vector<std::unique_ptr<uint32_t[]>> chunks_;
  size_t chunk_used_ = kChunk;
  size_t pool_entries_ = 0;
  std::vector<int32_t> touched_;
  int64_t pairs_ = 0;
};

template <class Drop>
void ConstraintLists::filter(int32_t cell, Drop&& drop) {
  List& list = at(cell);
  uint32_t kept = 0;
  for (uint32_t n = 0; n < list.size; ++n) {
    const uint32_t entry = list.data[n];
    if (!drop(entry)) {
      list.data[kept++] = entry;
      continue;
    }
    --list.counts[entry_code(entry)];
    pairs_ -= entry_code(entry) != kEntryEnd;
  }
  if (kept != list.size) touch(cell, list);
  list.size = kept;
}

}  // namespace foresight::carving
