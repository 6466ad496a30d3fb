#include "common/realtime.h"

#include <sched.h>

#include <cstdlib>
#include <filesystem>

namespace foresight {

bool schedule_in_real_time(int priority) {
  sched_param param{};
  param.sched_priority = priority;
  bool all = true;
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    const pid_t thread = std::atoi(task.path().filename().c_str());
    all = sched_setscheduler(thread, SCHED_FIFO, &param) == 0 && all;
  }
  return all && !error;
}

}  // namespace foresight
