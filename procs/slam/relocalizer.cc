#include "procs/slam/relocalizer.h"

#include <algorithm>

namespace foresight::slam {
namespace {
constexpr size_t kSimilarViews = 3;
}

Relocalizer::Relocalizer(const CameraModel& camera)
    : camera_(camera), thumbnail_camera_(slam::thumbnail_camera(camera)) {}

std::vector<Pose<Map, Cam>> Relocalizer::similar_views(const SlamMap& map,
                                                       const Thumbnail& thumbnail) const {
  std::vector<std::pair<double, int32_t>> ranked;
  for (const auto& [id, k] : map.keyframes()) {
    ranked.emplace_back(thumbnail_distance(k.thumbnail, thumbnail), id);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > kSimilarViews) ranked.resize(kSimilarViews);
  std::vector<Pose<Map, Cam>> poses;
  for (const auto& [distance, id] : ranked) {
    const Keyframe& k = *map.keyframe(id);
    const ThumbnailAlignment turned =
        align_thumbnails(k.thumbnail, thumbnail, thumbnail_camera_, {}, k.median_depth);
    poses.push_back(k.map_from_cam * turned.source_from_target);
  }
  return poses;
}

}  // namespace foresight::slam
