#pragma once

#include <string>

#include "common/params.h"

namespace foresight {

enum class Pace { kReal, kConsumed };
constexpr auto names_of(Pace) {
  return std::array{EnumName{Pace::kReal, "real"}, EnumName{Pace::kConsumed, "consumed"}};
}
enum class Stamps { kRebased, kOriginal };
constexpr auto names_of(Stamps) {
  return std::array{EnumName{Stamps::kRebased, "rebased"}, EnumName{Stamps::kOriginal, "original"}};
}
enum class Encoding { kJpeg, kGray };
constexpr auto names_of(Encoding) {
  return std::array{EnumName{Encoding::kJpeg, "jpeg"}, EnumName{Encoding::kGray, "gray"}};
}

struct CameraParams {
  std::string source;
  std::string camera_file;
  Pace pace = Pace::kReal;
  double speed = 1.0;
  Stamps stamps = Stamps::kRebased;
  Encoding encoding = Encoding::kJpeg;
  int jpeg_quality = 85;
  int max_width_px = 640;
  bool undistort = false;
  bool loop = false;
  int first_frame = 0;
  int frame_count = 0;
  bool exit_at_end = false;

  template <class V>
  void visit(V& v) {
    v("source", source,
      {.doc = "folder in TUM layout (rgb.txt), video file, or device (/dev/video0)"});
    v("camera_file", camera_file,
      {.doc = "intrinsics (YAML); empty: camera.yaml in the folder, else guessed and said so"});
    v("pace", pace,
      {.doc = "of recorded sources: at their time-stamps, or the next frame when slam has answered "
              "the last"});
    v("speed", speed, {.unit = "1", .min = 0.01, .max = 100, .doc = "factor on the real pace"});
    v("stamps", stamps,
      {.doc = "utime of recorded frames: as if captured when published, or as recorded"});
    v("encoding", encoding, {.doc = "of IMAGE"});
    v("jpeg_quality", jpeg_quality,
      {.unit = "1", .min = 1, .max = 100, .doc = "of encoded frames"});
    v("max_width_px", max_width_px,
      {.unit = "px", .min = 64, .max = 8192, .doc = "wider frames are reduced to this width"});
    v("undistort", undistort, {.doc = "publish distortion-free frames and intrinsics"});
    v("loop", loop, {.doc = "start a recorded source again at its end"});
    v("first_frame", first_frame,
      {.unit = "1", .min = 0, .max = 1e9, .doc = "frames of a recorded source to skip"});
    v("frame_count", frame_count,
      {.unit = "1", .min = 0, .max = 1e9, .doc = "frames to publish; 0: all"});
    v("exit_at_end", exit_at_end,
      {.doc = "end the process when the source has ended; exit code 69: images were refused"});
  }
};

}  // namespace foresight
