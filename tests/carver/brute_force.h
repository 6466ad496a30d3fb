// The reference carving of a map: a triangulation from scratch and, for each cell and observation,
// an exact clip of the segment in rational numbers. Shares no code with the carver.
#pragma once

#include "tests/carver/map_model.h"
#include "tests/carver/receiver.h"

namespace foresight::carver_test {

/// `vertices` supplies the hull's corners (ids −1…−8).
Carving carve_by_brute_force(const MapModel& map,
                             const std::map<VertexId, Eigen::Vector3f>& vertices);

/// The evidence of every vertex, by the id that it must have. The spread is the angle between all
/// pairs' most different.
std::map<VertexId, VertexEvidence> evidence_by_brute_force(const MapModel& map);

/// "" if counts are equal and spreads as close as VertexEvidence promises.
std::string differences(const std::map<VertexId, VertexEvidence>& actual, const MapModel& map);

}  // namespace foresight::carver_test
