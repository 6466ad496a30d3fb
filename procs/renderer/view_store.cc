#include "procs/renderer/view_store.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "common/check.h"

namespace foresight {
namespace {

bool newer(const StoredView& a, const StoredView& b) {
  return std::tie(a.time.us, a.id) > std::tie(b.time.us, b.id);
}

bool sees(const CameraModel& camera, const Eigen::Vector3d& point_in_cam) {
  if (point_in_cam.z() <= 0) return false;
  const Eigen::Vector2d xy = point_in_cam.head<2>() / point_in_cam.z();
  return xy.norm() < camera.max_radius && camera.in_image(camera.project_normalized(xy));
}

std::vector<Eigen::Vector3d> samples_in_picture(const ViewQuery& query) {
  std::vector<Eigen::Vector3d> seen;
  if (query.samples_in_map == nullptr) return seen;
  const Pose<Cam, Map> cam_from_map = query.map_from_predicted_cam.inverse();
  for (const Eigen::Vector3f& sample : *query.samples_in_map) {
    const Eigen::Vector3d point_in_map = sample.cast<double>();
    if (sees(query.camera, cam_from_map * point_in_map)) seen.push_back(point_in_map);
  }
  return seen;
}

size_t count_unseen(const StoredView& view, const std::vector<Eigen::Vector3d>& samples) {
  const Pose<Cam, Map> cam_from_map = view.map_from_cam.inverse();
  return static_cast<size_t>(std::count_if(samples.begin(), samples.end(), [&](const auto& sample) {
    return !sees(view.camera, cam_from_map * sample);
  }));
}

void remove_seen(const StoredView& view, std::vector<Eigen::Vector3d>* samples) {
  const Pose<Cam, Map> cam_from_map = view.map_from_cam.inverse();
  std::erase_if(*samples, [&](const auto& s) { return sees(view.camera, cam_from_map * s); });
}

}  // namespace

double pose_distance(const Pose<Map, Cam>& a, const Pose<Map, Cam>& b, double length_unit_mu) {
  const double angle = a.rotation().angularDistance(b.rotation());
  if (length_unit_mu <= 0) return angle;
  return angle + (a.translation() - b.translation()).norm() / length_unit_mu;
}

ViewStore::ViewStore(int capacity) : capacity_(std::clamp(capacity, 1, 64)) {}

StoredView* ViewStore::find(int64_t id) {
  const auto found = std::find_if(views_.begin(), views_.end(),
                                  [id](const StoredView& view) { return view.id == id; });
  return found == views_.end() ? nullptr : &*found;
}

size_t ViewStore::newest() const {
  const auto first = std::min_element(views_.begin(), views_.end(), newer);
  return static_cast<size_t>(first - views_.begin());
}

StoredView& ViewStore::insert(int64_t id, Time time, const CameraModel& camera,
                              const Pose<Map, Cam>& map_from_cam, double length_unit_mu) {
  StoredView* place = find(id);
  if (place == nullptr) {
    StoredView view;
    view.time = time;
    view.id = id;
    if (!views_.empty() && newer(view, views_[newest()])) settle(newest(), length_unit_mu);
    if (size() >= capacity_) evict(length_unit_mu);
    view.slot = free_slot();
    views_.push_back(view);
    place = &views_.back();
  }
  const int slot = place->slot;
  *place = StoredView{id, time, camera, map_from_cam, map_from_cam, slot, {}, -1};
  const size_t index = static_cast<size_t>(place - views_.data());
  if (index == newest()) return *place;
  settle(index, length_unit_mu);
  return *find(id);
}

/// Gives a view the place of a stored one with a near anchor, which it replaces.
void ViewStore::settle(size_t index, double length_unit_mu) {
  const size_t first = newest();
  size_t nearest = index;
  double smallest = kSamePlace;
  for (size_t i = 0; i < views_.size(); ++i) {
    if (i == index || i == first) continue;
    const double d = pose_distance(views_[index].map_from_cam, views_[i].anchor, length_unit_mu);
    if (d < smallest) {
      smallest = d;
      nearest = i;
    }
  }
  if (nearest == index) return;
  views_[index].anchor = views_[nearest].anchor;
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(nearest));
}

void ViewStore::evict(double length_unit_mu) {
  size_t victim = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < views_.size(); ++i) {
    for (size_t j = i + 1; j < views_.size(); ++j) {
      const double d = pose_distance(views_[i].anchor, views_[j].anchor, length_unit_mu);
      if (d >= smallest) continue;
      smallest = d;
      victim = newer(views_[i], views_[j]) ? j : i;
    }
  }
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(victim));
}

int ViewStore::free_slot() const {
  for (int slot = 0; slot < capacity_; ++slot) {
    const bool used = std::any_of(views_.begin(), views_.end(),
                                  [slot](const StoredView& view) { return view.slot == slot; });
    if (!used) return slot;
  }
  FORESIGHT_CHECK(false);  // evict() made room
  return 0;
}

std::vector<StoredView*> ViewStore::select(const ViewQuery& query) {
  std::vector<StoredView*> chosen;
  if (views_.empty() || query.count <= 0) return chosen;
  std::vector<StoredView*> left;
  for (StoredView& view : views_) left.push_back(&view);
  std::sort(left.begin(), left.end(), [](auto* a, auto* b) { return newer(*a, *b); });

  std::vector<Eigen::Vector3d> unseen = samples_in_picture(query);
  const double per_sample = unseen.empty() ? 0 : 1.0 / static_cast<double>(unseen.size());
  size_t best = 0;  // the newest comes first whatever its score
  while (true) {
    chosen.push_back(left[best]);
    remove_seen(*left[best], &unseen);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    if (left.empty() || static_cast<int>(chosen.size()) >= query.count) return chosen;
    double greatest = -std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < left.size(); ++i) {
      const double gain =
          per_sample * static_cast<double>(unseen.size() - count_unseen(*left[i], unseen));
      const double score =
          gain - kCloseness * pose_distance(left[i]->map_from_cam, query.map_from_predicted_cam,
                                            query.length_unit_mu);
      if (score <= greatest) continue;
      greatest = score;
      best = i;
    }
  }
}

}  // namespace foresight
