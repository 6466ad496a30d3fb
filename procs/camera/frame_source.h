// Where frames come from: a folder in TUM RGB-D layout, a video file, a V4L2 device.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/image.h"
#include "common/time.h"

namespace foresight {

struct Frame {
  Time time;                  // as recorded; of a device: zero, the process stamps it
  std::vector<uint8_t> jpeg;  // the file's own bytes, when it is a JPEG
  Image image;                // decoded, otherwise
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, or nothing at the end (recorded) or when the device has failed.
  virtual std::optional<Frame> next() = 0;
  /// A device delivers at its own pace and next() waits for it.
  virtual bool is_live() const { return false; }
  virtual void rewind() {}
  /// One line after next() returned nothing because of an error; empty at a plain end.
  virtual std::string error() const { return {}; }
};

/// Chooses by what `source` names. Throws ConfigError or UnavailableError.
std::unique_ptr<FrameSource> open_frame_source(const std::string& source);

}  // namespace foresight
