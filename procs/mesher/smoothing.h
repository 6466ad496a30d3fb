// Evens the mesh out without entering what constraints say is free.
//
// A vertex may move towards the middle of its neighbours when no triangle around it sweeps, on its
// way, through a cell that a constraint crosses. So none that did not meet the mesh before meets it
// afterwards, and no vertex lies on one: the surface only gives way to where nothing was seen.
// Vertices that touch the hull, or share their map point with another, stay; so does the topology.
#pragma once

#include <cstdint>

#include "common/mesh.h"
#include "procs/mesher/cell_complex.h"

namespace foresight {

/// `mesh` is the unsmoothed surface of `complex`. Each pass tries to move each vertex half the way
/// once, in their order. Returns how many moves were made. O(triangles) per pass, with some hundred
/// overlap tests for each.
int32_t smooth(const CellComplex& complex, int32_t passes, Mesh* mesh);

}  // namespace foresight
