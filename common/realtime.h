// Real-time scheduling, for processes whose timing is their purpose (link, controllers).
#pragma once

namespace foresight {

/// Gives every thread that this process has now (LCM's receiver included) the SCHED_FIFO policy, so
/// that ordinary load does not delay it. False without the right to (root, CAP_SYS_NICE or an
/// RLIMIT_RTPRIO of at least `priority`); the process then runs on as it was.
[[nodiscard]] bool schedule_in_real_time(int priority);

}  // namespace foresight
