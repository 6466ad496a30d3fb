// A video file, decoded frame by frame by FFmpeg's libraries: upright (the container's rotation
// applied), at the container's time-stamps, past damage, and counting what was promised.
//
//   VideoFile video("room.mp4");
//   while (auto frame = video.next()) …
//   if (!video.shortfall().empty()) …      // "ended after 102 of 110 frames"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/image.h"
#include "common/time.h"

namespace foresight {

struct VideoFrame {
  Time time;    // since the first frame; increases
  Image image;  // RGB
};

class VideoFile {
 public:
  /// Throws UnavailableError when it holds no video that can be decoded.
  explicit VideoFile(const std::string& path);
  ~VideoFile();
  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;

  /// The next frame that can be decoded; nothing at the end.
  std::optional<VideoFrame> next();
  /// The same without its pixels, which cost most of the time.
  std::optional<Time> skip();
  /// What the container promises and the file does not hold, after next() gave nothing; empty when
  /// all was there.
  std::string shortfall() const;
  /// What was done to the frames that a user should know; empty if nothing.
  std::string note() const;

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace foresight
