// How much memory this program needed at most. (What getrusage() says begins with what whoever
// started the program had in memory.) Linux only.
#pragma once

#include <malloc.h>

#include <fstream>
#include <string>

namespace foresight {

/// From here on peak_memory_mb() means what comes.
inline void forget_peak_memory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

/// Peak resident memory in MiB since the last forget_peak_memory(), else since the start.
inline double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kib = 0;
  while (status >> word) {
    if (word == "VmHWM:") status >> kib;
  }
  return kib / 1024;
}

}  // namespace foresight
