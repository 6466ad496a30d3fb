#include "procs/carver/constraint_lists.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace foresight::carving {

void ConstraintLists::reset() { *this = ConstraintLists(); }

CellVotes ConstraintLists::votes(CellId cell) const {
  const auto count = [&](uint32_t code) -> int32_t { return at(cell).count.by_code[code]; };
  return {{count(0), count(1), count(2), count(3)}, count(kEntryStart), count(kEntryEnd)};
}

std::vector<CellId> ConstraintLists::take_changed() {
  std::vector<CellId> changed;
  for (const Touched& touched : touched_) {
    List& list = at(touched.cell);
    list.touched = false;
    const Count before = touched.before.is_valid() ? counts_before_[touched.before] : Count{};
    if (list.count != before) changed.push_back(touched.cell);
  }
  touched_.clear();
  counts_before_.clear();
  return changed;
}

void ConstraintLists::release(CellId cell) {
  List& list = at(cell);
  pairs_ -= constraints(cell);
  give_block(list);
  const bool touched = list.touched;  // it is still in the list of those
  list = List{};
  list.touched = touched;
}

void ConstraintLists::grow(List& list) {
  const auto log_capacity = static_cast<uint8_t>(std::max(2, list.log_capacity + 1));
  Entry* data = take_block(log_capacity);
  std::copy_n(list.data, list.count.entries, data);
  give_block(list);
  list.data = data;
  list.log_capacity = log_capacity;
}

Entry* ConstraintLists::take_block(uint8_t log_capacity) {
  auto& spare = spare_[log_capacity];
  const uint32_t capacity = 1U << log_capacity;
  list_entries_ += capacity;
  if (!spare.empty()) {
    Entry* block = spare.back();
    spare.pop_back();
    return block;
  }
  if (capacity > kChunk / 4) {  // a block of its own, before the chunk in use
    pool_entries_ += capacity;
    const auto at = chunks_.empty() ? chunks_.end() : chunks_.end() - 1;
    return chunks_.insert(at, std::make_unique_for_overwrite<Entry[]>(capacity))->get();
  }
  if (chunk_used_ + capacity > kChunk) {
    chunks_.push_back(std::make_unique_for_overwrite<Entry[]>(kChunk));
    pool_entries_ += kChunk;
    chunk_used_ = 0;
  }
  Entry* block = chunks_.back().get() + chunk_used_;
  chunk_used_ += capacity;
  return block;
}

void ConstraintLists::give_block(List& list) {
  if (list.log_capacity == 0) return;
  list_entries_ -= list.capacity();
  spare_[list.log_capacity].push_back(list.data);
}

void ConstraintLists::compact() {
  const auto old = std::exchange(chunks_, {});
  for (auto& spare : spare_) spare = {};
  chunk_used_ = kChunk;
  pool_entries_ = list_entries_ = 0;
  for (List& list : lists_) {
    const Entry* data = list.data;
    list.data = nullptr;
    list.log_capacity = 0;
    if (list.count.entries == 0) continue;
    list.log_capacity =
        static_cast<uint8_t>(std::max<int>(2, std::bit_width(list.count.entries - 1)));
    list.data = take_block(list.log_capacity);
    std::copy_n(data, list.count.entries, list.data);
  }
}

size_t ConstraintLists::memory_bytes() const {
  size_t bytes = pool_entries_ * sizeof(Entry) + lists_.capacity() * sizeof(List);
  for (const auto& spare : spare_) bytes += spare.capacity() * sizeof(Entry*);
  return bytes;
}

}  // namespace foresight::carving
