#include "procs/renderer/paint_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/check.h"

namespace foresight {
namespace {

/// An occluder whose neglect would shift the texture by less than this is not believed: it is
/// within the rounding of the depth map.
constexpr double kLeastShift_px = 0.75;
/// Views that get a pass of their own. What these leave is little, and the pass that searches all
/// views costs more per pixel but less than a further pass over the whole picture.
constexpr size_t kOwnPasses = 2;

/// std140 layout of `View` in the shader.
struct GpuView {
  std::array<float, 16> view_from_pred;
  std::array<float, 4> centre_in_pred, image_matrix, depth_matrix, distortion, k3_radius_layer,
      sizes;
  std::array<float, 24> padding;
};
static_assert(sizeof(GpuView) == 256);  // every driver can bind a block at a multiple of this

std::array<float, 4> matrix_of(const CameraModel& camera) {
  return {static_cast<float>(camera.fx_px), static_cast<float>(camera.fy_px),
          static_cast<float>(camera.cx_px), static_cast<float>(camera.cy_px)};
}

GpuView gpu_view(const PaintView& view, size_t rank) {
  GpuView gpu{};
  Eigen::Map<Eigen::Matrix4f> matrix(gpu.view_from_pred.data());
  matrix.setIdentity();
  matrix.topLeftCorner<3, 3>() = view.view_from_pred_rotation.cast<float>();
  matrix.topRightCorner<3, 1>() = view.view_from_pred_translation.cast<float>();
  const Eigen::Vector3f centre =
      (-view.view_from_pred_rotation.transpose() * view.view_from_pred_translation).cast<float>();
  const double shift_per_gap = view.camera.fx_px * view.view_from_pred_translation.norm();
  const double least_gap = std::min(kLeastShift_px / std::max(shift_per_gap, 1e-30), 1e30);
  gpu.centre_in_pred = {centre.x(), centre.y(), centre.z(), static_cast<float>(least_gap)};
  gpu.image_matrix = matrix_of(view.camera);
  gpu.depth_matrix = matrix_of(view.depth_camera);
  const auto& k = view.camera.distortion;
  std::transform(k.begin(), k.begin() + 4, gpu.distortion.begin(),
                 [](double value) { return static_cast<float>(value); });
  const double radius = std::min(view.camera.max_radius, 1e9);
  gpu.k3_radius_layer = {static_cast<float>(k[4]), static_cast<float>(radius * radius),
                         static_cast<float>(view.layer), static_cast<float>(rank)};
  gpu.sizes = {static_cast<float>(view.camera.width_px), static_cast<float>(view.camera.height_px),
               static_cast<float>(view.depth_camera.width_px),
               static_cast<float>(view.depth_camera.height_px)};
  return gpu;
}

}  // namespace

ShaderLens shader_lens(const CameraModel& camera) {
  if (!camera.has_distortion()) return ShaderLens::kPinhole;
  return camera.lens == LensModel::kRadtan ? ShaderLens::kRadtan : ShaderLens::kEquidistant;
}

bool is_sound(const CameraModel& camera) {
  constexpr int kMaxSide_px = 8192;
  const auto finite = [](double value) { return std::isfinite(value) && std::abs(value) < 1e7; };
  return camera.width_px > 0 && camera.height_px > 0 && camera.width_px <= kMaxSide_px &&
         camera.height_px <= kMaxSide_px && finite(camera.fx_px) && finite(camera.fy_px) &&
         camera.fx_px > 0 && camera.fy_px > 0 && finite(camera.cx_px) && finite(camera.cy_px) &&
         std::all_of(camera.distortion.begin(), camera.distortion.end(), finite) &&
         camera.max_radius > 0;
}

struct PaintPass::Program {
  GlProgram program;
  GLint view_count, pred_matrix, paint_hull, paint_background;

