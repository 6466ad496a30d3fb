#include "sim/ray_camera.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/check.h"
#include "sim/random.h"
#include "sim/ray_tracer.h"
#include "sim/shading.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3f;
using WorldFromCam = Pose<World, Cam>;

constexpr float kNear_m = 0.01f;
constexpr double kGamma = 2.2;
constexpr int kNoiseTable = 1 << 16;
// Four places in a pixel (a rotated grid), for antialiasing.
constexpr std::array<std::array<float, 2>, 4> kSubPixels = {
    {{-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}}};

// Up to 16 viewing rays with unit z in the camera.
struct Packet {
  int count = 0;
  std::array<float, kPacket> x{}, y{};
  std::array<int, kPacket> pixel{};

  void add(float ray_x, float ray_y, int pixel_index) {
    x[count] = ray_x, y[count] = ray_y, pixel[count] = pixel_index;
    ++count;
  }
};

// Packets of 4×4 pixels: rays that meet the same triangles.
std::vector<Packet> tile_packets(const CameraModel& model) {
  std::vector<Packet> packets;
  for (int top = 0; top < model.height_px; top += 4) {
    for (int left = 0; left < model.width_px; left += 4) {
      Packet packet;
      for (int y = top; y < std::min(top + 4, model.height_px); ++y) {
        for (int x = left; x < std::min(left + 4, model.width_px); ++x) {
          const Eigen::Vector2d ray = model.unproject(Eigen::Vector2d(x, y));
          packet.add(static_cast<float>(ray.x()), static_cast<float>(ray.y()),
                     y * model.width_px + x);
        }
      }
      packets.push_back(packet);
    }
  }
  return packets;
}

// Sends packets of viewing rays from one pose.
class Casting {
 public:
  Casting(const RayTracer& tracer, const WorldFromCam& world_from_cam)
      : tracer_(tracer), rotation_(world_from_cam.rotation().toRotationMatrix().cast<float>()) {
    seen_.origin = world_from_cam.translation().cast<float>();
    for (int i = 0; i < kPacket; ++i) {
      RTCRay16& ray = rays_.ray;
      ray.org_x[i] = seen_.origin.x(), ray.org_y[i] = seen_.origin.y();
      ray.org_z[i] = seen_.origin.z();
      ray.tnear[i] = kNear_m, ray.time[i] = 0;
      ray.mask[i] = ~0u, ray.id[i] = 0, ray.flags[i] = 0;
      rays_.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  /// Valid until the next call.
  const RayPacket& cast(const Packet& packet) {
    const Eigen::Matrix3f& r = rotation_;
    for (int i = 0; i < kPacket; ++i) {
      const float x = packet.x[i], y = packet.y[i];
      seen_.x[i] = rays_.ray.dir_x[i] = r(0, 0) * x + r(0, 1) * y + r(0, 2);
      seen_.y[i] = rays_.ray.dir_y[i] = r(1, 0) * x + r(1, 1) * y + r(1, 2);
      seen_.z[i] = rays_.ray.dir_z[i] = r(2, 0) * x + r(2, 1) * y + r(2, 2);
      rays_.ray.tfar[i] = 1e9f;
      rays_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      valid_[i] = i < packet.count ? -1 : 0;
    }
    tracer_.find_nearest(valid_.data(), &rays_);
    for (int i = 0; i < kPacket; ++i) {
      const bool met = rays_.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      seen_.triangle[i] = met ? static_cast<int>(rays_.hit.primID[i]) : -1;
    }
    return seen_;
  }

 private:
  const RayTracer& tracer_;
  Eigen::Matrix3f rotation_;
  RayPacket seen_;
  alignas(64) RTCRayHit16 rays_{};
  alignas(64) std::array<int, kPacket> valid_{};
};

}  // namespace

class RayCamera::Impl {
 public:
  Impl(const Scene& scene, const RayCameraParams& params)
      : params_(params),
        tracer_(scene),
        shader_(scene),
        tiles_(tile_packets(params.model)),
        pixel_count_(static_cast<size_t>(params.model.width_px) * params.model.height_px),
        levels_(3 * pixel_count_),
        surfaces_(pixel_count_) {
    set_exposure(params.exposure);
    prepare_gains();
    Random random(1, "sensor noise");
    noise_.resize(kNoiseTable + 3 * static_cast<size_t>(params.model.width_px));
    for (float& value : noise_) {
      value = static_cast<float>(random.normal() * params.noise_levels);
    }
  }

