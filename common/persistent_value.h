// A value that a stream states again and again and that seldom changes (a camera's intrinsics, the
// epoch of the map, a controller's limits): one that differs counts only when it persists, so that
// a single forged message bends nothing.
//
//   PersistentValue<CameraModel> camera(2);
//   if (!camera.offer(*stated)) return input.reject("contradicts the last");
//   use(*camera.value());
#pragma once

#include <optional>

namespace foresight {

template <class T>
class PersistentValue {
 public:
  /// A new value counts from its `patience`-th statement running; the first ever counts at once.
  explicit PersistentValue(int patience = 3) : patience_(patience) {}

  /// True when `stated` is the value that counts, now or as before.
  bool offer(const T& stated) {
    if (!value_) value_ = stated;
    if (stated == *value_) {
      contender_.reset();
      return true;
    }
    if (!contender_ || !(*contender_ == stated)) {
      contender_ = stated;
      count_ = 0;
    }
    if (++count_ < patience_) return false;
    value_ = stated;
    contender_.reset();
    return true;
  }
  const std::optional<T>& value() const { return value_; }

 private:
  int patience_;
  int count_ = 0;
  std::optional<T> value_, contender_;
};

}  // namespace foresight
