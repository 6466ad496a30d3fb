// Writes pictures to a video or to numbered PNG files, through the ffmpeg program: the codecs stay
// out of the process. The size is that of the beginning: later pictures of another size (somebody
// resizes the window) are fitted into it. An interrupted MP4 stays playable (fragmented).
//
// An ffmpeg that takes nothing (stopped, a disk that hangs) does not hold up whoever writes:
// pictures are dropped and counted until it goes on.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "common/image.h"

namespace foresight {

class Recorder {
 public:
  enum class Written {
    kYes,      // or will be with the next one
    kDropped,  // ffmpeg has not taken the one before yet
    kEnded,    // ffmpeg has gone away; why_ended() says why
  };

  /// `path`: FILE.mp4 or a pattern like FOLDER/%05d.png, whose folder is created. Throws
  /// UnavailableError.
  Recorder(const std::string& path, int width_px, int height_px, double fps);
  /// Waits for ffmpeg to finish the file, some seconds at most.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Waits for ffmpeg as long as kPatience at most (at the beginning, until it has started), and
  /// once only while it takes nothing.
  [[nodiscard]] Written write(const Image& rgb);
  /// ffmpeg's exit code and its last two lines; empty while it runs.
  const std::string& why_ended() const { return why_ended_; }
  int64_t frames() const { return frames_; }
  int64_t dropped() const { return dropped_; }

 private:
  using Patience = std::chrono::milliseconds;
  static constexpr Patience kPatienceAtBegin{2000}, kPatience{100}, kPatienceAtEnd{500};

  void start(const std::string& path, double fps);
  bool push(Patience patience);
  std::string last_complaint() const;
  void close();
  int wait_for_end();

  int width_px_, height_px_;
  std::FILE* complaints_ = nullptr;  // ffmpeg's, in a file without a name
  int pipe_ = -1;                    // to ffmpeg; -1: it has ended
  pid_t ffmpeg_ = -1;
  std::vector<uint8_t> picture_;  // the one that is under way, and how much of it ffmpeg has
  size_t taken_ = 0;
  size_t total_ = 0;    // bytes handed over: more than a pipe holds only if somebody reads
  bool hangs_ = false;  // it did not take a picture within the patience
  int64_t frames_ = 0, dropped_ = 0;
  std::string why_ended_;
};

}  // namespace foresight
