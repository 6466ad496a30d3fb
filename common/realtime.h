// Real-time scheduling, for processes whose timing is their purpose (link, controllers).
#pragma once

namespace foresight {

/// Gives every thread that this process has now (the bus's receivers included) the SCHED_FIFO
/// policy, so that ordinary load does not delay it. False without the right to (root, CAP_SYS_NICE
/// or an RLIMIT_RTPRIO of at least `priority`); the process then runs on as it was.
///
/// A thread that computes for half a second without waiting once loses the policy, and with it all
/// others of the process: what spins, for whatever reason, must not starve the machine.
[[nodiscard]] bool schedule_in_real_time(int priority);

/// The policy was lost in that way.
bool has_lost_real_time();

}  // namespace foresight
