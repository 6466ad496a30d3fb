#include "procs/camera/jpeg_picture.h"

#include <csetjmp>
#include <cstdio>
#include <cstring>
//
#include <jerror.h>
#include <jpeglib.h>

namespace foresight {
namespace {

constexpr int64_t kMaxPixels = 8192LL * 8192;
constexpr std::string_view kExif{"Exif\0\0", 6};

struct Complaints {
  jpeg_error_mgr manager;  // first: libjpeg knows this address
  std::jmp_buf give_up;
  char fatal[JMSG_LENGTH_MAX] = "";
  char first[JMSG_LENGTH_MAX] = "";   // of the warnings
  char damage[JMSG_LENGTH_MAX] = "";  // the first that means lost pixels
};

// Of these part of the picture is gone. Others (bytes between segments, no end marker, an unknown
// version) leave it whole.
bool loses_pixels(int code) {
  return code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE || code == JWRN_MUST_RESYNC ||
         code == JWRN_BOGUS_PROGRESSION;
}

void on_fatal(j_common_ptr info) {
  auto* complaints = reinterpret_cast<Complaints*>(info->err);
  info->err->format_message(info, complaints->fatal);
  std::longjmp(complaints->give_up, 1);
}

void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;  // traces
  auto* complaints = reinterpret_cast<Complaints*>(info->err);
  ++info->err->num_warnings;
  if (complaints->first[0] == '\0') info->err->format_message(info, complaints->first);
  if (complaints->damage[0] == '\0' && loses_pixels(info->err->msg_code)) {
    info->err->format_message(info, complaints->damage);
  }
}

class ExifReader {
 public:
  ExifReader(const uint8_t* data, size_t size) : data_(data), size_(size) {}
  /// 1 (upright) unless the block says otherwise.
  int orientation() {
    if (size_ < 8 || std::memcmp(data_, kExif.data(), kExif.size()) != 0) return 1;
    data_ += kExif.size(), size_ -= kExif.size();
    is_little_ = data_[0] == 'I';
    const size_t directory = read(4, 4);
    const size_t count = read(directory, 2);
    for (size_t i = 0; i < count; ++i) {
      const size_t entry = directory + 2 + 12 * i;
      if (read(entry, 2) != kOrientationTag) continue;
      const auto value = static_cast<int>(read(entry + 8, 2));
      return value >= 1 && value <= 8 ? value : 1;
    }
    return 1;
  }

 private:
  static constexpr size_t kOrientationTag = 0x0112;
  size_t read(size_t at, size_t bytes) const {
    if (at > size_ || bytes > size_ - at) return 0;
    size_t value = 0;
    for (size_t i = 0; i < bytes; ++i) {
      const size_t byte = data_[at + (is_little_ ? bytes - 1 - i : i)];
      value = value << 8 | byte;
    }
    return value;
  }
  const uint8_t* data_;
  size_t size_;
  bool is_little_ = false;
};

int orientation_of(const jpeg_decompress_struct& info) {
  for (const jpeg_marker_struct* m = info.marker_list; m != nullptr; m = m->next) {
    const int orientation = ExifReader(m->data, m->data_length).orientation();
    if (orientation != 1) return orientation;
  }
  return 1;
}

// Adobe's CMYK and YCCK are stored inverted (0: full ink), those of others are not.
void cmyk_to_rgb(const uint8_t* cmyk, int width_px, bool inverted, int channels, uint8_t* out) {
  for (int x = 0; x < width_px; ++x, cmyk += 4) {
    const auto light = [&](int i) { return inverted ? cmyk[i] : 255 - cmyk[i]; };
    int rgb[3];
    for (int c = 0; c < 3; ++c) rgb[c] = (light(c) * light(3) + 127) / 255;
    if (channels == 1) {
      *out++ = static_cast<uint8_t>((299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2] + 500) / 1000);
    } else {
      for (const int value : rgb) *out++ = static_cast<uint8_t>(value);
    }
  }
}

bool is_cmyk(const jpeg_decompress_struct& info) {
  return info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK;
}

// After the header: true if its size is one that we read.
bool read_header(jpeg_decompress_struct* info, int channels, Picture* picture) {
  jpeg_save_markers(info, JPEG_APP0 + 1, 0xFFFF);
  jpeg_read_header(info, TRUE);
  const int64_t count = static_cast<int64_t>(info->image_width) * info->image_height;
  if (count <= 0 || count > kMaxPixels) {
    picture->error = "has " + std::to_string(info->image_width) + "x" +
                     std::to_string(info->image_height) + " px, which is too large";
    return false;
  }
  info->out_color_space = is_cmyk(*info) ? JCS_CMYK : channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  return true;
}

void read_rows(jpeg_decompress_struct* info, std::vector<uint8_t>* row, Image* image) {
  const size_t stride = static_cast<size_t>(image->width_px) * image->channels;
  while (info->output_scanline < info->output_height) {
    uint8_t* target = image->bytes.data() + stride * info->output_scanline;
    JSAMPROW rows[1] = {is_cmyk(*info) ? row->data() : target};
    jpeg_read_scanlines(info, rows, 1);
    if (is_cmyk(*info)) {
      cmyk_to_rgb(row->data(), image->width_px, info->saw_Adobe_marker, image->channels, target);
    }
  }
}

void conclude(const Complaints& complaints, bool cmyk, int orientation, Picture* picture) {
  if (picture->error.empty() && complaints.fatal[0] != '\0') {
    picture->error = std::string("damaged JPEG: ") + complaints.fatal;
  }
  if (picture->error.empty() && complaints.damage[0] != '\0') {
    picture->error = complaints.damage;
  }
  if (!picture->error.empty()) {
    picture->image = {};
    return;
  }
  if (cmyk) picture->warning = "CMYK picture, made for print: converted to RGB";
  if (complaints.first[0] != '\0') picture->warning = complaints.first;
  picture->is_plain_jpeg = picture->warning.empty() && orientation == 1;
  if (orientation != 1) picture->image = oriented(picture->image, orientation);
}

}  // namespace

Picture decode_jpeg_picture(std::span<const uint8_t> bytes, int channels) {
  // What lives across longjmp is not held in registers: all of it is in objects.
  struct Work {
    jpeg_decompress_struct info{};
    Complaints complaints{};
    Picture picture;
    std::vector<uint8_t> row;
    bool cmyk = false;
    int orientation = 1;
  } work;
  work.info.err = jpeg_std_error(&work.complaints.manager);
  work.complaints.manager.error_exit = on_fatal;
  work.complaints.manager.emit_message = on_message;
  jpeg_create_decompress(&work.info);
  if (setjmp(work.complaints.give_up) == 0) {
    jpeg_mem_src(&work.info, bytes.data(), static_cast<unsigned long>(bytes.size()));
    if (read_header(&work.info, channels, &work.picture)) {
      jpeg_start_decompress(&work.info);
      const auto width_px = static_cast<int>(work.info.output_width);
      const auto height_px = static_cast<int>(work.info.output_height);
      work.picture.image = {width_px, height_px, channels, {}};
      work.picture.image.bytes.resize(static_cast<size_t>(width_px) * height_px * channels);
      work.row.resize(4 * static_cast<size_t>(width_px));
      work.cmyk = is_cmyk(work.info);
      work.orientation = orientation_of(work.info);
      read_rows(&work.info, &work.row, &work.picture.image);
      jpeg_finish_decompress(&work.info);
    }
  }
  jpeg_destroy_decompress(&work.info);
  conclude(work.complaints, work.cmyk, work.orientation, &work.picture);
  return std::move(work.picture);
}

}  // namespace foresight
