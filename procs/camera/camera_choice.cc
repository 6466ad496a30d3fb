#include "procs/camera/camera_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/errors.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

ChosenCamera guess(int width_px, int height_px) {
  ChosenCamera guessed;
  guessed.is_guessed = true;
  CameraModel& camera = guessed.camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 0.9 * std::max(width_px, height_px);
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  camera.prepare();
  char text[120];
  std::snprintf(text, sizeof text,
                "intrinsics are guessed (focal length %.0f px): give a camera file", camera.fx_px);
  guessed.note = text;
  return guessed;
}

// The height that the camera file's picture has at the images' width, within half a pixel.
bool has_aspect_of(const CameraModel& camera, int width_px, int height_px) {
  const double scaled_px = static_cast<double>(camera.height_px) * width_px / camera.width_px;
  return std::abs(scaled_px - height_px) <= 1;
}

ChosenCamera fitted(const std::string& file, int width_px, int height_px) {
  ChosenCamera chosen;
  chosen.camera = load_camera_file(file);
  const CameraModel& camera = chosen.camera;
  if (camera.width_px == width_px && camera.height_px == height_px) return chosen;
  const std::string sizes = "is for " + size_text(camera.width_px, camera.height_px) +
                            " px, the images have " + size_text(width_px, height_px);
  if (camera.width_px == height_px && camera.height_px == width_px) {
    throw ConfigError(file + ": width, height: " + sizes +
                      ": the sides are swapped (images are shown upright, as their rotation asks)");
  }
  if (!has_aspect_of(camera, width_px, height_px)) {
    throw ConfigError(file + ": width, height: " + sizes + ", which is another aspect");
  }
  chosen.camera = camera.scaled(static_cast<double>(width_px) / camera.width_px);
  chosen.camera.height_px = height_px;
  chosen.note = file + " " + sizes + ": scaled";
  return chosen;
}

}  // namespace

ChosenCamera choose_camera(const std::string& source, const std::string& camera_file, int width_px,
                           int height_px) {
  if (!camera_file.empty()) return fitted(camera_file, width_px, height_px);
  std::error_code error;
  if (fs::is_directory(source, error)) {
    const std::string inside = source + "/camera.yaml";
    return fs::exists(inside, error) ? fitted(inside, width_px, height_px)
                                     : guess(width_px, height_px);
  }
  const std::string beside = (fs::path(source).parent_path() / "camera.yaml").string();
  if (!fs::is_regular_file(source, error) || !fs::exists(beside, error)) {
    return guess(width_px, height_px);
  }
  ChosenCamera chosen = fitted(beside, width_px, height_px);
  if (chosen.note.empty()) chosen.note = "intrinsics from " + beside + ", beside the video";
  return chosen;
}

std::string wrong_size(const Image& image, int width_px, int height_px) {
  return "is " + size_text(image.width_px, image.height_px) + " px, not " +
         size_text(width_px, height_px) + " as the images before it";
}

}  // namespace foresight
