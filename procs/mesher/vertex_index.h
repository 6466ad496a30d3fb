// Vertex id → index. Ids of map points grow from 0 and are mostly in use, so most lie in an array;
// those far beyond the number of vertices (a hostile sender's, say) in a hash table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/carving_delta.h"

namespace foresight {

class VertexIndex {
 public:
  static constexpr int32_t kNone = -1;
  /// Ids start at −`negative_ids`.
  explicit VertexIndex(int32_t negative_ids) : offset_(negative_ids) {}

  int32_t size() const { return size_; }
  int32_t find(VertexId id) const {
    const int64_t place = int64_t{id.value()} + offset_;
    if (place >= 0 && place < static_cast<int64_t>(dense_.size())) {
      const int32_t index = dense_[static_cast<size_t>(place)];
      if (index != kNone) return index;
    }
    if (sparse_.empty()) return kNone;
    const auto found = sparse_.find(id);
    return found == sparse_.end() ? kNone : found->second;
  }
  /// `id` must not be there.
  void insert(VertexId id, int32_t index) {
    ++size_;
    const int64_t place = int64_t{id.value()} + offset_;
    if (place >= kSlack + kSpread * int64_t{size_}) {
      sparse_.emplace(id, index);
      return;
    }
    if (place >= static_cast<int64_t>(dense_.size())) {
      dense_.resize(static_cast<size_t>(place) + 1, kNone);
    }
    dense_[static_cast<size_t>(place)] = index;
  }
  /// `id` must be there.
  void erase(VertexId id) {
    --size_;
    if (sparse_.erase(id) == 0) dense_[static_cast<size_t>(int64_t{id.value()} + offset_)] = kNone;
  }

 private:
  static constexpr int64_t kSlack = 1 << 16, kSpread = 16;

  int32_t offset_;
  int32_t size_ = 0;
  std::vector<int32_t> dense_;
  std::unordered_map<VertexId, int32_t> sparse_;
};

}  // namespace foresight
