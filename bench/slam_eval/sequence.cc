#include "bench/slam_eval/sequence.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "common/errors.h"
#include "common/text_lines.h"
#include "procs/camera/camera_choice.h"

namespace foresight {
namespace {

constexpr Duration kMaxGap = milliseconds(100);

// "key: number" of the camera file; the fallback where it is missing.
double number_in(const std::string& path, const std::string& key, double fallback) {
  for (const TextLine& line : data_lines(path)) {
    if (!line.text.starts_with(key + ":")) continue;
    std::istringstream value(line.text.substr(key.size() + 1));
    value >> fallback;
  }
  return fallback;
}

// A camera of the depth images' own, without distortion and with the colour images' size.
std::optional<CameraModel> depth_camera_of(const std::string& camera_file,
                                           const CameraModel& camera) {
  CameraModel own = camera.undistorted();
  own.fx_px = number_in(camera_file, "depth_fx", 0);
  own.fy_px = number_in(camera_file, "depth_fy", own.fx_px);
  own.cx_px = number_in(camera_file, "depth_cx", camera.cx_px);
  own.cy_px = number_in(camera_file, "depth_cy", camera.cy_px);
  if (own.fx_px <= 0 || own.fy_px <= 0) return std::nullopt;
  return own;
}

// The camera of the first image that can be used.
void set_camera(const std::string& source, Sequence* sequence) {
  Picture first;
  for (size_t i = 0; i < sequence->images.size() && first.image.bytes.empty(); ++i) {
    first = sequence->recorded->read(i, 1);
  }
  if (first.image.bytes.empty()) {
    throw UnavailableError(source + ": no image can be used: " + sequence->images.front().path +
                           ": " + sequence->recorded->read(0, 1).error);
  }
  const ChosenCamera chosen =
      choose_camera(source, "", first.image.width_px, first.image.height_px);
  sequence->camera = chosen.camera;
  sequence->intrinsics_are_guessed = chosen.is_guessed;
  if (!chosen.note.empty()) sequence->notes.push_back(chosen.note);
}

void set_depth(const std::filesystem::path& root, Sequence* sequence) {
  const std::string list = (root / "depth.txt").string();
  if (!std::filesystem::exists(list) || data_lines(list).empty()) return;  // lists none
  sequence->depth_images = load_image_list(list);
  const std::string camera_file = (root / "camera.yaml").string();
  sequence->depth_scale = 1.0 / 5000;
  if (!std::filesystem::exists(camera_file)) return;
  sequence->depth_scale = number_in(camera_file, "depth_scale", 1.0 / 5000);
  sequence->depth_camera = depth_camera_of(camera_file, sequence->camera);
}

std::string seconds_text(Time from, Time to) {
  std::ostringstream text;
  text.precision(3);
  text << std::fixed << (from - Time{}).seconds() << " to " << (to - Time{}).seconds() << " s";
  return text.str();
}

void set_truth(const std::filesystem::path& root, Sequence* sequence) {
  const std::string file = (root / "groundtruth.txt").string();
  if (!std::filesystem::exists(file)) return;
  sequence->truth = load_pose_track(file);
  if (sequence->images_with_truth() > 0) return;
  sequence->notes.push_back(
      file + ": its times (" +
      seconds_text(sequence->truth.front().time, sequence->truth.back().time) +
      ") match no image (" +
      seconds_text(sequence->images.front().time, sequence->images.back().time) +
      "): nothing is compared with it");
}

}  // namespace

cv::Mat view_of(const Image& image) {
  return {image.height_px, image.width_px, CV_8UC(image.channels),
          const_cast<uint8_t*>(image.bytes.data())};  // cv::Mat has no const view
}

std::optional<Pose<World, Cam>> Sequence::truth_at(Time time) const {
  return pose_at(truth, time, kMaxGap);
}

int Sequence::images_with_truth() const {
  return static_cast<int>(
      std::count_if(images.begin(), images.end(),
                    [&](const SequenceImage& image) { return truth_at(image.time).has_value(); }));
}

Picture Sequence::gray(size_t index) const {
  Picture picture = recorded->read(index, 1);
  if (picture.error.empty() &&
      (picture.image.width_px != camera.width_px || picture.image.height_px != camera.height_px)) {
    picture.error = wrong_size(picture.image, camera.width_px, camera.height_px);
  }
  return picture;
}

cv::Mat Sequence::colour(size_t index) const {
  const Picture picture = recorded->read(index, 3);
  if (!picture.error.empty()) throw UnavailableError(images[index].path + ": " + picture.error);
  cv::Mat bgr;
  cv::cvtColor(view_of(picture.image), bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

Sequence load_sequence(const std::string& source) {
  Sequence sequence;
  const std::filesystem::path root = std::filesystem::weakly_canonical(source);
  const bool is_folder = std::filesystem::is_directory(root);
  sequence.name = (is_folder ? root.filename() : root.stem()).string();
  sequence.recorded = std::make_shared<RecordedImages>(root.string());
  sequence.images = sequence.recorded->list();
  sequence.shortfall = sequence.recorded->shortfall();
  if (!sequence.recorded->note().empty()) sequence.notes.push_back(sequence.recorded->note());
  set_camera(root.string(), &sequence);
  if (!is_folder) return sequence;
  set_depth(root, &sequence);
  set_truth(root, &sequence);
  return sequence;
}

}  // namespace foresight
