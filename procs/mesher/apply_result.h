// Whether a CarvingDelta was taken in.
#pragma once

#include <string_view>

namespace foresight {

/// Why a delta was rejected. Anything but kOk means that the receiver needs a snapshot.
enum class ApplyResult {
  kOk,
  kUnknownCell,         // removed or updated, but not there
  kDuplicateCell,       // added, but already there
  kCellIdOutOfRange,    // negative, or absurdly large for the number of cells
  kUnknownVertex,       // removed or referred to, but not there
  kVertexIdOutOfRange,  // below the last hull corner
  kVertexInUse,         // removed or moved, but cells still hang on it
  kBadPosition,         // not finite
  kBadConstraints,      // negative or absurd count, or more votes than constraints
  kBadEvidence,         // of a vertex: negative count, spread not within 0…π
  kRepeatedVertex,      // within one cell
  kInvertedCell,        // negatively oriented, beyond what rounding positions to float explains
  kCrowdedFacet,        // more than two cells on one facet
  kOverlappingCells,    // two cells on the same side of a facet
};
std::string_view to_string(ApplyResult result);

}  // namespace foresight
