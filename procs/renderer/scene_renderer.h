// Draws the scene as a camera would see it from a pose where no image was ever taken: a mesh,
// painted with images of known pose (paper §II-B, with several images and occlusion).
//
//   SceneRenderer scene;                                    // needs a current GlContext
//   if (scene.set_mesh(mesh) != InputStatus::kAccepted) …
//   if (scene.add_view({id, time, camera, map_from_cam, image}) != InputStatus::kAccepted) …
//   const RenderSummary drawn = scene.render(camera.undistorted(), map_from_predicted_cam);
//   hud.draw_texture(scene.colour(), rectangle, context.height_px());   // or scene.read_back()
//
// A pixel is painted by the newest view when that view sees its surface well, else by the first of
// the earlier views that does, else by whichever sees it best. What no view sees keeps a muted
// blue-grey shade. Every pixel says by whom it was painted (source codes below). Lengths are in map
// units of any scale: no constant here has a unit of length. docs/algorithms/rendering.md has the
// steps and costs.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/image.h"
#include "common/mesh.h"
#include "common/time.h"

namespace foresight {

/// A delayed image whose pose is known.
struct TexturingView {
  int64_t id = 0;  // a view with a known id replaces it
  Time time;       // capture time; the greatest is the newest view
  CameraModel camera;
  Pose<Map, Cam> map_from_cam;
  Image image;  // gray or RGB, as distorted as the camera says
};

enum class InputStatus { kAccepted, kBadImage, kBadCamera, kBadPose, kBadMesh };

struct SceneOptions {
  int stored_views = 24;         // newest and earlier ones, 1…64
  double depth_map_scale = 0.5;  // texels of a view's depth map per image pixel, 0.1…1
};

struct RenderOptions {
  int used_views = 6;             // per frame, newest included, 1…8
  double least_confidence = 0.8;  // of vertices: surface below it is a guess, 0…1
  bool paint_hull = true;  // paint surface that touches the bounding hull or is unsure (a guess)
  bool paint_background = true;  // paint what misses the mesh as if infinitely far (a guess)
};

enum class RenderStatus { kDrawn, kBadCamera, kBadPose };

struct RenderSummary {
  RenderStatus status = RenderStatus::kDrawn;
  std::vector<int64_t> view_ids;  // by rank, newest first
  Time newest_time;               // valid when view_ids is not empty
  int depth_maps_drawn = 0;
};

/// Source code of a pixel: which view painted it, and whether its geometry is measured.
constexpr uint8_t kSourceUnknown = 0;     // painted by no image
constexpr uint8_t kSourceNewest = 1;      // rank + 1; 2, 3, … are earlier views
constexpr uint8_t kSourceGuessBit = 128;  // bounding hull, unsure or no surface at all
constexpr int source_rank(uint8_t code) { return (code & 127) - 1; }  // −1: no view
constexpr bool source_is_guess(uint8_t code) { return (code & kSourceGuessBit) != 0; }

/// A drawn picture in memory, rows from the top.
struct RenderedFrame {
  Image rgb;
  std::vector<uint8_t> source;  // one code per pixel
  std::vector<float> depth_mu;  // along the optical axis; +infinity where no surface was hit
};

/// How much of a picture comes from where; shares of all pixels.
struct SourceShares {
  double newest = 0, earlier = 0, guess = 0, unknown = 0;  // guess: painted, on unsure geometry
};
SourceShares count_sources(const std::vector<uint8_t>& source);

class SceneRenderer {
 public:
  explicit SceneRenderer(const SceneOptions& options = {});  // throws GlError
  ~SceneRenderer();

  /// Replaces the mesh; an empty one is fine. A bad one (index out of range, NaN, wrong id count)
  /// changes nothing. O(n).
  [[nodiscard]] InputStatus set_mesh(const Mesh& mesh);
  /// Adds or replaces a view. Views must agree in image size and lens kind: another camera drops
  /// the earlier ones. Stored views are spread over viewing poses, see ViewStore.
  [[nodiscard]] InputStatus add_view(const TexturingView& view);
  /// The map restarted: old poses mean nothing.
  void clear_views();
  /// Drops the views that are newer than `time`: its stamps begin anew from there.
  void clear_views_after(Time time);
  /// Of the mesh, in map units; 0: unknown.
  double scene_size_mu() const;
  int stored_views() const;
  int triangles() const;

  /// Draws into colour(). The output camera must be free of distortion. Leaves its own framebuffer
  /// bound: bind yours afterwards.
  RenderSummary render(const CameraModel& camera, const Pose<Map, Cam>& map_from_predicted_cam,
                       const RenderOptions& options = {});

  /// Texture of the last picture, first row on top at t = 0; alpha holds the source code.
  unsigned colour() const;
  int width_px() const;
  int height_px() const;
  /// Copies the last picture to memory.
  RenderedFrame read_back() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace foresight
