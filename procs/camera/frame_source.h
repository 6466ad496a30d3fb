// Where frames come from: a folder in TUM RGB-D layout, a video file, a V4L2 device. The one reader
// of image sequences: camera, evaluate, calibrate-camera go through a FrameSource; slam-eval and
// mesh-eval through RecordedImages (recorded_images.h), which stands on the same parts.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/image.h"
#include "common/time.h"
#include "procs/camera/picture.h"

namespace foresight {

struct Frame {
  Time time;                  // as recorded; of a device: zero, the process stamps it
  std::vector<uint8_t> jpeg;  // the file's own bytes, when it is a JPEG
  Image image;                // decoded, otherwise
  std::string name;           // file, or number in the video, for messages
  std::string error;          // why there is neither
  std::string warning;        // decoded, but odd
};

/// A frame's pixels, or why there are none.
Picture picture_of(const Frame& frame, int channels);

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, or nothing at the end (recorded) or when the device has failed. An image that
  /// is missing or damaged is a frame with an error: the ones after it follow.
  virtual std::optional<Frame> next() = 0;
  /// A device delivers at its own pace and next() waits for it.
  virtual bool is_live() const { return false; }
  virtual void rewind() {}
  /// One line after next() returned nothing because of an error; empty at a plain end.
  virtual std::string error() const { return {}; }
  /// After the end: what a video's container promised beyond what there was.
  virtual std::string shortfall() const { return {}; }
  /// What was done to all frames that a user should know.
  virtual std::string note() const { return {}; }
};

/// Chooses by what `source` names. Throws ConfigError or UnavailableError.
std::unique_ptr<FrameSource> open_frame_source(const std::string& source);

}  // namespace foresight
