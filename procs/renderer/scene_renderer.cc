#include "procs/renderer/scene_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "procs/renderer/depth_camera.h"
#include "procs/renderer/paint_pass.h"
#include "procs/renderer/surface_pass.h"
#include "procs/renderer/view_store.h"

namespace foresight {
namespace {

// Of all stored views together: those of huge images are fewer.
constexpr int64_t kMostTextureBytes = 1'500'000'000;

/// A framebuffer for surfaces: a float texture that is attached from outside, and a depth buffer.
struct SurfaceTarget {
  GlFramebuffer framebuffer;
  GlRenderbuffer depth;
  int width_px = 0, height_px = 0;

  void bind(int width, int height) {
    if (framebuffer.name() == 0) framebuffer = make_framebuffer();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    if (width == width_px && height == height_px) return;
    depth = make_depth_buffer(width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth.name());
    width_px = width;
    height_px = height;
  }
};

bool same_layout(const CameraModel& a, const CameraModel& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && shader_lens(a) == shader_lens(b);
}

}  // namespace

struct SceneRenderer::State {
  explicit State(const SceneOptions& given)
      : options{std::clamp(given.stored_views, 1, 64), std::clamp(given.depth_map_scale, 0.1, 1.0)},
        store(options.stored_views) {}

  SceneOptions options;
  ViewStore store;
  SurfacePass surface_pass;
  PaintPass paint_pass;
  int64_t mesh_number = 0;
  CameraModel layout;  // camera for which the texture arrays were made
  GlTexture images, depths;
  DepthMapSize depth_size;
  SurfaceTarget depth_target, surface_target;
  GlTexture surface;
  PictureTarget picture;
  std::vector<uint8_t> scratch;

  bool has_mesh() const { return surface_pass.triangles() > 0; }
  void make_arrays(const CameraModel& camera);
  void draw_depth_map(StoredView* view);
  void draw_surface(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam,
                    double least_confidence);
};

void SceneRenderer::State::make_arrays(const CameraModel& camera) {
  depth_size = depth_map_size(camera, options.depth_map_scale);
  const int64_t view_bytes = 4 * (int64_t{camera.width_px} * camera.height_px +
                                  int64_t{depth_size.width_px} * depth_size.height_px);
  const int layers = static_cast<int>(
      std::clamp<int64_t>(kMostTextureBytes / view_bytes, 1, options.stored_views));
  store = ViewStore(layers);
  images = make_texture_array(GL_RGBA8, camera.width_px, camera.height_px, layers, GL_LINEAR);
  depths =
      make_texture_array(GL_R32F, depth_size.width_px, depth_size.height_px, layers, GL_NEAREST);
  layout = camera;
}

void SceneRenderer::State::draw_depth_map(StoredView* view) {
  const CameraModel& camera = view->depth_camera;
  depth_target.bind(camera.width_px, camera.height_px);
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, depths.name(), 0, view->slot);
  require_complete_framebuffer("depth map");
  surface_pass.draw(camera, view->map_from_cam.inverse(), 0);
  view->depth_mesh = mesh_number;
}

void SceneRenderer::State::draw_surface(const CameraModel& camera,
                                        const Pose<Map, Cam>& map_from_cam,
                                        double least_confidence) {
  const bool resized =
      camera.width_px != surface_target.width_px || camera.height_px != surface_target.height_px;
  surface_target.bind(camera.width_px, camera.height_px);
  if (resized) {
    surface = make_texture(GL_RGBA32F, camera.width_px, camera.height_px, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, surface.name(), 0);
    require_complete_framebuffer("surface");
  }
  surface_pass.draw(camera, map_from_cam.inverse(), least_confidence);
}

SceneRenderer::SceneRenderer(const SceneOptions& options)
    : state_(std::make_unique<State>(options)) {}
SceneRenderer::~SceneRenderer() = default;

InputStatus SceneRenderer::set_mesh(const Mesh& mesh) {
  if (!state_->surface_pass.set_mesh(mesh)) return InputStatus::kBadMesh;
  ++state_->mesh_number;
  return InputStatus::kAccepted;
}

