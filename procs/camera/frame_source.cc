#include "procs/camera/frame_source.h"

#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "common/errors.h"

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

std::vector<uint8_t> read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Seconds as text; nothing when it is no time (1970 to 5138).
std::optional<Time> parse_stamp(const std::string& text) {
  double stamp_s = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), stamp_s);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(stamp_s >= 0 && stamp_s < 1e11)) return std::nullopt;
  return Time{seconds(stamp_s).us};
}

class FolderSource : public FrameSource {
 public:
  explicit FolderSource(const std::string& folder) : folder_(folder) {
    const std::string list = folder + "/rgb.txt";
    std::ifstream file(list);
    if (!file) {
      throw ConfigError("source: " + list + ": cannot be read (a folder needs the TUM layout: " +
                        "rgb.txt with lines 'seconds file')");
    }
    std::string line;
    for (int number = 1; std::getline(file, line); ++number) {
      if (line.empty() || line[0] == '#') continue;
      std::istringstream words(line);
      std::string stamp, name;
      words >> stamp >> name;
      const std::optional<Time> time = parse_stamp(stamp);
      const bool increases = entries_.empty() || (time && *time > entries_.back().time);
      if (!time || !increases || name.empty()) {
        throw ConfigError("source: " + list + ":" + std::to_string(number) +
                          ": must be 'seconds file', with increasing seconds");
      }
      entries_.push_back({*time, name});
    }
    if (entries_.empty()) throw ConfigError("source: " + list + ": lists no frames");
  }
  std::optional<Frame> next() override {
    if (index_ >= entries_.size()) return std::nullopt;
    const Entry& entry = entries_[index_++];
    const std::string path = folder_ + "/" + entry.name;
    Frame frame{entry.time, read_bytes(path), {}};
    if (frame.jpeg.size() > 2 && frame.jpeg[0] == 0xFF && frame.jpeg[1] == 0xD8) return frame;
    const cv::Mat decoded =
        frame.jpeg.empty() ? cv::Mat() : cv::imdecode(frame.jpeg, cv::IMREAD_ANYCOLOR);
    if (decoded.empty()) {
      error_ = path + ": cannot be read as an image";
      return std::nullopt;
    }
    frame.jpeg.clear();
    frame.image = to_image(decoded);
    return frame;
  }
  void rewind() override { index_ = 0; }
  std::string error() const override { return error_; }

 private:
  struct Entry {
    Time time;
    std::string name;
  };
  std::string folder_, error_;
  std::vector<Entry> entries_;
  size_t index_ = 0;
};

class VideoSource : public FrameSource {
 public:
  explicit VideoSource(const std::string& path) : path_(path) { rewind(); }
  void rewind() override {
    capture_.open(path_, cv::CAP_FFMPEG);
    if (!capture_.isOpened()) {
      throw UnavailableError("source: " + path_ + ": is not a video that ffmpeg can read");
    }
    const double fps = capture_.get(cv::CAP_PROP_FPS);
    frame_s_ = fps > 0 ? 1.0 / fps : 1.0 / 30;
    count_ = 0;
  }
  std::optional<Frame> next() override {
    cv::Mat bgr;
    if (!capture_.read(bgr) || bgr.empty()) return std::nullopt;
    return Frame{{seconds(frame_s_ * static_cast<double>(count_++)).us}, {}, to_image(bgr)};
  }

 private:
  std::string path_;
  cv::VideoCapture capture_;
  double frame_s_ = 0;
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
    return Frame{{}, {}, to_image(bgr)};
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
