#include "procs/camera/frame_source.h"

#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "common/errors.h"
#include "procs/camera/image_list.h"
#include "procs/camera/recorded_images.h"
#include "procs/camera/video_file.h"

namespace foresight {
namespace {

Image to_image(const cv::Mat& bgr) {
  cv::Mat rgb;
  if (bgr.channels() == 1) {
    rgb = bgr.clone();
  } else {
    cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  }
  Image image{rgb.cols, rgb.rows, rgb.channels(), {}};
  image.bytes.assign(rgb.datastart, rgb.dataend);
  return image;
}

class FolderSource : public FrameSource {
 public:
  explicit FolderSource(const std::string& folder)
      : images_(load_image_list(folder + "/rgb.txt")), bits_(bits_of(images_)) {}
  std::optional<Frame> next() override {
    if (index_ >= images_.size()) return std::nullopt;
    const ListedImage& entry = images_[index_++];
    Frame frame;
    frame.time = entry.time;
    frame.name = entry.path;
    frame.jpeg = read_bytes(entry.path, &frame.error);
    if (!frame.error.empty() || is_jpeg(frame.jpeg)) return frame;
    Picture picture = decode_picture(frame.jpeg, 0, bits_);
    frame.jpeg.clear();
    frame.image = std::move(picture.image);
    frame.error = picture.error;
    frame.warning = picture.warning;
    return frame;
  }
  void rewind() override { index_ = 0; }
  std::string note() const override { return bits_ < 16 ? bits_note(bits_) : ""; }

 private:
  std::vector<ListedImage> images_;
  int bits_;
  size_t index_ = 0;
};

class VideoSource : public FrameSource {
 public:
  explicit VideoSource(const std::string& path) : path_(path), video_(path) {}
  void rewind() override {
    video_ = VideoFile(path_);
    count_ = 0;
  }
  std::optional<Frame> next() override {
    std::optional<VideoFrame> decoded = video_.next();
    if (!decoded) return std::nullopt;
    Frame frame;
    frame.time = decoded->time;
    frame.name = path_ + " frame " + std::to_string(count_++);
    Picture picture;
    picture.image = std::move(decoded->image);
    if (picture.image.bytes.empty()) picture.error = "its pixels are of a kind that is not read";
    check_size(&picture);
    frame.image = std::move(picture.image);
    frame.error = picture.error;
    return frame;
  }
  std::string shortfall() const override { return video_.shortfall(); }
  std::string note() const override { return video_.note(); }

 private:
  std::string path_;
  VideoFile video_;
  int64_t count_ = 0;
};

// Any V4L2 camera. Its buffer is kept short so that frames are fresh.
class DeviceSource : public FrameSource {
 public:
  explicit DeviceSource(const std::string& device) : device_(device) {
    if (!open()) {
      throw UnavailableError("source: " + device +
                             ": cannot be opened (is it plugged in, and are you in group video?)");
    }
  }
  bool is_live() const override { return true; }
  std::optional<Frame> next() override {
    if (!capture_.isOpened() && !open()) return std::nullopt;
    cv::Mat bgr;
    if (!capture_.read(bgr) || bgr.empty()) {
      capture_.release();
      return std::nullopt;
    }
    Frame frame;
    frame.image = to_image(bgr);
    frame.name = device_;
    return frame;
  }
  std::string error() const override { return device_ + ": no frames; trying again"; }

 private:
  bool open() {
    capture_.open(device_, cv::CAP_V4L2);
    if (!capture_.isOpened()) return false;
    capture_.set(cv::CAP_PROP_FRAME_WIDTH, 640);
    capture_.set(cv::CAP_PROP_FRAME_HEIGHT, 480);
    capture_.set(cv::CAP_PROP_BUFFERSIZE, 1);
    return true;
  }
  std::string device_;
  cv::VideoCapture capture_;
};

}  // namespace

Picture picture_of(const Frame& frame, int channels) {
  if (!frame.jpeg.empty()) return decode_picture(frame.jpeg, channels);
  Picture picture;
  picture.image = frame.image;
  picture.error = frame.error;
  picture.warning = frame.warning;
  return picture;
}

std::unique_ptr<FrameSource> open_frame_source(const std::string& source) {
  namespace fs = std::filesystem;
  // What goes wrong is said by us, in one line.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (source.empty()) {
    throw ConfigError("source: missing; give --set source=FOLDER|VIDEO|/dev/videoN");
  }
  if (source.starts_with("/dev/")) return std::make_unique<DeviceSource>(source);
  if (fs::is_directory(source)) return std::make_unique<FolderSource>(source);
  if (!fs::exists(source)) throw ConfigError("source: " + source + ": does not exist");
  return std::make_unique<VideoSource>(source);
}

}  // namespace foresight
