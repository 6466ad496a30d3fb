#include "procs/camera/recorded_images.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr size_t kBitProbes = 8;
constexpr size_t kMaxRecent = 32;  // frames of a video kept for going back

Image gray_of(const Image& rgb) {
  const cv::Mat colour(rgb.height_px, rgb.width_px, CV_8UC3,
                       const_cast<uint8_t*>(rgb.bytes.data()));  // cv::Mat has no const view
  Image gray{rgb.width_px, rgb.height_px, 1, {}};
  gray.bytes.resize(rgb.bytes.size() / 3);
  cv::Mat pixels(rgb.height_px, rgb.width_px, CV_8UC1, gray.bytes.data());
  cv::cvtColor(colour, pixels, cv::COLOR_RGB2GRAY);
  return gray;
}

}  // namespace

int bits_of(const std::vector<ListedImage>& images) {
  int bits = 0;
  const size_t probes = std::min(kBitProbes, images.size());
  for (size_t i = 0; i < probes; ++i) {
    std::string error;
    const size_t index = probes < 2 ? 0 : i * (images.size() - 1) / (probes - 1);
    bits = std::max(bits, used_bits(read_bytes(images[index].path, &error)));
    // Nearly always: the first image is no 16-bit file, and neither are the others.
    if (i == 0 && error.empty() && bits == 0) break;
  }
  return bits == 0 ? 16 : bits;
}

RecordedImages::RecordedImages(const std::string& source) : source_(source) {
  namespace fs = std::filesystem;
  if (!fs::exists(source)) throw ConfigError("source: " + source + ": does not exist");
  if (!fs::is_directory(source)) {
    scan_video();
    return;
  }
  list_ = load_image_list(source + "/rgb.txt");
  bits_ = bits_of(list_);
  if (bits_ < 16) note_ = bits_note(bits_);
}

void RecordedImages::scan_video() {
  video_.emplace(source_);
  while (const auto time = video_->skip()) {
    list_.push_back({*time, source_ + " frame " + std::to_string(list_.size())});
  }
  shortfall_ = video_->shortfall();
  note_ = video_->note();
  if (list_.empty()) throw UnavailableError("source: " + source_ + ": no frame can be decoded");
  video_.emplace(source_);
}

Picture RecordedImages::read(size_t index, int channels) {
  if (!video_) return read_picture(list_.at(index).path, channels, bits_);
  Picture picture;
  picture.image = video_image(index);
  if (picture.image.bytes.empty()) picture.error = "its pixels are of a kind that is not read";
  check_size(&picture);
  if (picture.error.empty() && channels == 1) picture.image = gray_of(picture.image);
  return picture;
}

Image RecordedImages::video_image(size_t index) {
  if (index + recent_.size() < next_) {
    video_.emplace(source_);
    recent_.clear();
    next_ = 0;
  }
  for (; next_ <= index; ++next_) {
    // What lies far ahead is decoded for what follows it only.
    const bool keep = next_ + kMaxRecent > index;
    if (!keep) {
      video_->skip();
      continue;
    }
    auto frame = video_->next();
    if (!frame) throw UnavailableError(list_.at(index).path + ": was there before and is not now");
    recent_.push_back(std::move(frame->image));
    if (recent_.size() > kMaxRecent) recent_.pop_front();
  }
  return recent_.at(recent_.size() - (next_ - index));
}

}  // namespace foresight
