// Entries of map deltas that nobody should send: a carver has to ignore them, or make the most of
// them, exactly as MapModel does.
#pragma once

#include <random>

#include "tests/carver/map_model.h"

namespace foresight::carver_test {

/// Adds some of: unknown, negative, extreme and repeated ids; what is removed and set anew in the
/// same delta; observations of what is removed; coordinates that are not finite, absurd, just
/// allowed, or tiny; cameras and points at the place of points. `model`: the map before the delta.
void add_hostile_entries(const MapModel& model, std::mt19937& random, MapDelta& delta);

}  // namespace foresight::carver_test
