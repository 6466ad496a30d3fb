// Deltas of a carving that do not fit: what a mesher has to refuse as a whole.
#pragma once

#include <random>
#include <string>

#include "common/carving_delta.h"
#include "tests/carver/receiver.h"

namespace foresight::fuzz {

/// `delta` with one entry among the others that cannot be: unknown, repeated or extreme ids, a
/// vertex that is not finite or is moved under its cells, impossible votes, a cell that is there
/// already, a missing vertex. `before`: what the delta is to be applied to. No mesher may accept
/// it.
CarvingDelta made_impossible(CarvingDelta delta, const carver_test::Receiver& before,
                             std::mt19937& random);

/// `delta` with flipped bits and missing entries: may be applicable or not.
CarvingDelta corrupted(CarvingDelta delta, std::mt19937& random);

/// `delta` as messages and back, in parts of a random size. Empty parts of messages whose arrays do
/// not belong together are tried, too. "" or what is wrong.
std::string through_messages(const CarvingDelta& delta, std::mt19937& random,
                             CarvingDelta* received);

}  // namespace foresight::fuzz
