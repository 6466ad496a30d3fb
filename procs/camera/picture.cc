#include "procs/camera/picture.h"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "procs/camera/jpeg_picture.h"

namespace foresight {
namespace {

constexpr int kMinSide_px = 16, kMaxSide_px = 8192;  // as a camera file's
// So far into a file a JPEG may begin behind foreign bytes.
constexpr size_t kMaxForeignBytes = 4096;

cv::Mat view_of(const Image& image) {
  return {image.height_px, image.width_px, CV_8UC(image.channels),
          const_cast<uint8_t*>(image.bytes.data())};  // cv::Mat has no const view
}

Image image_of(const cv::Mat& mat) {
  const cv::Mat whole = mat.isContinuous() ? mat : mat.clone();
  Image image{whole.cols, whole.rows, whole.channels(), {}};
  image.bytes.assign(whole.data, whole.data + whole.total() * whole.elemSize());
  return image;
}

cv::Mat decode(std::span<const uint8_t> bytes, int flags) {
  const cv::Mat data(1, static_cast<int>(bytes.size()), CV_8U, const_cast<uint8_t*>(bytes.data()));
  try {
    return cv::imdecode(data, flags);
  } catch (const cv::Exception&) {  // such as a size beyond OpenCV's limit
    return {};
  }
}

// The highest 8 of the bits that are used.
cv::Mat eight_bits(const cv::Mat& wide, int bits) {
  cv::Mat narrow(wide.size(), CV_8UC(wide.channels()));
  for (int y = 0; y < wide.rows; ++y) {
    const auto* from = wide.ptr<uint16_t>(y);
    auto* to = narrow.ptr<uint8_t>(y);
    for (int i = 0; i < wide.cols * wide.channels(); ++i) {
      to[i] = static_cast<uint8_t>(std::min(255, from[i] >> (bits - 8)));
    }
  }
  return narrow;
}

// Anything but a JPEG.
Picture decode_other(std::span<const uint8_t> bytes, int channels, int bits) {
  Picture picture;
  cv::Mat pixels = decode(bytes, cv::IMREAD_ANYDEPTH | (channels == 1   ? cv::IMREAD_GRAYSCALE
                                                        : channels == 3 ? cv::IMREAD_COLOR
                                                                        : cv::IMREAD_ANYCOLOR));
  if (pixels.empty()) {
    picture.error = "cannot be read as an image";
    return picture;
  }
  if (pixels.depth() == CV_16U) pixels = eight_bits(pixels, bits);
  if (pixels.depth() != CV_8U) {
    picture.error = "its pixels are neither 8 nor 16 bits wide: convert it to 8 bits";
    return picture;
  }
  if (pixels.channels() == 3) cv::cvtColor(pixels, pixels, cv::COLOR_BGR2RGB);
  picture.image = image_of(pixels);
  return picture;
}

// A JPEG behind bytes that are not its own.
Picture decode_behind(std::span<const uint8_t> bytes, int channels) {
  static constexpr uint8_t kStart[] = {0xFF, 0xD8, 0xFF};
  const auto searched = bytes.first(std::min(bytes.size(), kMaxForeignBytes));
  const auto at =
      std::search(searched.begin(), searched.end(), std::begin(kStart), std::end(kStart));
  if (at == searched.end()) return {};
  const auto count = static_cast<size_t>(at - searched.begin());
  Picture picture = decode_jpeg_picture(bytes.subspan(count), channels);
  picture.is_plain_jpeg = false;
  picture.warning = std::to_string(count) + " bytes before the JPEG begins";
  return picture;
}

}  // namespace

void check_size(Picture* picture) {
  const Image& image = picture->image;
  if (!picture->error.empty()) return;
  if (std::min(image.width_px, image.height_px) >= kMinSide_px &&
      std::max(image.width_px, image.height_px) <= kMaxSide_px) {
    return;
  }
  picture->error = "is " + std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
                   " px: sides of " + std::to_string(kMinSide_px) + " to " +
                   std::to_string(kMaxSide_px) + " px are read";
  picture->image = {};
}

bool is_jpeg(std::span<const uint8_t> bytes) {
  return bytes.size() > 2 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

Picture decode_picture(std::span<const uint8_t> bytes, int channels, int bits) {
  const int jpeg_channels = channels == 1 ? 1 : 3;
  Picture picture = is_jpeg(bytes) ? decode_jpeg_picture(bytes, jpeg_channels)
                                   : decode_other(bytes, channels, bits);
  if (!picture.error.empty() && !is_jpeg(bytes)) {
    Picture behind = decode_behind(bytes, jpeg_channels);
    if (!behind.image.bytes.empty()) picture = std::move(behind);
  }
  check_size(&picture);
  return picture;
}

std::vector<uint8_t> read_bytes(const std::string& path, std::string* error) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) {
    *error = "does not exist";
    return {};
  }
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path, code)) {
    *error = "cannot be read";
    return {};
  }
  std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(file),
                             std::istreambuf_iterator<char>()};
  if (bytes.empty()) *error = "is empty";
  return bytes;
}

Picture read_picture(const std::string& path, int channels, int bits) {
  Picture picture;
  const std::vector<uint8_t> bytes = read_bytes(path, &picture.error);
  return picture.error.empty() ? decode_picture(bytes, channels, bits) : picture;
}

int used_bits(std::span<const uint8_t> bytes) {
  if (is_jpeg(bytes)) return 0;
  const cv::Mat pixels = decode(bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
  if (pixels.empty() || pixels.depth() != CV_16U) return 0;
  double brightest = 0;
  cv::minMaxLoc(pixels.reshape(1), nullptr, &brightest);
  return std::max(8, static_cast<int>(std::bit_width(static_cast<unsigned>(brightest))));
}

std::string bits_note(int bits) {
  return "16-bit images use " + std::to_string(bits) + " of 16 bits: scaled so that these fill 8";
}

Image oriented(const Image& image, int exif_orientation) {
  const cv::Mat stored = view_of(image);
  cv::Mat turned;
  switch (exif_orientation) {
    case 2:
      cv::flip(stored, turned, 1);
      break;
    case 3:
      cv::rotate(stored, turned, cv::ROTATE_180);
      break;
    case 4:
      cv::flip(stored, turned, 0);
      break;
    case 5:
      cv::transpose(stored, turned);
      break;
    case 6:
      cv::rotate(stored, turned, cv::ROTATE_90_CLOCKWISE);
      break;
    case 7:
      cv::transpose(stored, turned);
      cv::rotate(turned, turned, cv::ROTATE_180);
      break;
    case 8:
      cv::rotate(stored, turned, cv::ROTATE_90_COUNTERCLOCKWISE);
      break;
    default:
      return image;
  }
  return image_of(turned);
}

}  // namespace foresight
