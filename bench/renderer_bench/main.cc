// What drawing costs, step by step, on a recorded session: its delayed VIEW and MESH are played in
// order as fast as drawing goes, and between two views the predicted view is drawn from where the
// camera will be 0.3 s later, as the renderer does. Every step is waited for (glFinish), so the sum
// is a little more than what the renderer takes, which overlaps steps.
//
//   scripts/evaluate --sim --base still --log out/log
//   scripts/run renderer-bench out/log/base_still_0.30/operator.lcmlog --from 8
#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/image_codec.h"
#include "common/lcm_log.h"
#include "common/message_check.h"
#include "common/messages.h"
#include "common/tool_main.h"
#include "foresight/view_t.hpp"
#include "procs/renderer/gl_context.h"
#include "procs/renderer/hud.h"
#include "procs/renderer/scene_renderer.h"
#include "procs/renderer/video_renderer.h"

namespace foresight {
namespace {

constexpr Duration kAhead = milliseconds(300);

struct PosedView {
  Time time;
  int64_t epoch;
  std::optional<Pose<Map, Cam>> map_from_cam;
};

struct Options {
  std::string log;
  double from_s = 0;
  int pictures_per_view = 2, used_views = RenderOptions{}.used_views;
};

/// Times of each step, wall and CPU (summed over threads).
class Stopwatches {
 public:
  template <class Step>
  void time(const std::string& name, const Step& step) {
    const auto wall = std::chrono::steady_clock::now();
    const auto cpu = std::clock();
    step();
    glFinish();
    const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - wall;
    if (!steps_.contains(name)) order_.push_back(name);
    steps_[name].wall_ms.push_back(spent.count());
    steps_[name].cpu_ms += 1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  }
  void print() {
    std::printf("%-28s %6s %9s %9s %9s\n", "step", "times", "CPU mean", "wall med.", "wall 95 %");
    for (const std::string& name : order_) {
      Step& step = steps_[name];
      std::sort(step.wall_ms.begin(), step.wall_ms.end());
      const size_t n = step.wall_ms.size();
      std::printf("%-28s %6zu %6.1f ms %6.1f ms %6.1f ms\n", name.c_str(), n,
                  step.cpu_ms / static_cast<double>(n), step.wall_ms[n / 2],
                  step.wall_ms[n * 95 / 100]);
    }
  }

 private:
  struct Step {
    std::vector<double> wall_ms;
    double cpu_ms = 0;
  };
  std::map<std::string, Step> steps_;
  std::vector<std::string> order_;
};

std::vector<PosedView> read_poses(const std::string& path) {
  std::vector<PosedView> poses;
  LogReader log(path);
  while (const auto event = log.next()) {
    if (event->channel != "VIEW") continue;
    const auto view = decode_checked<view_t>(event->bytes);
    if (view) poses.push_back({{view->utime}, view->pose.epoch, read_pose(view->pose)});
  }
  return poses;
}

/// The renderer's order of work, without bus and clock.
class Bench {
 public:
  explicit Bench(const Options& options) : options_(options), poses_(read_poses(options.log)) {}

  void run() {
    LogReader log(options_.log);
    std::optional<Time> begin;
    while (const auto event = log.next()) {
      if (!begin) begin = event->time;
      is_counted_ = (event->time - *begin).seconds() >= options_.from_s;
      if (event->channel == "CAMERA_INFO") on_camera(event->bytes);
      if (event->channel == "MESH") on_mesh(event->bytes);
      if (event->channel == "VIEW") on_view(event->bytes);
    }
    if (drawn_ == 0) throw UnavailableError(options_.log + ": no view could be predicted");
    watches_.print();
    std::printf("%d pictures, %.1f depth maps a picture, %d triangles at last\n", drawn_,
                static_cast<double>(depth_maps_) / drawn_, scene_.triangles());
    log.require_whole();
  }