  Image render(std::span<const WorldFromCam> poses, uint64_t frame_seed) {
    FORESIGHT_CHECK(!poses.empty());
    const size_t count = poses.size();
    if (count == 1) {
      trace_centres(poses[0], 0, 0);
      if (params_.antialiasing != Antialiasing::kNone) refine(poses[0]);
    } else {
      average(poses);
    }
    return develop(frame_seed);
  }

  DepthImage render_depth(const WorldFromCam& world_from_cam) const {
    DepthImage depth{params_.model.width_px, params_.model.height_px, {}};
    depth.depth_m.assign(pixel_count_, 0);
    Casting casting(tracer_, world_from_cam);
    for (const Packet& packet : tiles_) {
      const RayPacket& seen = casting.cast(packet);
      for (int i = 0; i < packet.count; ++i) {
        if (seen.triangle[i] >= 0) depth.depth_m[packet.pixel[i]] = shader_.depth(seen, i);
      }
    }
    return depth;
  }

  const CameraModel& model() const { return params_.model; }

  void set_exposure(double exposure) {
    FORESIGHT_CHECK(exposure > 0 && std::isfinite(exposure));
    exposure_gain_ = static_cast<float>(std::pow(exposure, 1 / kGamma));
  }
  void set_glow(int surface, float glow) { shader_.set_glow(surface, glow); }

 private:
  // Gain of the picture level per pixel: vignetting.
  void prepare_gains() {
    const CameraModel& m = params_.model;
    const double corner2 = m.width_px * m.width_px / 4.0 + m.height_px * m.height_px / 4.0;
    gains_.reserve(3 * pixel_count_);
    for (int y = 0; y < m.height_px; ++y) {
      for (int x = 0; x < m.width_px; ++x) {
        const double r2 = (Eigen::Vector2d(x, y) - Eigen::Vector2d(m.cx_px, m.cy_px)).squaredNorm();
        const double light = 1 - params_.vignetting * std::min(r2 / corner2, 1.0);
        gains_.insert(gains_.end(), 3,
                      static_cast<float>(std::pow(std::max(light, 0.0), 1 / kGamma)));
      }
    }
  }

  float pixel_width() const { return static_cast<float>(1 / params_.model.fx_px); }

  void trace_centres(const WorldFromCam& pose, float shift_x_px, float shift_y_px) {
    const float shift_x = shift_x_px / static_cast<float>(params_.model.fx_px);
    const float shift_y = shift_y_px / static_cast<float>(params_.model.fy_px);
    Casting casting(tracer_, pose);
    for (Packet packet : tiles_) {
      for (float& x : packet.x) x += shift_x;
      for (float& y : packet.y) y += shift_y;
      const RayPacket& seen = casting.cast(packet);
      shader_.shade(seen, pixel_width(), shades_);
      for (int i = 0; i < packet.count; ++i) {
        const int triangle = seen.triangle[i], pixel = packet.pixel[i];
        surfaces_[pixel] = triangle < 0 ? -1 : shader_.surface(triangle);
        store(pixel, shades_[i]);
      }
    }
  }

  // Whether the pixel sees another surface than one of its four neighbours.
  bool at_edge(int x, int y) const {
    const int width = params_.model.width_px;
    const int* here = &surfaces_[static_cast<size_t>(y) * width + x];
    return (x > 0 && here[-1] != *here) || (x + 1 < width && here[1] != *here) ||
           (y > 0 && here[-width] != *here) ||
           (y + 1 < params_.model.height_px && here[width] != *here);
  }

  // Replaces the colours of pixels at edges (or of all) by the mean of four rays.
  void refine(const WorldFromCam& pose) {
    Casting casting(tracer_, pose);
    Packet packet;
    for (const Packet& tile : tiles_) {
      for (int i = 0; i < tile.count; ++i) {
        const int x = tile.pixel[i] % params_.model.width_px;
        const int y = tile.pixel[i] / params_.model.width_px;
        if (params_.antialiasing == Antialiasing::kEdges && !at_edge(x, y)) continue;
        for (const auto& [dx, dy] : kSubPixels) {
          packet.add(tile.x[i] + dx * pixel_width(),
                     tile.y[i] + dy / static_cast<float>(params_.model.fy_px), tile.pixel[i]);
        }
        if (packet.count == kPacket) flush(casting, packet);
      }
    }
    flush(casting, packet);
  }

