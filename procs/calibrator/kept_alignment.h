// What a calibrator leaves for the one after it, should it be killed: the alignment that it uses
// and where the base was. As text of lines "key number …", every number with all its bits.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/frames.h"
#include "common/time.h"
#include "procs/calibrator/alignment.h"

namespace foresight::calibration {

/// Whether the base stands where it stood when the pairs were collected.
enum class Stand : uint8_t { kThere, kAway, kLeft };

struct KeptAlignment {
  int64_t epoch = 0;  // of the map that it aligns
  Time time;          // of the newest frame by which the base was measured, the camera's clock
  Time newest_pair;   // that contributed
  Similarity<World, Map> world_from_map;
  /// As accepted; base_from_map and what concerns single pairs is not kept.
  AlignmentSolution solution;
  // The base at alignment, and the doubt about that.
  Pose<World, Base> world_from_aligned_base;
  double aligned_base_sigma_m = 0, aligned_base_sigma_rad = 0;
  Stand stand = Stand::kThere;
  // The base at `time`, and how fast it moved at most of late.
  Pose<World, Base> world_from_base;
  double base_speed_m_per_s = 0, base_turn_rad_per_s = 0;
};

std::string to_text(const KeptAlignment& kept);
/// Nothing unless all of it is there and can be.
std::optional<KeptAlignment> parse_kept_alignment(const std::string& text);

}  // namespace foresight::calibration