 private:
  void on_camera(const std::vector<uint8_t>& bytes) {
    const auto message = decode_checked<camera_info_t>(bytes);
    if (message) camera_ = from_message(*message);
  }
  void on_mesh(const std::vector<uint8_t>& bytes) {
    const auto message = decode_checked<mesh_t>(bytes);
    const auto mesh = message ? from_message(*message) : std::nullopt;
    if (mesh) timed("new mesh", [&] { require(scene_.set_mesh(*mesh), "MESH"); });
    if (message) mesh_epoch_ = message->epoch;
  }
  void on_view(const std::vector<uint8_t>& bytes) {
    const auto message = decode_checked<view_t>(bytes);
    if (!message || !camera_) return;
    std::optional<Image> image;
    timed("decode an image", [&] { image = decode_image(message->image, 3); });
    if (!image) return;
    const auto pose = read_pose(message->pose);
    timed("take in an image", [&] {
      if (pose) {
        const Time time{message->utime};
        require(scene_.add_view({time.us, time, *camera_, *pose, *image}), "VIEW");
      }
      require(video_.set_image(*camera_, *image), "VIEW");
    });
    timed("draw the delayed picture", [&] { video_.draw(camera_->undistorted()); });
    if (!pose || mesh_epoch_ != message->pose.epoch || scene_.triangles() == 0) return;
    for (int i = 0; i < options_.pictures_per_view; ++i) predict({message->utime}, mesh_epoch_, i);
  }
  void predict(Time now, int64_t epoch, int picture) {
    const auto ahead = std::find_if(poses_.begin(), poses_.end(), [&](const PosedView& view) {
      return view.time >= now + kAhead && view.epoch == epoch && view.map_from_cam;
    });
    if (ahead == poses_.end()) return;
    timed(picture == 0 ? "predicted view, new image" : "predicted view again", [&] {
      const auto summary = scene_.render(camera_->undistorted(), *ahead->map_from_cam,
                                         {.used_views = options_.used_views});
      depth_maps_ += is_counted_ ? summary.depth_maps_drawn : 0;
    });
    timed("compose", [&] {
      const Places places = place_pictures(Layout::kSideBySide, 1280, 480, 4.0 / 3.0);
      context_.bind();
      hud_.clear();
      hud_.draw_texture(video_.colour(), *places.delayed, 480);
      hud_.draw_texture(scene_.colour(), *places.predicted, 480);
      hud_.draw_panel({Badge::kOk, "PREDICTED", {"delay 300 ms"}}, *places.predicted, 480);
    });
    drawn_ += is_counted_ ? 1 : 0;
  }
  void require(InputStatus status, const std::string& channel) const {
    if (status != InputStatus::kAccepted) {
      throw UnavailableError(options_.log + ": a message on " + channel + " cannot be drawn");
    }
  }
  template <class Step>
  void timed(const std::string& name, const Step& step) {
    is_counted_ ? watches_.time(name, step) : step();
  }

  Options options_;
  std::vector<PosedView> poses_;
  OffscreenContext context_{1280, 480};
  SceneRenderer scene_;
  VideoRenderer video_;
  Hud hud_;
  Stopwatches watches_;
  std::optional<CameraModel> camera_;
  int64_t mesh_epoch_ = 0;
  int drawn_ = 0, depth_maps_ = 0;
  bool is_counted_ = false;
};

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  Options options;
  CLI::App app("Times drawing the predicted view, step by step, on a recorded session.",
               "renderer-bench");
  app.add_option("log", options.log, "log of the operator's domain: CAMERA_INFO, VIEW, MESH")
      ->required();
  app.add_option("--from", options.from_s, "skip so many seconds")->capture_default_str();
  app.add_option("--pictures-per-view", options.pictures_per_view, "drawn from each new image")
      ->check(CLI::Range(1, 10))
      ->capture_default_str();
  app.add_option("--used-views", options.used_views, "textures used in one picture")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  return tool_main(app, argc, argv, [&] {
    Bench(options).run();
    return kExitDone;
  });
}
