// Which keyframes show what an image shows? Locality-sensitive hashing of binary descriptors
// (Indyk and Motwani 1998): each of a few tables files a descriptor under a handful of its bits,
// so that descriptors of the same spot, which differ in a few bits, meet in one table or another.
// A keyframe gets a vote for each of the image's features that meets one of its own; rare meetings
// count more (inverse document frequency). Needs no vocabulary and no training.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "procs/slam/features.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

class PlaceIndex {
 public:
  PlaceIndex();

  void add(KeyframeId keyframe_id, const std::shared_ptr<const Features>& features);
  void remove(KeyframeId keyframe_id);
  bool contains(KeyframeId keyframe_id) const { return entries_.contains(keyframe_id); }
  size_t size() const { return entries_.size(); }
  /// Takes in the described keyframes of a map that it lacks, and drops those that are gone.
  void follow(const SlamMap& map);

  struct Ranked {
    KeyframeId keyframe_id;
    double votes = 0;  // comparable within one ranking
  };
  /// Keyframes by their votes, the most first; those without any are left out. About 1 ms with a
  /// hundred keyframes.
  std::vector<Ranked> rank(const Features& image) const;

 private:
  static constexpr int kTables = 6, kBits = 14;
  using Bucket = std::vector<KeyframeId>;  // keyframe ids, sorted, each once
  int bucket_of(int table, const uint8_t* descriptor) const;

  std::array<std::array<uint8_t, kBits>, kTables> bits_;  // positions in a descriptor
  std::array<std::vector<Bucket>, kTables> buckets_;
  std::map<KeyframeId, std::shared_ptr<const Features>> entries_;
};

}  // namespace foresight::slam
