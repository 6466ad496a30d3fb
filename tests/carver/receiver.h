// What a receiver of CarvingDeltas knows: applies them by the book and complains about any breach.
#pragma once

#include <array>
#include <map>
#include <string>

#include "common/carving_delta.h"

namespace foresight::carver_test {

/// What is known of a cell: number of constraints, and votes in the order of its vertex ids.
struct CellFacts {
  int32_t constraints = -1;  // −1: no such cell
  CellVotes votes = {};
  bool operator==(const CellFacts&) const = default;
};
/// By vertex ids in ascending order.
using Carving = std::map<std::array<VertexId, 4>, CellFacts>;

/// Empty if equal, else the cells that differ: "(a b c d) 3 not 5; …" (−1 = no such cell), votes
/// behind.
std::string differences(const Carving& actual, const Carving& expected);

class Receiver {
 public:
  /// Returns the first breach of the contract in carving_delta.h, or "".
  std::string apply(const CarvingDelta& delta);
  Carving carving() const;
  const std::map<VertexId, Eigen::Vector3f>& vertices() const { return vertices_; }
  const std::map<VertexId, VertexEvidence>& evidence() const { return evidence_; }
  const std::map<CellId, CarvingCell>& cells() const { return cells_; }

 private:
  std::string update_vertices(const std::vector<CarvingVertexUpdate>& updates);
  std::string check() const;

  std::map<VertexId, Eigen::Vector3f> vertices_;
  std::map<VertexId, VertexEvidence> evidence_;
  std::map<CellId, CarvingCell> cells_;
};

}  // namespace foresight::carver_test