InputStatus SceneRenderer::add_view(const TexturingView& view) {
  State& s = *state_;
  if (!is_sound(view.camera)) return InputStatus::kBadCamera;
  if (!view.image.is_valid() || view.image.width_px != view.camera.width_px ||
      view.image.height_px != view.camera.height_px) {
    return InputStatus::kBadImage;
  }
  if (!view.map_from_cam.is_finite()) return InputStatus::kBadPose;
  CameraModel camera = view.camera;
  if (camera.max_radius == CameraModel{}.max_radius) camera.prepare();  // not prepared yet
  if (s.images.name() == 0 || !same_layout(s.layout, camera)) s.make_arrays(camera);
  StoredView& kept =
      s.store.insert(view.id, view.time, camera, view.map_from_cam, s.surface_pass.scene_size_mu());
  kept.depth_camera = depth_camera_for(camera, s.depth_size.width_px, s.depth_size.height_px);
  upload_layer(s.images.name(), kept.slot, view.image, &s.scratch);
  return InputStatus::kAccepted;
}

void SceneRenderer::clear_views() { state_->store.clear(); }
void SceneRenderer::clear_views_after(Time time) { state_->store.clear_after(time); }
double SceneRenderer::scene_size_mu() const { return state_->surface_pass.scene_size_mu(); }
int SceneRenderer::stored_views() const { return state_->store.size(); }
int SceneRenderer::triangles() const { return state_->surface_pass.triangles(); }

RenderSummary SceneRenderer::render(const CameraModel& camera,
                                    const Pose<Map, Cam>& map_from_predicted_cam,
                                    const RenderOptions& options) {
  State& s = *state_;
  RenderSummary summary;
  if (!is_sound(camera) || camera.has_distortion()) summary.status = RenderStatus::kBadCamera;
  if (!map_from_predicted_cam.is_finite()) summary.status = RenderStatus::kBadPose;
  if (summary.status != RenderStatus::kDrawn) return summary;

  const ViewQuery query{map_from_predicted_cam, camera, &s.surface_pass.samples_in_map(),
                        s.surface_pass.scene_size_mu(),
                        std::clamp(options.used_views, 1, kMaxUsedViews)};
  std::vector<PaintView> views;
  for (StoredView* view : s.store.select(query)) {
    if (s.has_mesh() && view->depth_mesh != s.mesh_number) {
      s.draw_depth_map(view);
      ++summary.depth_maps_drawn;
    }
    const Pose<Cam, Cam> view_from_pred = view->map_from_cam.inverse() * map_from_predicted_cam;
    views.push_back({.view_from_pred_rotation = view_from_pred.rotation().toRotationMatrix(),
                     .view_from_pred_translation = view_from_pred.translation(),
                     .camera = view->camera,
                     .depth_camera = view->depth_camera,
                     .layer = view->slot});
    if (summary.view_ids.empty()) summary.newest_time = view->time;
    summary.view_ids.push_back(view->id);
  }
  std::optional<unsigned> surface;
  if (s.has_mesh()) {
    s.draw_surface(camera, map_from_predicted_cam, options.least_confidence);
    surface = s.surface.name();
  }
  s.picture.bind(camera.width_px, camera.height_px);
  s.paint_pass.draw({.camera = camera,
                     .surface = surface,
                     .images = s.images.name(),
                     .depths = s.depths.name(),
                     .paint_hull = options.paint_hull,
                     .paint_background = options.paint_background,
                     .views = std::move(views)});
  return summary;
}

unsigned SceneRenderer::colour() const { return state_->picture.texture(); }
int SceneRenderer::width_px() const { return state_->picture.width_px(); }
int SceneRenderer::height_px() const { return state_->picture.height_px(); }

RenderedFrame SceneRenderer::read_back() const {
  const State& s = *state_;
  RenderedFrame frame;
  s.picture.read(&frame.rgb, &frame.source);
  frame.depth_mu.assign(frame.source.size(), std::numeric_limits<float>::infinity());
  if (!s.has_mesh() || s.surface_target.width_px != s.picture.width_px() ||
      s.surface_target.height_px != s.picture.height_px()) {
    return frame;
  }
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.surface_target.framebuffer.name());
  glReadPixels(0, 0, s.picture.width_px(), s.picture.height_px(), GL_RED, GL_FLOAT,
               frame.depth_mu.data());
  for (float& value : frame.depth_mu) {
    value = value > 0 ? 1.0f / value : std::numeric_limits<float>::infinity();
  }
  return frame;
}

SourceShares count_sources(const std::vector<uint8_t>& source) {
  SourceShares shares;
  for (const uint8_t code : source) {
    if (source_rank(code) < 0)
      shares.unknown += 1;
    else if (source_is_guess(code))
      shares.guess += 1;
    else if (code == kSourceNewest)
      shares.newest += 1;
    else
      shares.earlier += 1;
  }
  const double pixels = source.empty() ? 1.0 : static_cast<double>(source.size());
  return {shares.newest / pixels, shares.earlier / pixels, shares.guess / pixels,
          shares.unknown / pixels};
}

}  // namespace foresight
