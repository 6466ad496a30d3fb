// What the core is shown of a sequence: all of it as it is, or made harder in a stated way (issues
// that real cameras have), so that the same scores tell how far that degrades it.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "bench/slam_eval/sequence.h"

namespace foresight {

struct Degradation {
  std::string name = "none";
  std::string doc = "the sequence as it is";
  int step = 1;            // every so many images: 3 makes 10 fps of 30
  double noise_sigma = 0;  // gray levels, normal, independent per pixel
  int jpeg_quality = 0;    // 1…100; 0: not compressed again
  bool half_size = false;  // half the width and height
  double gain_swing = 0;   // exposure: brightness swings by this share, period 2 s
  int blackouts = 0;       // black images for 1 s, so many times, the camera moving on
  int passes = 1;          // there, back, there, …
  int jumps = 0;           // after the whole sequence: so many pieces of 0.7 s at random places
};

/// none, third, noise, jpeg40, half, exposure, blackout, jumps, passes.
const std::vector<Degradation>& known_degradations();
/// Throws UsageError that lists the known names.
const Degradation& degradation_named(const std::string& name);

/// One image as it is shown: possibly black, possibly a second time.
struct PlayedImage {
  size_t index = 0;  // into Sequence::images
  Time time;         // as the core is told; increases
  bool black = false;
  bool disturbed = false;  // the first good image after a black-out, or the first of a jump
};

struct PlayRange {
  int start = 0;
  int frames = -1;  // all
  int step = 1;     // every so many images: a faster camera
};
std::vector<PlayedImage> make_playlist(const Sequence& sequence, const PlayRange& range,
                                       const Degradation& degradation);

CameraModel degraded_camera(const CameraModel& camera, const Degradation& degradation);
/// `gray`: 8-bit, one channel. The image's index seeds the noise.
cv::Mat degraded_image(const cv::Mat& gray, const PlayedImage& played,
                       const Degradation& degradation);

}  // namespace foresight
