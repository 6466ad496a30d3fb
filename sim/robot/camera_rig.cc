#include "sim/robot/camera_rig.h"

#include <utility>

#include "common/image_codec.h"
#include "sim/lab.h"
#include "sim/scene_loader.h"

namespace foresight::sim {

Scene open_scene(const std::string& name, uint64_t seed) {
  if (name == "lab") return make_lab(seed);
  return load_scene(name);
}

CameraRig::CameraRig(Scene scene, const CameraRigParams& params)
    : scene_(std::move(scene)),
      jpeg_quality_(params.jpeg_quality),
      camera_(std::make_unique<RayCamera>(scene_, params.camera)) {}

image_t CameraRig::take(std::span<const Pose<World, Cam>> world_from_cam_while_open,
                        int32_t frame_number) {
  const Image image =
      camera_->render(world_from_cam_while_open, static_cast<uint64_t>(frame_number));
  image_t message{};
  message.frame_number = frame_number;
  encode_jpeg(image, jpeg_quality_, &message);
  return message;
}

}  // namespace foresight::sim
