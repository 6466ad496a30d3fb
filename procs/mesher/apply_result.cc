#include "procs/mesher/apply_result.h"

namespace foresight {

std::string_view to_string(ApplyResult result) {
  switch (result) {
    case ApplyResult::kOk:
      return "ok";
    case ApplyResult::kUnknownCell:
      return "unknown cell";
    case ApplyResult::kDuplicateCell:
      return "duplicate cell";
    case ApplyResult::kCellIdOutOfRange:
      return "cell id out of range";
    case ApplyResult::kUnknownVertex:
      return "unknown vertex";
    case ApplyResult::kVertexIdOutOfRange:
      return "vertex id out of range";
    case ApplyResult::kVertexInUse:
      return "vertex in use";
    case ApplyResult::kBadPosition:
      return "position not finite";
    case ApplyResult::kBadConstraints:
      return "impossible constraint count or votes";
    case ApplyResult::kBadEvidence:
      return "impossible evidence of a vertex";
    case ApplyResult::kRepeatedVertex:
      return "repeated vertex in a cell";
    case ApplyResult::kInvertedCell:
      return "inverted cell";
    case ApplyResult::kCrowdedFacet:
      return "more than two cells on a facet";
    case ApplyResult::kOverlappingCells:
      return "two cells on one side of a facet";
  }
  return "unknown result";
}

}  // namespace foresight
