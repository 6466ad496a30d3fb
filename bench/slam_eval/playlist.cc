#include "bench/slam_eval/playlist.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr Duration kBlackout = seconds(1);
constexpr Duration kJumpLength = milliseconds(700);
constexpr double kFirstBlackout = 0.4, kLastBlackout = 0.85;  // shares of the sequence
constexpr double kSwingPeriod_s = 2;
constexpr unsigned kSeed = 20240817;

void black_out(std::vector<PlayedImage>* list, int count) {
  const Time begin = list->front().time;
  const double length_s = (list->back().time - begin).seconds();
  for (int i = 0; i < count; ++i) {
    const double share =
        kFirstBlackout + (kLastBlackout - kFirstBlackout) * i / std::max(1, count - 1);
    const Time from = begin + seconds(share * length_s), to = from + kBlackout;
    bool was_black = false;
    for (PlayedImage& played : *list) {
      played.black = played.black || (played.time >= from && played.time < to);
      if (was_black && !played.black) played.disturbed = true;
      was_black = played.black;
    }
  }
}

// The camera goes back the way it came, again and again: an hour at one place in short.
void append_passes(int passes, std::vector<PlayedImage>* list) {
  const std::vector<PlayedImage> there = *list;
  for (int pass = 1; pass < passes; ++pass) {
    for (size_t i = 1; i < there.size(); ++i) {
      const bool back = pass % 2 == 1;
      const PlayedImage& next = there[back ? there.size() - 1 - i : i];
      const PlayedImage& last = there[back ? there.size() - i : i - 1];
      const int64_t apart_us = std::abs((next.time - last.time).us);
      PlayedImage played = next;
      played.time = list->back().time + Duration{apart_us};
      list->push_back(played);
    }
  }
}

// Pieces of the sequence at random places, appended.
void append_jumps(int count, std::vector<PlayedImage>* list) {
  if (count == 0 || list->size() < 2) return;
  const std::vector<PlayedImage> whole = *list;
  const Duration span = whole.back().time - whole.front().time;
  const Duration period{std::max<int64_t>(1, span.us / static_cast<int64_t>(whole.size()))};
  const auto length = static_cast<size_t>(std::max<int64_t>(2, kJumpLength.us / period.us));
  std::mt19937 random(kSeed);
  for (int i = 0; i < count && whole.size() > 3 * length; ++i) {
    // The first fifth of a sequence may come before there is a map.
    const size_t low = whole.size() / 5, room = whole.size() - length - low;
    const size_t from = low + random() % room;
    for (size_t n = 0; n < length; ++n) {
      PlayedImage played = whole[from + n];
      played.time = list->back().time + period;
      played.disturbed = n == 0;
      list->push_back(played);
    }
  }
}

}  // namespace

const std::vector<Degradation>& known_degradations() {
  static const std::vector<Degradation> all = {
      {},
      {.name = "third", .doc = "every third image", .step = 3},
      {.name = "noise", .doc = "normal noise of 10 gray levels", .noise_sigma = 10},
      {.name = "jpeg40", .doc = "JPEG of quality 40", .jpeg_quality = 40},
      {.name = "half", .doc = "half the width and height", .half_size = true},
      {.name = "exposure", .doc = "brightness swings by 30 % in 2 s", .gain_swing = 0.3},
      {.name = "blackout", .doc = "black for 1 s, three times", .blackouts = 3},
      {.name = "passes", .doc = "there and back, ten passes in all", .passes = 10},
      {.name = "jumps", .doc = "then 20 pieces of 0.7 s from random places", .jumps = 20},
  };
  return all;
}

const Degradation& degradation_named(const std::string& name) {
  std::string names;
  for (const Degradation& d : known_degradations()) {
    if (d.name == name) return d;
    names += (names.empty() ? "" : ", ") + d.name;
  }
  throw UsageError("there is no degradation '" + name + "'; there are: " + names);
}

std::vector<PlayedImage> make_playlist(const Sequence& sequence, const PlayRange& range,
                                       const Degradation& degradation) {
  std::vector<PlayedImage> list;
  const auto begin = static_cast<size_t>(std::max(0, range.start));
  const auto step = static_cast<size_t>(range.step * degradation.step);
  for (size_t i = begin; i < sequence.images.size(); i += step) {
    if (range.frames >= 0 && i >= begin + static_cast<size_t>(range.frames)) break;
    list.push_back({i, sequence.images[i].time, false, false});
  }
  if (list.empty()) throw UsageError("no image of the sequence is in this range");
  append_passes(degradation.passes, &list);
  black_out(&list, degradation.blackouts);
  append_jumps(degradation.jumps, &list);
  return list;
}

CameraModel degraded_camera(const CameraModel& camera, const Degradation& degradation) {
  return degradation.half_size ? camera.scaled(0.5) : camera;
}

cv::Mat degraded_image(const cv::Mat& gray, const PlayedImage& played,
                       const Degradation& degradation) {
  cv::Mat image = gray;
  if (played.black) return cv::Mat::zeros(gray.size(), CV_8UC1);
  if (degradation.half_size) {
    cv::resize(gray, image, {gray.cols / 2, gray.rows / 2}, 0, 0, cv::INTER_AREA);
  }
  if (degradation.gain_swing > 0) {
    const double phase = 2 * CV_PI * static_cast<double>(played.time.us) / (kSwingPeriod_s * 1e6);
    image.convertTo(image, CV_8U, 1 + degradation.gain_swing * std::sin(phase));
  }
  if (degradation.noise_sigma > 0) {
    cv::RNG random(kSeed + played.index);
    cv::Mat noise(image.size(), CV_16S);
    random.fill(noise, cv::RNG::NORMAL, 0, degradation.noise_sigma);
    cv::add(image, noise, image, cv::noArray(), CV_8U);
  }
  if (degradation.jpeg_quality > 0) {
    std::vector<uint8_t> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, degradation.jpeg_quality});
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  }
  return image;
}

}  // namespace foresight
