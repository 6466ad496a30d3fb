#include "common/image_codec.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace foresight {
namespace {

Image make_picture(int width_px, int height_px, int channels) {
  Image image{width_px, height_px, channels, {}};
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.bytes.push_back(static_cast<uint8_t>(60 + x + 2 * y + 40 * c));
      }
    }
  }
  return image;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.bytes.size(); ++i) sum += std::abs(a.bytes[i] - b.bytes[i]);
  return sum / static_cast<double>(a.bytes.size());
}

class Channels : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(GrayAndColour, Channels, testing::Values(1, 3));

TEST_P(Channels, RawSurvivesExactly) {
  const Image image = make_picture(33, 21, GetParam());
  image_t message{};
  encode_raw(image, &message);
  const auto decoded = decode_image(message, GetParam());
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->bytes, image.bytes);
}

TEST_P(Channels, JpegSurvivesNearly) {
  const Image image = make_picture(32, 24, GetParam());
  image_t message{};
  encode_jpeg(image, 95, &message);
  EXPECT_EQ(message.encoding, +image_t::ENCODING_JPEG);
  EXPECT_EQ(message.n_data, static_cast<int32_t>(message.data.size()));
  const auto decoded = decode_image(message, GetParam());
  ASSERT_TRUE(decoded && decoded->is_valid());
  EXPECT_LT(mean_difference(*decoded, image), 2);
}

TEST(ImageCodec, TurnsGrayToColourAndBack) {
  image_t message{};
  encode_raw(make_picture(8, 8, 1), &message);
  const auto colour = decode_image(message, 3);
  ASSERT_TRUE(colour);
  EXPECT_EQ(colour->bytes[3], colour->bytes[5]);
  encode_raw(*colour, &message);
  const auto gray = decode_image(message, 1);
  ASSERT_TRUE(gray);
  EXPECT_EQ(gray->bytes, make_picture(8, 8, 1).bytes);
}

TEST(ImageCodec, RefusesRawDataOfTheWrongSize) {
  image_t message{};
  encode_raw(make_picture(8, 8, 3), &message);
  message.data.pop_back();
  EXPECT_FALSE(decode_image(message, 3));
  message.data.clear();
  EXPECT_FALSE(decode_image(message, 3));
}

TEST(ImageCodec, RefusesImpossibleSizesAndEncodings) {
  image_t good{};
  encode_raw(make_picture(8, 8, 1), &good);
  for (const auto& [width_px, height_px] :
       {std::pair{0, 8}, {8, 0}, {-8, -8}, {32767, 32767}, {8, 9}}) {
    image_t message = good;
    message.width_px = static_cast<int16_t>(width_px);
    message.height_px = static_cast<int16_t>(height_px);
    EXPECT_FALSE(decode_image(message, 1)) << width_px << "x" << height_px;
  }
  image_t message = good;
  message.encoding = 17;
  EXPECT_FALSE(decode_image(message, 1));
}

TEST(ImageCodec, RefusesAJpegWhoseSizeContradictsTheMessage) {
  image_t message{};
  encode_jpeg(make_picture(32, 24, 3), 85, &message);
  message.width_px = 64;
  EXPECT_FALSE(decode_image(message, 3));
}

TEST(ImageCodec, RefusesATruncatedJpeg) {
  image_t whole{};
  encode_jpeg(make_picture(64, 48, 3), 85, &whole);
  for (size_t size = 0; size < whole.data.size() - 2; size += 7) {
    image_t message = whole;
    message.data.resize(size);
    EXPECT_FALSE(decode_image(message, 3)) << size << " of " << whole.data.size();
  }
}

TEST(ImageCodec, SurvivesDamagedJpegs) {
  image_t whole{};
  encode_jpeg(make_picture(64, 48, 3), 85, &whole);
  std::mt19937 random(11);
  for (int i = 0; i < 3000; ++i) {
    image_t message = whole;
    for (uint32_t flips = 1 + random() % 8; flips > 0; --flips) {
      message.data[random() % message.data.size()] = static_cast<uint8_t>(random());
    }
    const auto decoded = decode_image(message, i % 2 == 0 ? 1 : 3);
    if (decoded) {
      EXPECT_TRUE(decoded->is_valid());
    }
    ASSERT_TRUE(decode_image(whole, 3)) << "damage number " << i << " spoiled the next image";
  }
}

}  // namespace
}  // namespace foresight
