#include "procs/slam/place_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

namespace foresight::slam {
namespace {

constexpr int kDescriptorBits = 256;
constexpr unsigned kSeed = 20240817;

}  // namespace

PlaceIndex::PlaceIndex() {
  std::mt19937 random(kSeed);
  for (auto& table : bits_) {
    for (uint8_t& bit : table) bit = static_cast<uint8_t>(random() % kDescriptorBits);
  }
  for (std::vector<Bucket>& table : buckets_) table.resize(size_t{1} << kBits);
}

int PlaceIndex::bucket_of(int table, const uint8_t* descriptor) const {
  int bucket = 0;
  for (const uint8_t bit : bits_[static_cast<size_t>(table)]) {
    bucket = 2 * bucket + ((descriptor[bit / 8] >> (bit % 8)) & 1);
  }
  return bucket;
}

void PlaceIndex::add(KeyframeId keyframe_id, const std::shared_ptr<const Features>& features) {
  remove(keyframe_id);
  entries_[keyframe_id] = features;
  for (int row = 0; row < features->descriptors.rows; ++row) {
    for (int table = 0; table < kTables; ++table) {
      const auto at = static_cast<size_t>(bucket_of(table, features->descriptors.ptr(row)));
      Bucket& bucket = buckets_[static_cast<size_t>(table)][at];
      const auto place = std::lower_bound(bucket.begin(), bucket.end(), keyframe_id);
      if (place == bucket.end() || *place != keyframe_id) bucket.insert(place, keyframe_id);
    }
  }
}

void PlaceIndex::remove(KeyframeId keyframe_id) {
  const auto entry = entries_.find(keyframe_id);
  if (entry == entries_.end()) return;
  const cv::Mat& descriptors = entry->second->descriptors;
  for (int row = 0; row < descriptors.rows; ++row) {
    for (int table = 0; table < kTables; ++table) {
      const auto at = static_cast<size_t>(bucket_of(table, descriptors.ptr(row)));
      std::erase(buckets_[static_cast<size_t>(table)][at], keyframe_id);
    }
  }
  entries_.erase(entry);
}

void PlaceIndex::follow(const SlamMap& map) {
  std::vector<KeyframeId> gone;
  for (const auto& [id, features] : entries_) {
    if (map.keyframe(id) == nullptr) gone.push_back(id);
  }
  for (const KeyframeId id : gone) remove(id);
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.features && !contains(id)) add(id, keyframe.features);
  }
}

std::vector<PlaceIndex::Ranked> PlaceIndex::rank(const Features& image) const {
  if (entries_.empty()) return {};
  const auto count = static_cast<double>(entries_.size());
  IdVector<KeyframeId, double> votes(entries_.rbegin()->first.next().index()), met = votes;
  std::vector<KeyframeId> met_ids;
  for (int row = 0; row < image.descriptors.rows; ++row) {
    met_ids.clear();
    for (int table = 0; table < kTables; ++table) {
      const auto at = static_cast<size_t>(bucket_of(table, image.descriptors.ptr(row)));
      const Bucket& bucket = buckets_[static_cast<size_t>(table)][at];
      if (bucket.empty()) continue;
      const double rarity = std::log((count + 1) / static_cast<double>(bucket.size()));
      for (const KeyframeId id : bucket) {
        double& best = met[id];
        if (best == 0) met_ids.push_back(id);
        best = std::max(best, rarity);
      }
    }
    for (const KeyframeId id : met_ids) {
      votes[id] += std::exchange(met[id], 0);
    }
  }
  std::vector<Ranked> ranked;
  for (const auto& [id, features] : entries_) {
    const double vote = votes[id];
    if (vote == 0) continue;
    ranked.push_back({id, vote / std::sqrt(static_cast<double>(features->pixels.size()))});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.votes > b.votes; });
  return ranked;
}

}  // namespace foresight::slam