  void flush(Casting& casting, Packet& packet) {
    if (packet.count == 0) return;
    shader_.shade(casting.cast(packet), pixel_width(), shades_);
    for (int i = 0; i < packet.count; i += 4) {
      Colour sum;
      for (int j = i; j < i + 4; ++j) {
        const Colour& one = shades_[j];
        sum = {sum.red + one.red, sum.green + one.green, sum.blue + one.blue};
      }
      store(packet.pixel[i], {sum.red / 4, sum.green / 4, sum.blue / 4});
    }
    packet.count = 0;
  }

  // Light adds up, picture levels do not: gamma is taken as 2 here (error < 1 level).
  void average(std::span<const WorldFromCam> poses) {
    std::vector<float> sums(levels_.size());
    for (size_t k = 0; k < poses.size(); ++k) {
      const auto& shift = kSubPixels[k % kSubPixels.size()];
      trace_centres(poses[k], shift[0], shift[1]);
      for (size_t i = 0; i < sums.size(); ++i) sums[i] += levels_[i] * levels_[i];
    }
    const float share = 1.0f / static_cast<float>(poses.size());
    for (size_t i = 0; i < sums.size(); ++i) levels_[i] = std::sqrt(share * sums[i]);
  }

  void store(int pixel, const Colour& colour) {
    float* level = &levels_[3 * static_cast<size_t>(pixel)];
    level[0] = colour.red, level[1] = colour.green, level[2] = colour.blue;
  }

  // Gain, noise, rounding. Each row takes its noise from a random place of the table.
  Image develop(uint64_t frame_seed) const {
    Image image{params_.model.width_px, params_.model.height_px, 3, {}};
    image.bytes.resize(3 * pixel_count_);
    Random random(frame_seed, "frame");
    const size_t row_bytes = 3 * static_cast<size_t>(image.width_px);
    for (size_t row = 0; row < image.bytes.size(); row += row_bytes) {
      const float* noise = &noise_[random.below(kNoiseTable)];
      const float* level = &levels_[row];
      for (size_t i = 0; i < row_bytes; ++i) {
        const float exposed = exposure_gain_ * level[i] * gains_[row + i] + noise[i];
        image.bytes[row + i] =
            static_cast<uint8_t>(std::min(std::max(exposed, 0.0f), 255.0f) + 0.5f);
      }
    }
    return image;
  }

  RayCameraParams params_;
  RayTracer tracer_;
  Shader shader_;
  std::vector<Packet> tiles_;
  size_t pixel_count_;
  float exposure_gain_ = 1;
  std::vector<float> gains_;   // per pixel and channel
  std::vector<float> noise_;   // a table
  std::vector<float> levels_;  // per pixel and channel
  std::vector<int> surfaces_;
  std::array<Colour, kPacket> shades_;
};

RayCamera::RayCamera(const Scene& scene, const RayCameraParams& params)
    : impl_(std::make_unique<Impl>(scene, params)) {}
RayCamera::~RayCamera() = default;
RayCamera::RayCamera(RayCamera&&) noexcept = default;

Image RayCamera::render(const WorldFromCam& world_from_cam, uint64_t frame_seed) {
  return impl_->render({&world_from_cam, 1}, frame_seed);
}
Image RayCamera::render(std::span<const WorldFromCam> world_from_cam_while_open,
                        uint64_t frame_seed) {
  return impl_->render(world_from_cam_while_open, frame_seed);
}
DepthImage RayCamera::render_depth(const WorldFromCam& world_from_cam) const {
  return impl_->render_depth(world_from_cam);
}
void RayCamera::set_exposure(double exposure) { impl_->set_exposure(exposure); }
void RayCamera::set_glow(int surface, float glow) { impl_->set_glow(surface, glow); }
void RayCamera::light_led(const LedPanel& panel, int led, bool on) {
  impl_->set_glow(panel.surfaces.at(static_cast<size_t>(led)), on ? LedPanel::kLitGlow : 0);
}
const CameraModel& RayCamera::model() const { return impl_->model(); }

}  // namespace foresight::sim
