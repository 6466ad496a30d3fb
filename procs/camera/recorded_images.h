// The images of a folder or a video in any order, for tools that play them more than once.
//
//   RecordedImages images("room.mp4");
//   for (size_t i = 0; i < images.list().size(); ++i) {
//     const Picture gray = images.read(i, 1);
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "procs/camera/image_list.h"
#include "procs/camera/picture.h"
#include "procs/camera/video_file.h"

namespace foresight {

class RecordedImages {
 public:
  /// A folder with rgb.txt, or a video, which is decoded once to know its stamps. Throws
  /// StartupError.
  explicit RecordedImages(const std::string& source);

  /// Stamps, and a file or "VIDEO frame N" for messages.
  const std::vector<ListedImage>& list() const { return list_; }
  /// `channels`: 1 gray, 3 RGB. Of a video going forwards is cheap, going back decodes it again.
  Picture read(size_t index, int channels);
  std::string shortfall() const { return shortfall_; }
  std::string note() const { return note_; }

 private:
  void scan_video();
  Image video_image(size_t index);

  std::string source_;
  std::vector<ListedImage> list_;
  int bits_ = 16;  // of 16-bit files
  std::string shortfall_, note_;
  // Of a video: the frames decoded last, the newest of which is the one before `next_`.
  std::optional<VideoFile> video_;
  std::deque<Image> recent_;
  size_t next_ = 0;
};

/// The bits that 16-bit images of a list use: by a few of them, evenly spread. 16 for others.
int bits_of(const std::vector<ListedImage>& images);

}  // namespace foresight
