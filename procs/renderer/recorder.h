// Writes pictures of one size to a video or to numbered PNG files, through the ffmpeg program: the
// codecs stay out of the process. An interrupted MP4 stays playable (fragmented).
#pragma once

#include <cstdio>
#include <string>

#include "common/image.h"

namespace foresight {

class Recorder {
 public:
  /// `path`: FILE.mp4 or a pattern like FOLDER/%05d.png, whose folder is created. Throws
  /// UnavailableError.
  Recorder(const std::string& path, int width_px, int height_px, double fps);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// False once ffmpeg has gone away (disk full, say); the picture is not written then.
  [[nodiscard]] bool write(const Image& rgb);
  int64_t frames() const { return frames_; }

 private:
  std::FILE* pipe_ = nullptr;
  int width_px_, height_px_;
  int64_t frames_ = 0;
};

}  // namespace foresight
