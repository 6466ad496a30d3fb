#include "procs/camera/frame_converter.h"

#include <gtest/gtest.h>

#include "common/image_codec.h"

namespace foresight {
namespace {

CameraModel make_camera(int width_px, int height_px, double k1 = 0) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 0.9 * width_px;
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  camera.distortion[0] = k1;
  camera.prepare();
  return camera;
}

// Smooth, so that resampling changes little: value(x, y) along both axes.
double value(const Eigen::Vector2d& p) { return 40 + 1.2 * p.x() + 0.9 * p.y(); }

Frame make_frame(int width_px, int height_px, int channels) {
  Frame frame;
  frame.image = {width_px, height_px, channels, {}};
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int c = 0; c < channels; ++c) {
        frame.image.bytes.push_back(static_cast<uint8_t>(value(Eigen::Vector2d(x, y))));
      }
    }
  }
  return frame;
}

Frame make_jpeg_frame(int width_px, int height_px) {
  image_t message{};
  encode_jpeg(make_frame(width_px, height_px, 3).image, 90, &message);
  Frame frame;
  frame.jpeg = message.data;
  return frame;
}

TEST(FrameConverter, KeepsTheBytesOfAJpegThatNeedsNothing) {
  const Frame frame = make_jpeg_frame(96, 64);
  FrameConverter converter(make_camera(96, 64), {});
  const auto message = converter.convert(frame);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->data, frame.jpeg);
  EXPECT_EQ(converter.output_camera(), make_camera(96, 64));
}

TEST(FrameConverter, ReducesImageAndIntrinsicsTogether) {
  CameraParams params;
  params.max_width_px = 64;
  params.encoding = Encoding::kGray;
  FrameConverter converter(make_camera(128, 96), params);
  const CameraModel& camera = converter.output_camera();
  EXPECT_EQ(camera.width_px, 64);
  EXPECT_EQ(camera.height_px, 48);
  for (const Frame& frame :
       {make_frame(128, 96, 3), make_frame(128, 96, 1), make_jpeg_frame(128, 96)}) {
    const auto message = converter.convert(frame);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->encoding, +image_t::ENCODING_GRAY8);
    ASSERT_EQ(message->n_data, 64 * 48);
    // The same ray has the same value in both.
    const Eigen::Vector2d small(20, 30);
    const Eigen::Vector2d large = make_camera(128, 96).project_normalized(camera.unproject(small));
    EXPECT_NEAR(message->data[30 * 64 + 20], value(large), 2);
  }
}

TEST(FrameConverter, RemovesDistortion) {
  CameraParams params;
  params.undistort = true;
  params.encoding = Encoding::kGray;
  const CameraModel distorted = make_camera(96, 64, -0.15);
  FrameConverter converter(distorted, params);
  const CameraModel& camera = converter.output_camera();
  EXPECT_FALSE(camera.has_distortion());
  const auto message = converter.convert(make_frame(96, 64, 1));
  ASSERT_TRUE(message);
  for (const auto& [x, y] : {std::pair{10, 10}, {48, 32}, {85, 50}, {20, 60}}) {
    const Eigen::Vector2d source = distorted.project_normalized(camera.unproject({x, y}));
    EXPECT_NEAR(message->data[static_cast<size_t>(y) * 96 + x], value(source), 1.5)
        << x << " " << y;
  }
}

TEST(FrameConverter, UndistortionOfAPinholeChangesNothing) {
  CameraParams params;
  params.undistort = true;
  const Frame frame = make_jpeg_frame(96, 64);
  FrameConverter converter(make_camera(96, 64), params);
  EXPECT_EQ(converter.convert(frame)->data, frame.jpeg);
}

TEST(FrameConverter, RefusesDamagedFramesAndThoseOfAnotherSize) {
  FrameConverter converter(make_camera(96, 64), {});
  EXPECT_FALSE(converter.convert(make_frame(64, 96, 3)));
  EXPECT_NE(converter.error().find("96x64"), std::string::npos);
  EXPECT_FALSE(converter.convert(make_jpeg_frame(64, 64)));
  Frame cut = make_jpeg_frame(96, 64);
  cut.jpeg.resize(cut.jpeg.size() / 2);
  EXPECT_FALSE(converter.convert(cut));
  EXPECT_TRUE(converter.convert(make_jpeg_frame(96, 64))) << "and goes on";
}

// Not every decoder is as tolerant as ours: what travels is whole.
TEST(FrameConverter, WritesAnOddJpegAnew) {
  FrameConverter converter(make_camera(96, 64), {});
  Frame odd = make_jpeg_frame(96, 64);
  odd.jpeg.resize(odd.jpeg.size() - 2);
  const auto message = converter.convert(odd);
  ASSERT_TRUE(message);
  EXPECT_NE(converter.warning(), "");
  EXPECT_NE(message->data, odd.jpeg);
  EXPECT_TRUE(decode_image(*message, 3));
}

}  // namespace
}  // namespace foresight
