// Image files of every kind: what they show, or why they are refused.
#include "procs/camera/picture.h"

#include <gtest/gtest.h>
#include <jpeglib.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/camera/sequences.h"

namespace foresight {
namespace {

using Bytes = std::vector<uint8_t>;

// Dark with a bright upper left corner, so that every turn shows. 96 × 64 px.
cv::Mat corner_picture(int type = CV_8UC3, double bright = 250) {
  cv::Mat picture(64, 96, type, cv::Scalar::all(bright / 10));
  picture(cv::Rect(0, 0, 32, 16)).setTo(cv::Scalar::all(bright));
  return picture;
}

Bytes encoded(const cv::Mat& picture, const char* extension) {
  Bytes bytes;
  cv::imencode(extension, picture, bytes);
  return bytes;
}

int value_at(const Image& image, int x, int y) {
  return image.bytes[static_cast<size_t>((y * image.width_px + x) * image.channels)];
}

Bytes inserted(Bytes bytes, size_t at, const Bytes& more) {
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), more.begin(), more.end());
  return bytes;
}

// A big-endian EXIF block with nothing but the orientation, behind the start of the image.
Bytes with_orientation(const Bytes& jpeg, uint8_t orientation) {
  const Bytes block = {0xFF, 0xE1, 0, 34, 'E', 'x',         'i', 'f', 0, 0,  'M', 'M',
                       0,    42,   0, 0,  0,   8,           0,   1,   1, 18, 0,   3,
                       0,    0,    0, 1,  0,   orientation, 0,   0,   0, 0,  0,   0};
  return inserted(jpeg, 2, block);
}

Bytes cmyk_jpeg(bool adobe) {
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &data, &size);
  info.image_width = 16;
  info.image_height = 16;
  info.input_components = 4;
  info.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&info);
  info.write_Adobe_marker = adobe ? TRUE : FALSE;
  jpeg_start_compress(&info, TRUE);
  // Full magenta and yellow: red. Adobe writes ink as 255 - ink.
  Bytes row;
  for (int x = 0; x < 16; ++x) {
    for (const int ink : {0, 255, 255, 0})
      row.push_back(static_cast<uint8_t>(adobe ? 255 - ink : ink));
  }
  for (int y = 0; y < 16; ++y) {
    JSAMPROW rows[1] = {row.data()};
    jpeg_write_scanlines(&info, rows, 1);
  }
  jpeg_finish_compress(&info);
  Bytes bytes(data, data + size);
  jpeg_destroy_compress(&info);
  free(data);
  return bytes;
}

TEST(Picture, APlainJpegIsHandedOn) {
  const Picture picture = decode_picture(encoded(corner_picture(), ".jpg"), 3);
  EXPECT_EQ(picture.error + picture.warning, "");
  EXPECT_TRUE(picture.is_plain_jpeg);
  EXPECT_GT(value_at(picture.image, 4, 4), 200);
}

TEST(Picture, OddJpegsAreReadAndWarnedAbout) {
  const Bytes whole = encoded(corner_picture(), ".jpg");
  Bytes no_end(whole.begin(), whole.end() - 2);
  const Bytes before_marker = inserted(whole, whole.size() - 2, Bytes(20, 0x12));
  const Bytes between_segments = inserted(whole, 20, {0x00, 0x00, 0x00});
  const Bytes before_start = inserted(whole, 0, {'x', 'y', 'z'});
  for (const Bytes& odd : {no_end, before_marker, between_segments, before_start}) {
    for (const int channels : {1, 3}) {
      const Picture picture = decode_picture(odd, channels);
      EXPECT_EQ(picture.error, "");
      EXPECT_NE(picture.warning, "");
      EXPECT_FALSE(picture.is_plain_jpeg) << "others must not have to be as tolerant";
      ASSERT_TRUE(picture.image.is_valid());
      EXPECT_GT(value_at(picture.image, 4, 4), 200);
      EXPECT_LT(value_at(picture.image, 90, 60), 60);
    }
  }
}

TEST(Picture, JpegsThatLostAPartAreRefused) {
  cv::Mat noise(64, 96, CV_8UC3);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  const Bytes whole = encoded(noise, ".jpg");
  for (size_t size = 3; size + 100 < whole.size(); size += 97) {
    const Picture picture = decode_picture(std::span(whole).first(size), 3);
    EXPECT_NE(picture.error, "") << size << " of " << whole.size();
    EXPECT_TRUE(picture.image.bytes.empty());
  }
  Bytes damaged = whole;
  damaged[damaged.size() / 2] = 0xFF;  // an end in the middle
  damaged[damaged.size() / 2 + 1] = 0xD9;
  EXPECT_NE(decode_picture(damaged, 3).error, "");
}

