// Writes pictures to a video or to numbered PNG files, through the ffmpeg program: the codecs stay
// out of the process. The size is that of the beginning: later pictures of another size (somebody
// resizes the window) are fitted into it. An interrupted MP4 stays playable (fragmented).
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

  /// False once ffmpeg has gone away; why_ended() says why. The picture is not written then.
  [[nodiscard]] bool write(const Image& rgb);
  /// ffmpeg's exit code and its last two lines; empty while it runs.
  const std::string& why_ended() const { return why_ended_; }
  int64_t frames() const { return frames_; }

 private:
  std::string last_complaint() const;
  void close();

  std::FILE* pipe_ = nullptr;
  std::FILE* complaints_ = nullptr;  // ffmpeg's, in a file without a name
  int width_px_, height_px_;
  int64_t frames_ = 0;
  std::string why_ended_;
};

}  // namespace foresight
