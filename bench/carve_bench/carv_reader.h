// Reads carvseq files (gzip text: keyframes, points, observations, deletions, bundle adjustments)
// as a sequence of map deltas, one per event of the SLAM system.
//
//   CarvSequence sequence = read_carv("s3k.carv.gz", {});
//   if (!sequence.error.empty()) …
#pragma once

#include <string>
#include <vector>

#include "common/map_delta.h"

namespace foresight {

enum class CarvEventKind : uint8_t { kKeyframe, kDeletion, kAdjustment };

struct CarvEvent {
  CarvEventKind kind = CarvEventKind::kKeyframe;
  MapDelta delta;
};

struct CarvSequence {
  std::vector<CarvEvent> events;
  std::string error;  // empty, or file, line and reason
};

struct CarvReadOptions {
  /// Also the observation of a new point by the earlier keyframe it was triangulated with.
  bool earlier_observations = true;
  /// Map units per metre. Points have 5 decimals: with 1e5 their positions are whole numbers, which
  /// a float holds exactly.
  double mu_per_m = 1.0;
};

CarvSequence read_carv(const std::string& path, const CarvReadOptions& options);

/// One delta with the final state of a sequence.
MapDelta final_map(const CarvSequence& sequence);

}  // namespace foresight
