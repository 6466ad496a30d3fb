// FORESIGHT_CHECK: an invariant of our own code. Stays on in Release; a broken one is a bug: it is
// logged with its place and the process ends with exit code 70. Never for outside data.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace foresight {
[[noreturn]] inline void check_failed(const char* file, int line, const char* what) {
  std::fprintf(stderr, "%s:%d: broken invariant: %s\n", file, line, what);
  std::fflush(stderr);
  std::_Exit(70);
}
}  // namespace foresight

#define FORESIGHT_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::foresight::check_failed(__FILE__, __LINE__, #condition))
