#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "common/delta_stream.h"
#include "common/image.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "foresight/pose_hint_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "foresight/view_t.hpp"
#include "procs/slam/params.h"
#include "procs/slam/slam.h"
#include "procs/slam/stored_map.h"

namespace foresight {

/// IMAGE, CAMERA_INFO and POSE_HINT in; CAMERA_POSE, VIEW and MAP_DELTA out (paper §II-A).
class SlamProcess : public Process {
 public:
  using Params = SlamParams;
  static constexpr ProcessInfo kInfo{
      "slam", "Tracks the camera and maps the scene by monocular keyframe SLAM.", Domain::kRobot};

  SlamProcess(Node& node, const SlamParams& params);

 private:
  void on_camera_info(const camera_info_t& message);
  void on_image(const image_t& message);
  void reject(const char* why);  // the present IMAGE
  void on_command(const slam_command_t& command);
  void on_hint(const pose_hint_t& hint);
  void on_request(const snapshot_request_t& request);
  camera_pose_t to_message(const TrackingResult& result) const;
  void publish_view(const image_t& image, const camera_pose_t& pose, bool is_keyframe);
  void update_epoch(Time time);
  void continue_mapping();
  bool start_file_job();
  bool take_over(const StoredMap& stored, const std::string& folder);
  void report_trouble(const std::string& trouble);
  void drop_loads();
  void publish_delta();
  void note_relocalisation(const TrackingResult& result);
  void publish_health(const TrackingResult& result);

  Node& node_;
  SlamParams params_;
  Publisher<camera_pose_t> poses_;
  Publisher<view_t> views_;
  DeltaSender<map_delta_t> deltas_;
  std::optional<CameraModel> camera_;
  std::unique_ptr<Slam> slam_;
  int generation_ = 0;  // of slam_; jobs of an earlier one are dropped
  int core_epoch_ = -1;
  int64_t epoch_ = 0;  // utime at which the core's present epoch began
  bool epoch_is_sent_ = false;
  Time data_time_, last_image_, last_view_;  // the camera's clock
  Time last_arrival_, last_rejection_;       // ours
  Time relocalised_at_;                      // ours
  std::string relocalised_;                  // what the health says of it for a while; or empty
  std::string rejection_;
  std::optional<StoredMap> start_map_;  // params' map_folder, until its camera comes
  struct FileOrder {
    bool save = false;
    std::string folder;
    StoredMap map;
    int load_mark = 0;
  };
  std::deque<FileOrder> file_orders_;  // waiting for the worker
  int load_mark_ = 0;                  // loads with an older one are void
  std::string file_trouble_;           // of the last order, for the health
};

}  // namespace foresight
