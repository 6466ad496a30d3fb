#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/delta_stream.h"
#include "common/image.h"
#include "common/node.h"
#include "common/process_main.h"
#include "common/snapshot_gate.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "foresight/pose_hint_t.hpp"
#include "foresight/slam_answer_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "foresight/view_t.hpp"
#include "procs/slam/image_stream.h"
#include "procs/slam/intrinsics_choice.h"
#include "procs/slam/kept_map.h"
#include "procs/slam/map_shelf.h"
#include "procs/slam/order_book.h"
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

  /// `run`: within which the map outlives this process; none: it does not.
  SlamProcess(Node& node, const SlamParams& params, const std::optional<RunIdentity>& run);
  SlamProcess(Node& node, const SlamParams& params)
      : SlamProcess(node, params, node.is_simulated() ? std::nullopt : std::optional(this_run())) {}
  /// Ended on purpose: nobody is to go on in the kept map.
  ~SlamProcess() override;
  void start() override;

 private:
  // process.cc: images, poses, health
  void on_camera_info(const camera_info_t& message);
  void begin_with_camera();
  void begin_in_start_map();
  void on_image(const image_t& message);
  void track(const image_t& message, const Image& image);
  void reject(const char* why);  // the present IMAGE
  void on_hint(const pose_hint_t& hint);
  void on_request(const snapshot_request_t& request);
  void send_snapshot();
  camera_pose_t to_message(const TrackingResult& result) const;
  void publish_view(const image_t& image, const camera_pose_t& pose, bool is_keyframe);
  void update_epoch(Time time);
  void continue_mapping();
  void publish_delta();
  void note_relocalisation(const TrackingResult& result);
  int64_t images_passed_over() const;
  void watch_input();
  void publish_metrics(const TrackingResult& result);
  std::string trouble();
  void publish_health(const TrackingResult& result);

  // process_map.cc: the map on the disk
  struct FileOrder {
    Order order;
    StoredMap map;  // to be saved, or as loaded
    bool started = false, is_void = false;
  };
  void on_command(const slam_command_t& command);
  void answer(const Order& order, OrderOutcome outcome, const std::string& text);
  void refuse(const Order& order, const std::string& why);
  void fail(const Order& order, const std::string& why);
  void begin_file_order(const Order& order);
  bool start_file_job();
  void finish(const FileOrder& done, const std::string& trouble);
  void give_up_load(const char* why);
  bool take_over(const StoredMap& stored);
  void read_kept(const KeptMap::Mark& mark);
  bool wait_for_kept(const image_t& message);
  bool fits_kept(const image_t& message) const;
  void give_up_tiny_kept(const TrackingResult& result);
  bool start_keeping();

  Node& node_;
  SlamParams params_;
  Input camera_info_input_, image_input_, command_input_, hint_input_;
  Publisher<camera_pose_t> poses_;
  Publisher<view_t> views_;
  Publisher<slam_answer_t> answers_;
  DeltaSender<map_delta_t> deltas_;
  SnapshotGate snapshots_;
  IntrinsicsChoice camera_;
  Time last_doubt_;  // of a CAMERA_INFO, on our clock
  ImageStream images_;
  std::unique_ptr<Slam> slam_;
  int generation_ = 0;  // of slam_; jobs of an earlier one are dropped
  int core_epoch_ = -1;
  int64_t epoch_ = 0;  // utime at which the core's present epoch began
  bool epoch_is_sent_ = false;
  Time data_time_, last_image_, last_view_;  // the camera's clock
  Time last_arrival_, last_rejection_;       // ours
  double track_ms_ = 0;                      // CPU time of the newest image
  Time relocalised_at_;                      // ours
  std::string relocalised_;                  // what the health says of it for a while; or empty
  std::string rejection_;

  std::optional<StoredMap> start_map_;  // params' map_folder, until its camera comes
  MapShelf shelf_;
  OrderBook orders_;
  std::shared_ptr<FileOrder> file_order_;  // waiting for the worker, or there
  std::string file_trouble_;               // of the last order, for the health

  struct KeptStart {
    StoredMap map;
    KeptMap::Mark mark;
    std::optional<Time> first_image;  // on our clock
  };
  std::shared_ptr<KeptMap> kept_;  // shared with the worker; none: nothing is kept
  std::optional<RunIdentity> run_;
  bool reading_kept_ = false;
  std::optional<KeptStart> kept_start_;  // read, until an image fits it
  std::optional<int64_t> kept_epoch_;    // the core's next epoch goes on with that one
  bool in_kept_map_ = false;
  bool changed_since_kept_ = false;
  bool remove_kept_ = false;
  Time kept_at_;
  Duration keep_pause_;    // after that
  int keep_failures_ = 0;  // running
  std::string keep_trouble_;
};

}  // namespace foresight
