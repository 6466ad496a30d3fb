// Every message type, for tests that hold for all of them. A new type belongs here: the contract
// test of fingerprints fails until it does.
#pragma once

#include <cstddef>

#include "foresight/alignment_t.hpp"
#include "foresight/arm_encoders_t.hpp"
#include "foresight/arm_torques_t.hpp"
#include "foresight/base_pose_t.hpp"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/carving_delta_t.hpp"
#include "foresight/controller_state_t.hpp"
#include "foresight/delta_header_t.hpp"
#include "foresight/device_state_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/health_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "foresight/link_flow_t.hpp"
#include "foresight/link_stats_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/pendant_t.hpp"
#include "foresight/port_health_t.hpp"
#include "foresight/pose_hint_t.hpp"
#include "foresight/sim_clock_t.hpp"
#include "foresight/slam_answer_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "foresight/snapshot_request_t.hpp"
#include "foresight/truth_t.hpp"
#include "foresight/view_t.hpp"

namespace foresight {

template <class... Messages>
struct MessageList {
  static constexpr size_t kSize = sizeof...(Messages);
};

using AllMessages =
    MessageList<alignment_t, arm_encoders_t, arm_torques_t, base_pose_t, camera_info_t,
                camera_pose_t, carving_delta_t, controller_state_t, delta_header_t, device_state_t,
                display_stats_t, health_t, image_t, joint_command_t, joint_state_t, link_flow_t,
                link_stats_t, map_delta_t, mesh_t, pendant_t, port_health_t, pose_hint_t,
                sim_clock_t, slam_answer_t, slam_command_t, snapshot_request_t, truth_t, view_t>;

/// Calls call.operator()<Message>() for each type.
template <class Call, class... Messages>
void for_each_message(MessageList<Messages...>, const Call& call) {
  (call.template operator()<Messages>(), ...);
}

}  // namespace foresight
