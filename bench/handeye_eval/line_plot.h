// Curves over time as an image: one panel below the other, each with its legend and ruler.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace foresight {

struct Curve {
  std::string name;
  cv::Scalar color;  // BGR
  std::vector<double> values;
};

struct PlotPanel {
  std::string title;  // with the unit
  std::vector<double> times_s;
  std::vector<Curve> curves;  // as long as times_s
  double low = 0, high = 0;   // equal: fitted to the curves
};

cv::Mat draw(const std::vector<PlotPanel>& panels);

}  // namespace foresight
