// Indices that cannot be taken for one another, and vectors that only their own kind indexes.
//
//   using CellId = Id<struct CellTag>;
//   IdVector<CellId, Cell> cells;
//   const CellId id = cells.push_back(cell);
//   cells[id].neighbors = ...;
//   for (const CellId c : cells.ids()) ...
//
// An Id is as cheap as the integer in it and is made from one only explicitly. The default one is
// none: it is not valid and indexes nothing.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <istream>
#include <ostream>
#include <type_traits>
#include <utility>
#include <vector>

namespace foresight {

template <class Tag>
class Id {
 public:
  using Value = int32_t;

  constexpr Id() = default;
  constexpr explicit Id(Value value) : value_(value) {}
  /// Of the element at `index` of a vector.
  static constexpr Id at(size_t index) { return Id(static_cast<Value>(index)); }

  constexpr Value value() const { return value_; }
  constexpr size_t index() const { return static_cast<size_t>(value_); }
  constexpr bool is_valid() const { return value_ >= 0; }
  constexpr Id next() const { return Id(value_ + 1); }

  constexpr auto operator<=>(const Id&) const = default;
  friend std::ostream& operator<<(std::ostream& out, Id id) { return out << id.value_; }
  friend std::istream& operator>>(std::istream& in, Id& id) { return in >> id.value_; }

 private:
  Value value_ = -1;
};

static_assert(sizeof(Id<struct AnyTag>) == sizeof(int32_t));
static_assert(std::is_trivially_copyable_v<Id<struct AnyTag>>);

/// first, …, last − 1.
template <class IdType>
class IdRange {
 public:
  class Iterator {
   public:
    using value_type = IdType;
    using difference_type = std::ptrdiff_t;
    constexpr Iterator() = default;
    constexpr explicit Iterator(IdType id) : id_(id) {}
    constexpr IdType operator*() const { return id_; }
    constexpr Iterator& operator++() {
      id_ = id_.next();
      return *this;
    }
    constexpr Iterator operator++(int) { return std::exchange(*this, Iterator(id_.next())); }
    constexpr bool operator==(const Iterator&) const = default;

   private:
    IdType id_;
  };
  constexpr IdRange(IdType first, IdType last) : first_(first), last_(last) {}
  constexpr Iterator begin() const { return Iterator(first_); }
  constexpr Iterator end() const { return Iterator(last_); }

 private:
  IdType first_, last_;
};

/// A vector whose index is an Id.
template <class IdType, class T>
class IdVector {
 public:
  using Values = std::vector<T>;

  IdVector() = default;
  explicit IdVector(size_t size, const T& value = T()) : values_(size, value) {}

  decltype(auto) operator[](IdType id) { return values_[id.index()]; }
  decltype(auto) operator[](IdType id) const { return values_[id.index()]; }

  bool contains(IdType id) const { return id.is_valid() && id.index() < values_.size(); }
  size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }
  /// One beyond the last.
  IdType limit() const { return IdType::at(values_.size()); }
  IdRange<IdType> ids() const { return {IdType(0), limit()}; }

  IdType push_back(T value) {
    values_.push_back(std::move(value));
    return IdType::at(values_.size() - 1);
  }
  template <class... Arguments>
  IdType emplace_back(Arguments&&... arguments) {
    values_.emplace_back(std::forward<Arguments>(arguments)...);
    return IdType::at(values_.size() - 1);
  }
  void pop_back() { values_.pop_back(); }
  void clear() { values_.clear(); }
  void resize(size_t size, const T& value = T()) { values_.resize(size, value); }
  void assign(size_t size, const T& value) { values_.assign(size, value); }
  void reserve(size_t size) { values_.reserve(size); }
  size_t capacity() const { return values_.capacity(); }
  /// So that `id` is an index; new elements are `value`.
  void grow_to(IdType id, const T& value = T()) {
    if (!contains(id)) values_.resize(id.index() + 1, value);
  }

  decltype(auto) front() { return values_.front(); }
  decltype(auto) front() const { return values_.front(); }
  decltype(auto) back() { return values_.back(); }
  decltype(auto) back() const { return values_.back(); }
  auto begin() { return values_.begin(); }
  auto begin() const { return values_.begin(); }
  auto end() { return values_.end(); }
  auto end() const { return values_.end(); }
  /// For what knows no ids: a message, an algorithm of a library.
  const Values& values() const { return values_; }
  Values& values() { return values_; }

  bool operator==(const IdVector&) const = default;

 private:
  Values values_;
};

// What slam names, and every process that knows the map. Never reused within an epoch.
using KeyframeId = Id<struct KeyframeTag>;
using PointId = Id<struct PointTag>;

}  // namespace foresight

template <class Tag>
struct std::hash<foresight::Id<Tag>> {
  size_t operator()(foresight::Id<Tag> id) const noexcept {
    return std::hash<int32_t>()(id.value());
  }
};