  explicit Program(const PaintShader& variant)
      : program(make_program("paint", full_screen_vertex_shader(), paint_fragment_shader(variant))),
        view_count(glGetUniformLocation(program.name(), "view_count")),
        pred_matrix(glGetUniformLocation(program.name(), "pred_matrix")),
        paint_hull(glGetUniformLocation(program.name(), "paint_hull")),
        paint_background(glGetUniformLocation(program.name(), "paint_background")) {
    glUseProgram(program.name());
    glUniform1i(glGetUniformLocation(program.name(), "surface"), 0);
    glUniform1i(glGetUniformLocation(program.name(), "images"), 1);
    glUniform1i(glGetUniformLocation(program.name(), "depths"), 2);
    glUniformBlockBinding(program.name(), glGetUniformBlockIndex(program.name(), "Views"), 0);
  }
};

PaintPass::PaintPass() : no_vertices_(make_vertex_array()), views_(make_buffer()) {}
PaintPass::~PaintPass() = default;

const PaintPass::Program& PaintPass::program(const PaintShader& variant) {
  const auto found = programs_.find(variant);
  if (found != programs_.end()) return found->second;
  return programs_.emplace(variant, Program(variant)).first->second;
}

void PaintPass::draw(const PaintJob& job) {
  FORESIGHT_CHECK(job.views.size() <= static_cast<size_t>(kMaxUsedViews));
  std::array<GpuView, kMaxUsedViews> views{};
  for (size_t i = 0; i < job.views.size(); ++i) views[i] = gpu_view(job.views[i], i);
  glBindBuffer(GL_UNIFORM_BUFFER, views_.name());
  glBufferData(GL_UNIFORM_BUFFER, sizeof(views), views.data(), GL_STREAM_DRAW);

  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D_ARRAY, job.images);
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_2D_ARRAY, job.depths);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, job.surface.value_or(0));

  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);  // a painted pixel lets no later pass through
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  PaintShader variant;
  if (!job.views.empty()) variant.lens = shader_lens(job.views[0].camera);
  variant.has_mesh = job.surface.has_value();
  variant.one_view = true;
  for (size_t i = 0; i < std::min(kOwnPasses, job.views.size()); ++i) {
    glBindBufferRange(GL_UNIFORM_BUFFER, 0, views_.name(),
                      static_cast<GLintptr>(i * sizeof(GpuView)), sizeof(GpuView));
    run(variant, job);
  }
  variant.one_view = false;
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, views_.name());
  run(variant, job);
  glDisable(GL_DEPTH_TEST);
}

void PaintPass::run(const PaintShader& variant, const PaintJob& job) {
  const Program& p = program(variant);
  glUseProgram(p.program.name());
  glUniform1i(p.view_count, static_cast<GLint>(job.views.size()));
  const auto matrix = matrix_of(job.camera);
  glUniform4fv(p.pred_matrix, 1, matrix.data());
  glUniform1i(p.paint_hull, job.paint_hull ? 1 : 0);
  glUniform1i(p.paint_background, job.paint_background ? 1 : 0);
  glBindVertexArray(no_vertices_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
}

void PictureTarget::bind(int width_px, int height_px) {
  if (width_px != width_px_ || height_px != height_px_) {
    colour_ = make_texture(GL_RGBA8, width_px, height_px, GL_LINEAR);
    framebuffer_ = make_framebuffer();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour_.name(), 0);
    depth_ = make_depth_buffer(width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.name());
    require_complete_framebuffer("picture");
    width_px_ = width_px;
    height_px_ = height_px;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, width_px, height_px);
}

void PictureTarget::read(Image* rgb, std::vector<uint8_t>* source) const {
  const size_t pixels = static_cast<size_t>(width_px_) * height_px_;
  *rgb = Image{width_px_, height_px_, 3, std::vector<uint8_t>(3 * pixels)};
  source->resize(pixels);
  if (pixels == 0) return;
  std::vector<uint8_t> rgba(4 * pixels);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_px_, height_px_, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  for (size_t i = 0; i < pixels; ++i) {
    std::copy_n(&rgba[4 * i], 3, &rgb->bytes[3 * i]);
    (*source)[i] = rgba[4 * i + 3];
  }
}

void upload_layer(unsigned texture_array, int layer, const Image& image,
                  std::vector<uint8_t>* scratch) {
  scratch->resize(static_cast<size_t>(image.width_px) * image.height_px * 4);
  const cv::Mat from(image.height_px, image.width_px, CV_8UC(image.channels),
                     const_cast<uint8_t*>(image.bytes.data()));
  cv::Mat to(image.height_px, image.width_px, CV_8UC4, scratch->data());
  cv::cvtColor(from, to, image.channels == 1 ? cv::COLOR_GRAY2RGBA : cv::COLOR_RGB2RGBA);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture_array);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, image.width_px, image.height_px, 1, GL_RGBA,
                  GL_UNSIGNED_BYTE, scratch->data());
}

}  // namespace foresight