TEST(Picture, CmykIsConvertedAndNamed) {
  for (const bool adobe : {true, false}) {
    const Picture picture = decode_picture(cmyk_jpeg(adobe), 3);
    EXPECT_EQ(picture.error, "");
    EXPECT_NE(picture.warning.find("CMYK"), std::string::npos);
    EXPECT_FALSE(picture.is_plain_jpeg);
    ASSERT_TRUE(picture.image.is_valid());
    EXPECT_GT(picture.image.bytes[0], 240) << "red";
    EXPECT_LT(picture.image.bytes[1], 15);
    EXPECT_EQ(decode_picture(cmyk_jpeg(adobe), 1).image.channels, 1);
  }
}

TEST(Picture, IsUprightWhateverExifSays) {
  // Where the stored picture's upper left corner is shown.
  const std::vector<std::pair<int, int>> corners = {{0, 0}, {1, 0}, {1, 1}, {0, 1},
                                                    {0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (uint8_t orientation = 1; orientation <= 8; ++orientation) {
    const Bytes jpeg = with_orientation(encoded(corner_picture(), ".jpg"), orientation);
    const Picture picture = decode_picture(jpeg, 3);
    ASSERT_TRUE(picture.image.is_valid()) << picture.error;
    EXPECT_EQ(picture.image.width_px, orientation < 5 ? 96 : 64) << +orientation;
    EXPECT_EQ(picture.is_plain_jpeg, orientation == 1);
    const auto [right, lower] = corners[orientation - 1u];
    EXPECT_GT(value_at(picture.image, right * (picture.image.width_px - 1),
                       lower * (picture.image.height_px - 1)),
              200)
        << +orientation;
    // OpenCV's reader, which others use, agrees.
    const cv::Mat theirs = cv::imdecode(jpeg, cv::IMREAD_COLOR);
    EXPECT_EQ(theirs.cols, picture.image.width_px);
    EXPECT_EQ(
        cv::norm(theirs,
                 cv::Mat(theirs.size(), CV_8UC3, const_cast<uint8_t*>(picture.image.bytes.data())),
                 cv::NORM_INF),
        0)
        << +orientation;
  }
}

TEST(Picture, SixteenBitsAreScaledByThoseThatAreUsed) {
  for (const auto& [bits, bright] : {std::pair{12, 4000}, {10, 1000}, {16, 64000}, {14, 16000}}) {
    for (const char* extension : {".png", ".tiff"}) {
      const Bytes bytes = encoded(corner_picture(CV_16UC1, bright), extension);
      EXPECT_EQ(used_bits(bytes), bits);
      const Picture picture = decode_picture(bytes, 1, used_bits(bytes));
      EXPECT_NEAR(value_at(picture.image, 4, 4), bright >> (bits - 8), 1);
      EXPECT_GT(value_at(picture.image, 4, 4), 200);
      EXPECT_NEAR(value_at(picture.image, 90, 60), value_at(picture.image, 4, 4) / 10, 2);
    }
  }
  EXPECT_EQ(used_bits(encoded(corner_picture(), ".png")), 0);
  EXPECT_EQ(decode_picture(encoded(corner_picture(CV_16UC1, 4000), ".png"), 1, 11).image.bytes[0],
            255)
      << "brighter than expected is white";
}

TEST(Picture, OfASizeThatIsNotReadIsRefused) {
  for (const cv::Size size : {cv::Size(15, 40), {40, 15}, {8193, 16}, {16, 8193}}) {
    for (const char* extension : {".jpg", ".png"}) {
      const Picture picture =
          decode_picture(encoded(cv::Mat(size, CV_8UC3, cv::Scalar::all(9)), extension), 3);
      EXPECT_NE(picture.error.find("sides of 16 to 8192 px"), std::string::npos) << picture.error;
      EXPECT_TRUE(picture.image.bytes.empty());
    }
  }
}

TEST(Picture, ThatEndsEarlyIsRefusedWhateverItsFormat) {
  cv::Mat noise(64, 96, CV_8UC3);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  for (const char* extension : {".png", ".tiff", ".bmp", ".webp", ".ppm"}) {
    const Bytes whole = encoded(noise, extension);
    EXPECT_EQ(decode_picture(whole, 3).error, "") << extension;
    EXPECT_NE(decode_picture(std::span(whole).first(whole.size() * 6 / 10), 3).error, "")
        << extension;
  }
}

TEST(Picture, WhatIsNoImageSaysWhy) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_picture(folder.path() + "/none.png", 3).error, "does not exist");
  EXPECT_EQ(read_picture(folder.write("empty.png", ""), 3).error, "is empty");
  EXPECT_EQ(read_picture(folder.write("text.png", "no picture"), 3).error,
            "cannot be read as an image");
  EXPECT_EQ(read_picture(folder.path(), 3).error, "cannot be read");
  const cv::Mat floats(8, 8, CV_32FC3, cv::Scalar::all(0.5));
  EXPECT_NE(decode_picture(encoded(floats, ".hdr"), 3).error.find("neither 8 nor 16"),
            std::string::npos);
}

}  // namespace
}  // namespace foresight
