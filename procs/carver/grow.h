// Vectors that grow by a quarter instead of doubling: the carver holds a few large ones for hours.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/id.h"

namespace foresight::carving {

template <class T>
void reserve_for(std::vector<T>& values, size_t size) {
  if (size > values.capacity()) values.reserve(std::max(size, values.capacity() * 5 / 4 + 16));
}

/// Never shrinks.
template <class T>
void grow_to(std::vector<T>& values, size_t size) {
  if (size <= values.size()) return;
  reserve_for(values, size);
  values.resize(size);
}

/// Appends a value-initialised element.
template <class T>
void add_one(std::vector<T>& values) {
  reserve_for(values, values.size() + 1);
  values.emplace_back();
}

template <class IdType, class T>
void grow_to(IdVector<IdType, T>& values, size_t size) {
  grow_to(values.values(), size);
}
template <class IdType, class T>
IdType add_one(IdVector<IdType, T>& values) {
  add_one(values.values());
  return IdType::at(values.size() - 1);
}

}  // namespace foresight::carving
