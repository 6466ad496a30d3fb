// Between messages and core types. Decoding has already proved sizes and finiteness
// (message_check.h); what is checked here is meaning: unit quaternions, ids ≥ 0, counts that belong
// together. A function that reads returns false or nothing on bad data and leaves its output alone.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/carving_delta.h"
#include "common/frames.h"
#include "common/map_delta.h"
#include "common/mesh.h"
#include "common/time.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/carving_delta_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/pose_hint_t.hpp"

namespace foresight {

/// Datagrams stay well below what a socket buffer of 4 MiB takes in one burst.
constexpr size_t kMaxDeltaBytes = 400'000;

camera_info_t to_message(const CameraModel& camera, Time time);
std::optional<CameraModel> from_message(const camera_info_t& message);

void write_pose(const Pose<Map, Cam>& map_from_cam, camera_pose_t* message);
/// The pose, when the message says it is tracking and its quaternion is one.
std::optional<Pose<Map, Cam>> read_pose(const camera_pose_t& message);

void write_pose(const Pose<Map, Cam>& map_from_cam, pose_hint_t* message);
std::optional<Pose<Map, Cam>> read_pose(const pose_hint_t& message);

/// The delta in one or more parts of at most `max_bytes`; headers carry part and part_count only.
std::vector<map_delta_t> split(const MapDelta& delta, size_t max_bytes);
std::vector<carving_delta_t> split(const CarvingDelta& delta, size_t max_bytes);
/// Appends one part.
[[nodiscard]] bool append(const map_delta_t& part, MapDelta* delta);
[[nodiscard]] bool append(const carving_delta_t& part, CarvingDelta* delta);

mesh_t to_message(const Mesh& mesh);
std::optional<Mesh> from_message(const mesh_t& message);

}  // namespace foresight
