#include "bench/handeye_eval/line_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace foresight {
namespace {

constexpr int kWidth_px = 1100, kHeight_px = 240;
constexpr int kLeft_px = 60, kRight_px = 15, kTop_px = 26, kBottom_px = 22;
const cv::Scalar kInk(60, 60, 60), kGrid(225, 225, 225);

void write(cv::Mat& image, const std::string& text, cv::Point at, const cv::Scalar& color) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, color, 1, cv::LINE_AA);
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", std::abs(value) < 1e-12 ? 0 : value);
  return text;
}

// 1, 2 or 5 times a power of ten, so that about `count` steps fit.
double step_for(double span, double count) {
  const double power = std::pow(10, std::floor(std::log10(span / count)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (span / (factor * power) <= count) return factor * power;
  }
  return 10 * power;
}

struct Axes {
  double t0, t1, low, high;
  cv::Point at(double t, double value) const {
    const double x = (t - t0) / (t1 - t0), y = (value - low) / (high - low);
    return {kLeft_px + static_cast<int>(std::lround(x * (kWidth_px - kLeft_px - kRight_px))),
            kHeight_px - kBottom_px -
                static_cast<int>(
                    std::lround(std::clamp(y, -0.05, 1.05) * (kHeight_px - kTop_px - kBottom_px)))};
  }
};

Axes axes_of(const PlotPanel& panel) {
  Axes axes{panel.times_s.front(), panel.times_s.back(), panel.low, panel.high};
  if (axes.low >= axes.high) {
    axes.low = axes.high = panel.curves.front().values.front();
    for (const Curve& c : panel.curves) {
      const auto [low, high] = std::minmax_element(c.values.begin(), c.values.end());
      axes.low = std::min(axes.low, *low);
      axes.high = std::max(axes.high, *high);
    }
    const double margin = std::max(1e-9, 0.05 * (axes.high - axes.low));
    axes.low -= margin;
    axes.high += margin;
  }
  return axes;
}

void draw_rulers(const Axes& axes, cv::Mat& image) {
  const double step = step_for(axes.high - axes.low, 5);
  for (double v = std::ceil(axes.low / step) * step; v <= axes.high; v += step) {
    cv::line(image, axes.at(axes.t0, v), axes.at(axes.t1, v), kGrid);
    write(image, number(v), axes.at(axes.t0, v) + cv::Point(-kLeft_px + 6, 4), kInk);
  }
  const double step_s = step_for(axes.t1 - axes.t0, 10);
  for (double t = std::ceil(axes.t0 / step_s) * step_s; t <= axes.t1; t += step_s) {
    cv::line(image, axes.at(t, axes.low), axes.at(t, axes.high), kGrid);
    write(image, number(t) + " s", axes.at(t, axes.low) + cv::Point(-10, 16), kInk);
  }
}

cv::Mat draw(const PlotPanel& panel) {
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar::all(255));
  const Axes axes = axes_of(panel);
  draw_rulers(axes, image);
  write(image, panel.title, {kLeft_px, 16}, kInk);
  int legend_px = kWidth_px - kRight_px;
  for (auto c = panel.curves.rbegin(); c != panel.curves.rend(); ++c) {
    legend_px -= 12 + cv::getTextSize(c->name, cv::FONT_HERSHEY_SIMPLEX, 0.42, 1, nullptr).width;
    write(image, c->name, {legend_px, 16}, c->color);
  }
  for (const Curve& c : panel.curves) {
    for (size_t i = 1; i < panel.times_s.size(); ++i) {
      cv::line(image, axes.at(panel.times_s[i - 1], c.values[i - 1]),
               axes.at(panel.times_s[i], c.values[i]), c.color, 1, cv::LINE_AA);
    }
  }
  return image;
}

}  // namespace

cv::Mat draw(const std::vector<PlotPanel>& panels) {
  cv::Mat image;
  for (const PlotPanel& p : panels) image.push_back(draw(p));
  return image;
}

}  // namespace foresight
