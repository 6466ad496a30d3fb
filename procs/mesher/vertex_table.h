// Which place in the mesher's arrays a vertex has, by its id. Ids of map points grow from 0 and are
// mostly in use, so most lie in an array; those far beyond the number of vertices (a hostile
// sender's, say) in a hash table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <unordered_map>
#include <vector>

#include "common/carving_delta.h"
#include "common/id.h"

namespace foresight {

/// A place in a CellComplex's arrays. It stays within the mesher; receivers know the VertexId.
using VertexIndex = Id<struct ComplexVertexTag>;

class VertexTable {
 public:
  int32_t size() const { return size_; }
  /// None: no such vertex.
  VertexIndex find(VertexId id) const {
    const int64_t place = place_of(id);
    if (place >= 0 && place < std::ssize(dense_)) {
      const VertexIndex index = dense_[place];
      if (index.is_valid()) return index;
    }
    if (sparse_.empty()) return {};
    const auto found = sparse_.find(id);
    return found == sparse_.end() ? VertexIndex() : found->second;
  }
  /// `id` must not be there.
  void insert(VertexId id, VertexIndex index) {
    ++size_;
    const int64_t place = place_of(id);
    if (place >= kSlack + kSpread * int64_t{size_}) {
      sparse_.emplace(id, index);
      return;
    }
    if (place >= std::ssize(dense_)) dense_.resize(place + 1);
    dense_[place] = index;
  }
  /// `id` must be there.
  void erase(VertexId id) {
    --size_;
    if (sparse_.erase(id) == 0) dense_[place_of(id)] = VertexIndex();
  }

 private:
  // Corners come first.
  static int64_t place_of(VertexId id) { return int64_t{id.value()} + VertexId::kHullCorners; }

  static constexpr int64_t kSlack = 1 << 16, kSpread = 16;

  int32_t size_ = 0;
  std::vector<VertexIndex> dense_;
  std::unordered_map<VertexId, VertexIndex> sparse_;
};

}  // namespace foresight
