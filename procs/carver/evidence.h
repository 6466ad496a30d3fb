// What the vertices rest on: the observations of the points there, and how far their directions
// spread.
#pragma once

#include <span>

#include "common/carving_delta.h"
#include "procs/carver/map_state.h"
#include "procs/carver/vertex_register.h"

namespace foresight::carving {

/// Of the unit vectors of the same directions in any order: the angle between the two that differ
/// most, 0…π. Taken as the largest extent along 13 fixed axes, so it does not depend on the order,
/// and its chord may be up to 12 % too short.
double angular_spread(std::span<const Point3> unit_vectors);

VertexEvidence evidence_at(const MapState& map, const VertexRecord& vertex);

}  // namespace foresight::carving
