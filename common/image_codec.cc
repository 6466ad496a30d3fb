#include "common/image_codec.h"

#include <turbojpeg.h>

#include <memory>

#include "common/check.h"

namespace foresight {
namespace {

struct Closer {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Closer>;

int pixel_format(int channels) { return channels == 1 ? TJPF_GRAY : TJPF_RGB; }

std::optional<Image> decode_jpeg_with(void* decoder, const image_t& message, int channels) {
  int width = 0, height = 0, subsampling = 0, colourspace = 0;
  const auto* data = message.data.data();
  const auto size = static_cast<unsigned long>(message.data.size());
  if (tjDecompressHeader3(decoder, data, size, &width, &height, &subsampling, &colourspace) != 0) {
    return std::nullopt;
  }
  if (width != message.width_px || height != message.height_px) return std::nullopt;
  Image image{width, height, channels, {}};
  image.bytes.resize(static_cast<size_t>(width) * height * channels);
  if (tjDecompress2(decoder, data, size, image.bytes.data(), width, width * channels, height,
                    pixel_format(channels), 0) != 0) {
    return std::nullopt;
  }
  return image;
}

std::optional<Image> decode_jpeg(const image_t& message, int channels) {
  static thread_local Handle decoder;
  if (!decoder) decoder.reset(tjInitDecompress());
  auto image = decode_jpeg_with(decoder.get(), message, channels);
  // After some damaged images libturbojpeg's decoder refuses every later one.
  if (!image) decoder.reset();
  return image;
}

// Rec. 601 luma, as JPEG's Y.
Image convert_channels(Image image, int channels) {
  if (image.channels == channels) return image;
  const size_t count = static_cast<size_t>(image.width_px) * image.height_px;
  Image out{image.width_px, image.height_px, channels, {}};
  out.bytes.resize(count * channels);
  for (size_t i = 0; i < count; ++i) {
    if (channels == 3) {
      for (size_t c = 0; c < 3; ++c) out.bytes[3 * i + c] = image.bytes[i];
    } else {
      const uint8_t* p = &image.bytes[3 * i];
      out.bytes[i] = static_cast<uint8_t>((299 * p[0] + 587 * p[1] + 114 * p[2] + 500) / 1000);
    }
  }
  return out;
}

}  // namespace

std::optional<Image> decode_image(const image_t& message, int channels) {
  const int64_t count = static_cast<int64_t>(message.width_px) * message.height_px;
  if (message.width_px <= 0 || message.height_px <= 0 || count > kMaxPixels) return std::nullopt;
  if (message.encoding == image_t::ENCODING_JPEG) return decode_jpeg(message, channels);
  const bool gray = message.encoding == image_t::ENCODING_GRAY8;
  if (!gray && message.encoding != image_t::ENCODING_RGB8) return std::nullopt;
  if (static_cast<int64_t>(message.data.size()) != count * (gray ? 1 : 3)) return std::nullopt;
  return convert_channels({message.width_px, message.height_px, gray ? 1 : 3, message.data},
                          channels);
}

void encode_jpeg(const Image& image, int quality, image_t* message) {
  static thread_local const Handle encoder(tjInitCompress());
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int status =
      tjCompress2(encoder.get(), image.bytes.data(), image.width_px,
                  image.width_px * image.channels, image.height_px, pixel_format(image.channels),
                  &data, &size, image.channels == 1 ? TJSAMP_GRAY : TJSAMP_420, quality, 0);
  FORESIGHT_CHECK(status == 0);
  message->width_px = static_cast<int16_t>(image.width_px);
  message->height_px = static_cast<int16_t>(image.height_px);
  message->encoding = image_t::ENCODING_JPEG;
  message->data.assign(data, data + size);
  message->n_data = static_cast<int32_t>(size);
  tjFree(data);
}

void encode_raw(const Image& image, image_t* message) {
  message->width_px = static_cast<int16_t>(image.width_px);
  message->height_px = static_cast<int16_t>(image.height_px);
  message->encoding = image.channels == 1 ? image_t::ENCODING_GRAY8 : image_t::ENCODING_RGB8;
  message->data = image.bytes;
  message->n_data = static_cast<int32_t>(image.bytes.size());
}

}  // namespace foresight
