// What a complex, its labels and a mesh come to, independent of the order of indices, and what must
// hold of every mesh: for the mesher's tests and the fuzzer.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "common/mesh.h"
#include "procs/mesher/mesher.h"

namespace foresight {

/// All that a complex holds: corner ids → what is known of the cell.
struct CellContent {
  int32_t constraints = 0;
  CellVotes votes;  // CellVotes::entered in the order of the corners' ids
  double volume = 0;
  std::map<VertexId, VertexEvidence> evidence;  // of its corners
  std::multiset<std::multiset<VertexId>> neighbours;
  bool operator==(const CellContent&) const = default;
};
using ComplexContent = std::map<std::multiset<VertexId>, CellContent>;
ComplexContent content(const CellComplex& complex);

/// The labels of the last update by the cells' vertices, ascending.
using Labels = std::map<std::array<VertexId, 4>, uint8_t>;
Labels labels(const Mesher& mesher);

/// The triangles around every vertex form one ring.
bool has_one_fan_per_vertex(const Mesh& mesh);

/// The first thing wrong with the mesh, or "": closed, oriented, two triangles on every edge, one
/// fan around every vertex, one id for each vertex.
std::string find_problem(const Mesh& mesh);

}  // namespace foresight
