// The constraints that cross each cell, and those that end in front of it: lists of 4-byte entries
// in pooled blocks.
//
// An entry is a constraint and how it enters the cell (segment_walker.h). The code tells, when the
// cell is destroyed, at which facet of the changed region the constraint must be taken up again, so
// none is ever tested against a cell to find out. Counted by code, the entries are the cell's
// votes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "common/carving_delta.h"
#include "procs/carver/grow.h"
#include "procs/carver/segment_walker.h"

namespace foresight::carving {

inline constexpr int32_t kMaxConstraints = 1 << 29;

/// A constraint, and how it enters the cell in whose list this is.
class Entry {
 public:
  Entry() = default;  // not initialised: pools of these are large
  Entry(ConstraintIndex constraint, uint32_t code)
      : bits_(static_cast<uint32_t>(constraint.value()) << 3 | code) {}
  ConstraintIndex constraint() const { return ConstraintIndex::at(bits_ >> 3); }
  uint32_t code() const { return bits_ & 7U; }
  bool operator==(const Entry&) const = default;

 private:
  uint32_t bits_;
};
static_assert(sizeof(Entry) == 4 && std::is_trivially_default_constructible_v<Entry>);

class ConstraintLists {
 public:
  /// Makes room for cells 0 … cells − 1; new ones have empty lists.
  void resize(size_t cells) { grow_to(lists_, cells); }
  /// Forgets all lists and frees the memory.
  void reset();

  std::span<const Entry> entries(CellId cell) const {
    const List& list = at(cell);
    return {list.data, list.count.entries};
  }
  /// Constraints that cross the cell; entries of those that end in front of it are not among them.
  int32_t constraints(CellId cell) const {
    return at(cell).count.entries - at(cell).count.by_code[kEntryEnd];
  }
  CellVotes votes(CellId cell) const;
  size_t cells() const { return lists_.size(); }
  void push(CellId cell, Entry entry) {
    List& list = at(cell);
    touch(cell, list);
    if (list.count.entries == list.capacity()) grow(list);
    list.data[list.count.entries] = entry;
    list.count.add(entry, 1);
    pairs_ += entry.code() != kEntryEnd;
  }
  void replace(CellId cell, size_t index, Entry entry) {
    List& list = at(cell);
    touch(cell, list);
    list.count.add(list.data[index], -1);
    list.count.add(entry, 1);
    list.data[index] = entry;
  }
  /// Drops the entries for which `drop(entry)` holds; keeps the order of the others.
  template <class Drop>
  void filter(CellId cell, Drop&& drop);
  /// The cell is gone: its list is emptied and its memory reused.
  void release(CellId cell);

  /// Cells whose counts are not what they were when this was last called (or are gone since).
  std::vector<CellId> take_changed();

  /// Sum of all cells' constraints.
  int64_t pairs() const { return pairs_; }
  size_t memory_bytes() const;
  /// Of memory_bytes(), what the lists themselves need: the rest is room for others.
  size_t list_bytes() const { return list_entries_ * sizeof(Entry); }
  /// Moves all lists to new memory and frees the old; for a moment there are both.
  void compact();

 private:
  struct Count {
    uint32_t entries = 0;
    std::array<uint32_t, kCountedCodes> by_code{};
    void add(Entry entry, int32_t one) {
      entries += one;
      if (entry.code() < kCountedCodes) by_code[entry.code()] += one;
    }
    bool operator==(const Count&) const = default;
  };
  struct List {
    Entry* data = nullptr;
    Count count;
    uint8_t log_capacity = 0;  // 0: no block
    bool touched = false;
    uint32_t capacity() const { return log_capacity == 0 ? 0 : 1U << log_capacity; }
  };
  using BeforeIndex = Id<struct BeforeTag>;  // in counts_before_
  struct Touched {
    CellId cell;
    BeforeIndex before;  // none: all zero
  };
  static constexpr size_t kChunk = 1 << 16;  // entries

  List& at(CellId cell) { return lists_[cell]; }
  const List& at(CellId cell) const { return lists_[cell]; }
  void touch(CellId cell, List& list) {
    if (list.touched) return;
    list.touched = true;
    const bool empty = list.count.entries == 0;
    touched_.push_back({cell, empty ? BeforeIndex() : counts_before_.push_back(list.count)});
  }
  void grow(List& list);
  Entry* take_block(uint8_t log_capacity);
  void give_block(List& list);

  IdVector<CellId, List> lists_;
  std::array<std::vector<Entry*>, 32> spare_;  // by log2 of the capacity
  std::vector<std::unique_ptr<Entry[]>> chunks_;
  size_t chunk_used_ = kChunk;
  size_t pool_entries_ = 0;  // allocated
  size_t list_entries_ = 0;  // of these, in lists
  std::vector<Touched> touched_;
  IdVector<BeforeIndex, Count> counts_before_;
  int64_t pairs_ = 0;
};

template <class Drop>
void ConstraintLists::filter(CellId cell, Drop&& drop) {
  List& list = at(cell);
  uint32_t kept = 0;
  while (kept < list.count.entries && !drop(list.data[kept])) ++kept;
  if (kept == list.count.entries) return;
  touch(cell, list);
  for (uint32_t n = kept, all = list.count.entries; n < all; ++n) {
    const Entry entry = list.data[n];
    if (!drop(entry)) {
      list.data[kept++] = entry;
      continue;
    }
    list.count.add(entry, -1);
    pairs_ -= entry.code() != kEntryEnd;
  }
}

}  // namespace foresight::carving
