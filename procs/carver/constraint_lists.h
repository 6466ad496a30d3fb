// The constraints that cross each cell: lists of 4-byte entries in pooled blocks.
//
// An entry is a ray number and how the ray enters the cell (segment_walker.h). The code tells, when
// the cell is destroyed, at which facet of the changed region the ray must be taken up again, so no
// ray is ever tested against a cell to find out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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
  void resize(size_t cells) { lists_.resize(cells); }
  /// Forgets all lists and frees the memory.
  void reset();

  std::span<const uint32_t> entries(int32_t cell) const {
    const List& list = at(cell);
    return {list.data, list.size};
  }
  uint32_t size(int32_t cell) const { return at(cell).size; }
  size_t cells() const { return lists_.size(); }
  void push(int32_t cell, uint32_t entry) {
    List& list = at(cell);
    if (list.size == list.reported) touched_.push_back(cell);
    if (list.size == list.capacity) grow(list);
    list.data[list.size++] = entry;
    ++pairs_;
  }
  void replace(int32_t cell, size_t index, uint32_t entry) { at(cell).data[index] = entry; }
  /// Drops the entries for which `drop(entry)` holds; keeps the order of the others.
  template <class Drop>
  void filter(int32_t cell, Drop&& drop);
  /// The cell is gone: its list is emptied and its memory reused.
  void release(int32_t cell);

  /// Cells whose count may differ from the reported one; cleared by the caller.
  std::vector<int32_t>& touched() { return touched_; }
  /// The count that receivers know.
  uint32_t reported(int32_t cell) const { return at(cell).reported; }
  void report(int32_t cell) { at(cell).reported = at(cell).size; }
  void report_all();

  /// Sum of all lists' sizes.
  int64_t pairs() const { return pairs_; }
  size_t memory_bytes() const;

 private:
  struct List {
    uint32_t* data = nullptr;
    uint32_t size = 0;
    uint32_t capacity = 0;  // 0 or 4 · 2^n
    uint32_t reported = 0;
  };
  static constexpr size_t kChunk = 1 << 16;  // entries

  List& at(int32_t cell) { return lists_[static_cast<size_t>(cell)]; }
  const List& at(int32_t cell) const { return lists_[static_cast<size_t>(cell)]; }
  void grow(List& list);
  uint32_t* take_block(uint32_t capacity);
  void give_block(List& list);

  std::vector<List> lists_;
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
    if (!drop(list.data[n])) list.data[kept++] = list.data[n];
  }
  if (kept != list.size && list.size == list.reported) touched_.push_back(cell);
  pairs_ -= list.size - kept;
  list.size = kept;
}

}  // namespace foresight::carving
