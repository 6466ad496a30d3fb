// CPU time of the calling thread: what work costs, however busy the machine is.
#pragma once

#include <ctime>

namespace foresight {

inline double thread_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

}  // namespace foresight
