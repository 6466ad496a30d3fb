#include "bench/mesh_eval/mesh_follower.h"

#include <algorithm>

#include "common/check.h"

namespace foresight {

MeshFollower::MeshFollower(const MeshOptions& options)
    : options_(options), carver_(options.carver), mesher_(options.mesher) {}

void MeshFollower::begin_epoch(int epoch) {
  epoch_ = epoch;
  carver_.reset();
  mesher_.reset();
  keyframes_.clear();
  sent_.clear();
  changed_ = false;
}

void MeshFollower::follow(Time time, int epoch, const MapDelta& delta) {
  if (epoch != epoch_) begin_epoch(epoch);
  for (const KeyframeId id : delta.keyframes_removed) keyframes_.erase(id);
  for (const MapKeyframe& k : delta.keyframes_set) keyframes_[k.id] = k;
  const CarvingDelta carving = carver_.apply(delta);
  FORESIGHT_CHECK(mesher_.apply(carving) == ApplyResult::kOk);
  changed_ = changed_ || !carving.empty();
  if (!is_due(time) || !changed_) return;
  sent_.push_back({time, mesher_.update()});
  changed_ = false;
}

// The process's timer ticks on whether or not there is news.
bool MeshFollower::is_due(Time time) {
  if (!next_) next_ = time + options_.period;
  const bool due = time >= *next_;
  while (*next_ <= time) *next_ = *next_ + options_.period;
  return due;
}

const Mesh* MeshFollower::sent_by(Time time) const {
  const auto after = std::upper_bound(sent_.begin(), sent_.end(), time,
                                      [](Time t, const SentMesh& sent) { return t < sent.time; });
  return after == sent_.begin() ? nullptr : &(after - 1)->mesh;
}

}  // namespace foresight
