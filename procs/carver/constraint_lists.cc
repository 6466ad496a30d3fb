#include "procs/carver/constraint_lists.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace foresight::carving {

void ConstraintLists::reset() { *this = ConstraintLists(); }

CellVotes ConstraintLists::votes(int32_t cell) const {
  const auto count = [&](uint32_t code) { return static_cast<int32_t>(at(cell).counts[code]); };
  return {{count(0), count(1), count(2), count(3)}, count(kEntryStart), count(kEntryEnd)};
}

bool ConstraintLists::report(int32_t cell) {
  Counts& known = reported_[static_cast<size_t>(cell)];
  if (known == at(cell).counts) return false;
  known = at(cell).counts;
  return true;
}

void ConstraintLists::report_all() {
  for (size_t cell = 0; cell < lists_.size(); ++cell) report(static_cast<int32_t>(cell));
  take_touched();
}

std::vector<int32_t> ConstraintLists::take_touched() {
  for (const int32_t cell : touched_) at(cell).touched = false;
  return std::exchange(touched_, {});
}

void ConstraintLists::release(int32_t cell) {
  List& list = at(cell);
  pairs_ -= constraints(cell);
  give_block(list);
  const bool touched = list.touched;  // it is still in the list of those
  list = List{};
  list.touched = touched;
}

void ConstraintLists::grow(List& list) {
  const uint32_t capacity = std::max<uint32_t>(4, 2 * list.capacity);
  uint32_t* data = take_block(capacity);
  std::copy_n(list.data, list.size, data);
  give_block(list);
  list.data = data;
  list.capacity = capacity;
}

uint32_t* ConstraintLists::take_block(uint32_t capacity) {
  auto& spare = spare_[static_cast<size_t>(std::countr_zero(capacity))];
  if (!spare.empty()) {
    uint32_t* block = spare.back();
    spare.pop_back();
    return block;
  }
  if (capacity > kChunk / 4) {  // a block of its own, before the chunk in use
    pool_entries_ += capacity;
    const auto at = chunks_.empty() ? chunks_.end() : chunks_.end() - 1;
    return chunks_.insert(at, std::make_unique_for_overwrite<uint32_t[]>(capacity))->get();
  }
  if (chunk_used_ + capacity > kChunk) {
    chunks_.push_back(std::make_unique_for_overwrite<uint32_t[]>(kChunk));
    pool_entries_ += kChunk;
    chunk_used_ = 0;
  }
  uint32_t* block = chunks_.back().get() + chunk_used_;
  chunk_used_ += capacity;
  return block;
}

void ConstraintLists::give_block(List& list) {
  if (list.capacity == 0) return;
  spare_[static_cast<size_t>(std::countr_zero(list.capacity))].push_back(list.data);
}

size_t ConstraintLists::memory_bytes() const {
  size_t bytes =
      pool_entries_ * sizeof(uint32_t) + lists_.capacity() * (sizeof(List) + sizeof(Counts));
  for (const auto& spare : spare_) bytes += spare.capacity() * sizeof(uint32_t*);
  return bytes;
}

}  // namespace foresight::carving
