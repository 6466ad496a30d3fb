// The surface between carved and uncarved cells as a triangle mesh (paper §II-A).
//
// What lies outside the hull counts as uncarved: carved cells on the hull are closed off by their
// hull facets, so the mesh bounds the carved space and is always closed.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh.h"
#include "procs/mesher/cell_complex.h"

namespace foresight {

/// What to do where the surface touches itself in a vertex or along an edge.
enum class ManifoldRepair {
  kNone,   // one mesh vertex per map point; closed and oriented, but perhaps not manifold
  kSplit,  // take touching sheets apart: every edge has two triangles, every vertex one fan
};

struct Isosurface {
  Mesh mesh;
  int32_t split_vertices = 0;  // mesh vertices beyond one per map point
  int32_t split_edges = 0;     // edges that got a vertex in their middle
};

/// Facets between cells with `carved[cell]` and the rest, in the order of cells. The normals point
/// into carved space. `carved` has complex.cell_limit() entries, zero where no cell exists.
/// O(cells + triangles).
Isosurface extract_isosurface(const CellComplex& complex, const IdVector<CellId, uint8_t>& carved,
                              ManifoldRepair repair);

}  // namespace foresight
