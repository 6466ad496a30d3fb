#include "sim/robot/camera_rig.h"

#include <utility>

#include "common/errors.h"
#include "common/image_codec.h"
#include "sim/lab.h"
#include "sim/scene_loader.h"

namespace foresight::sim {

namespace {

LabOptions lab_options(const SimParams& params) {
  LabOptions options;
  options.seed = static_cast<uint64_t>(params.seed);
  options.letters = params.letters;
  const size_t panels = options.panel_places.size();
  if (params.panel_places.size() != panels) {
    throw ConfigError("panel_places: needs two numbers, as in '0 3'");
  }
  for (size_t i = 0; i < panels; ++i) {
    options.panel_places[i] = params.panel_places[i];
    const std::string row = i < params.lit_leds.size() ? params.lit_leds[i] : "";
    if (row.size() != 9 || row.find_first_not_of("01") != std::string::npos) {
      throw ConfigError("lit_leds: needs nine 0 or 1 per panel, as in '111101111 111111111'");
    }
    for (size_t led = 0; led < 9; ++led) options.leds_lit[i][led] = row[led] == '1';
  }
  return options;
}

}  // namespace

Scene open_scene(const SimParams& params) {
  if (params.scene == "lab") return make_lab(lab_options(params));
  return load_scene(params.scene);
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
