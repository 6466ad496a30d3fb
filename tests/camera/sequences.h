// Small image folders in TUM layout, written for a test.
#pragma once

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/common/files.h"

namespace foresight {

constexpr int kWidth_px = 64, kHeight_px = 48;

inline cv::Mat make_picture(int number) {
  cv::Mat picture(kHeight_px, kWidth_px, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      picture.at<cv::Vec3b>(y, x) = {static_cast<uchar>(4 * x), static_cast<uchar>(5 * y),
                                     static_cast<uchar>(10 * number)};
    }
  }
  return picture;
}

/// `count` frames, ten a second, from 100.0 s on. Returns the folder.
inline std::string write_sequence(const TemporaryFolder& folder, int count,
                                  const std::string& extension = "png") {
  std::string list = "# time file\n";
  std::filesystem::create_directory(folder.path() + "/rgb");
  for (int i = 0; i < count; ++i) {
    const std::string name = "rgb/" + std::to_string(i) + "." + extension;
    cv::imwrite(folder.path() + "/" + name, make_picture(i));
    list += "\n" + std::to_string(100 + 0.1 * i) + " " + name;
  }
  folder.write("rgb.txt", list);
  folder.write("camera.yaml",
               "model: pinhole_radtan\nwidth: 64\nheight: 48\nfx: 60\nfy: 60\ncx: 31.5\ncy: 23.5\n"
               "k1: 0\nk2: 0\np1: 0\np2: 0\nk3: 0\n");
  return folder.path();
}

}  // namespace foresight
