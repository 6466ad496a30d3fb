// Carver and mesher behind slam, without a bus: what each of slam's deltas makes of the mesh.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/map_delta.h"
#include "common/mesh.h"
#include "common/time.h"
#include "procs/carver/carver.h"
#include "procs/mesher/mesher.h"

namespace foresight {

struct MeshOptions {
  CarverOptions carver;
  MesherOptions mesher;
  Duration period = seconds(1);  // of the meshes that are sent
};

struct SentMesh {
  Time time;  // of the image after which it was sent
  Mesh mesh;
};

class MeshFollower {
 public:
  explicit MeshFollower(const MeshOptions& options);

  /// After each image: its time, slam's epoch, what changed. Every `period` since the first a mesh
  /// is sent, if there is news. A new epoch starts from nothing.
  void follow(Time time, int epoch, const MapDelta& delta);

  /// Of the present epoch, oldest first.
  const std::vector<SentMesh>& sent() const { return sent_; }
  /// The newest that was sent by then; null: none.
  const Mesh* sent_by(Time time) const;
  /// Of the whole map of the present epoch, as it is now.
  Mesh mesh() { return mesher_.update(); }
  int epoch() const { return epoch_; }
  const std::map<KeyframeId, MapKeyframe>& keyframes() const { return keyframes_; }
  CarverStatistics carver_statistics() const { return carver_.statistics(); }

 private:
  void begin_epoch(int epoch);
  bool is_due(Time time);

  MeshOptions options_;
  Carver carver_;
  Mesher mesher_;
  std::map<KeyframeId, MapKeyframe> keyframes_;
  std::vector<SentMesh> sent_;
  int epoch_ = 0;
  std::optional<Time> next_;  // tick of the timer that sends
  bool changed_ = false;
};

}  // namespace foresight
