// The pixels of an image file, as every tool of ours sees them: upright (EXIF orientation applied,
// so that intrinsics belong to the picture as a viewer shows it), 8 bits, gray or RGB.
//
//   const Picture picture = decode_picture(bytes, 3);
//   if (!picture.error.empty()) …            // damaged, missing, or of a kind that is not read
//   if (!picture.warning.empty()) …          // used, but something was odd
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/image.h"

namespace foresight {

struct Picture {
  Image image;          // empty when it cannot be used
  std::string error;    // then: why
  std::string warning;  // used, but so and so
  /// The bytes are a JPEG that shows just this picture to every decoder: nothing to turn, to
  /// convert or to warn about.
  bool is_plain_jpeg = false;
};

/// `channels`: 1 gray, 3 RGB, 0 as the file has them. `bits`: of 16-bit files, those that are used
/// (used_bits()); the highest 8 of them are kept, and brighter pixels are white.
/// JPEG: what the decoder only warns about is read; what lost part of the picture (a cut scan, a
/// bad code) is an error. CMYK is converted.
Picture decode_picture(std::span<const uint8_t> bytes, int channels, int bits = 16);

/// The same of a file; missing and empty files are errors too.
Picture read_picture(const std::string& path, int channels, int bits = 16);

/// The file's bytes; empty, with the reason in `error`, if there are none.
std::vector<uint8_t> read_bytes(const std::string& path, std::string* error);

/// How many bits the brightest pixel of a 16-bit picture needs (8…16); 0 when the picture has not
/// 16 bits or cannot be read.
int used_bits(std::span<const uint8_t> bytes);

/// What is said about 16-bit files that use fewer.
std::string bits_note(int bits);

/// Makes a picture of a size that is not read an error.
void check_size(Picture* picture);

/// Turns as EXIF's orientation (1…8) asks for.
Image oriented(const Image& image, int exif_orientation);

bool is_jpeg(std::span<const uint8_t> bytes);

}  // namespace foresight
