// What other systems reached on the same sequences, for the table: live poses of every frame,
// Sim(3) aligned, medians of 3 to 5 runs on a machine of the same kind.
#pragma once

#include <string>
#include <vector>

namespace foresight {

struct PeerResult {
  const char* sequence;
  const char* system;
  const char* tracked;
  const char* first_frame;
  const char* ate;
  const char* track_ms;  // median, p95
  const char* points;
};

std::vector<PeerResult> peers_on(const std::string& sequence);

}  // namespace foresight
