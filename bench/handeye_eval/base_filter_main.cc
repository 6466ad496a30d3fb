// base-filter-eval [--plot FILE.png] [--json FILE] [--noise M] [--seed N]: the paper's filter of
// the base's motion and ours on synthetic motions with noise like that of our SLAM.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "bench/handeye_eval/base_filter_evaluation.h"
#include "bench/handeye_eval/line_plot.h"
#include "common/output_file.h"
#include "common/tool_main.h"

namespace foresight {
namespace {

using calibration::BaseFilterKind;

struct Row {
  BaseMotionKind motion;
  const char* filter;
  BaseFilterScore score;
};

void print(const std::vector<Row>& rows) {
  std::printf("%-12s %-8s %28s %28s %9s %17s %8s\n", "motion", "filter", "mm: median   95 %    max",
              "deg: median   95 %    max", "+0.1 s mm", "jitter mm, deg", "refused");
  for (const Row& r : rows) {
    const BaseFilterScore& s = r.score;
    std::printf("%-12s %-8s %14.2f %6.1f %6.1f %14.3f %6.2f %6.2f %9.2f %9.3f %7.4f %8d\n",
                to_string(r.motion), r.filter, s.median_mm, s.p95_mm, s.max_mm, s.median_deg,
                s.p95_deg, s.max_deg, s.ahead_median_mm, s.jitter_mm, s.jitter_deg, s.refused);
  }
}

void write_json(const std::vector<Row>& rows, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream file;
  file << "[\n";
  for (size_t i = 0; i < rows.size(); ++i) {
    const BaseFilterScore& s = rows[i].score;
    file << "  {\"motion\": \"" << to_string(rows[i].motion) << "\", \"filter\": \""
         << rows[i].filter << "\", \"median_mm\": " << s.median_mm << ", \"p95_mm\": " << s.p95_mm
         << ", \"max_mm\": " << s.max_mm << ", \"median_deg\": " << s.median_deg
         << ", \"p95_deg\": " << s.p95_deg << ", \"max_deg\": " << s.max_deg
         << ", \"ahead_median_mm\": " << s.ahead_median_mm << ", \"jitter_mm\": " << s.jitter_mm
         << ", \"jitter_deg\": " << s.jitter_deg << ", \"refused\": " << s.refused << "}"
         << (i + 1 < rows.size() ? ",\n" : "\n");
  }
  file << "]\n";
  write_output(path, file.str());
}

void write_picture(const std::string& path, const cv::Mat& picture) {
  std::vector<uint8_t> bytes;
  cv::imencode(std::filesystem::path(path).extension().string(), picture, bytes);
  write_output(path, bytes);
}

// Where the base is along its main direction of travel.
PlotPanel panel_of(BaseMotionKind kind, const std::vector<BaseFrame>& frames,
                   const BaseFilterScore& paper, const BaseFilterScore& kalman) {
  const auto along = [kind](const Pose<World, Base>& p) {
    return kind == BaseMotionKind::kPush ? -100 * p.translation().y() : 100 * p.translation().x();
  };
  Curve measured{"single frames", {200, 200, 200}, {}}, truth{"truth", {0, 0, 0}, {}};
  Curve lagging{"paper", {200, 120, 0}, {}}, ours{"kalman", {0, 90, 255}, {}};
  PlotPanel panel{std::string(to_string(kind)) + ": position of the base, cm", {}, {}};
  double low = 0, high = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    panel.times_s.push_back((frames[i].measurement.time - frames[0].measurement.time).seconds());
    measured.values.push_back(along(frames[i].measurement.world_from_base()));
    truth.values.push_back(along(frames[i].world_from_base));
    lagging.values.push_back(along(paper.estimates[i].world_from_base));
    ours.values.push_back(along(kalman.estimates[i].world_from_base));
    low = std::min(low, truth.values.back());
    high = std::max(high, truth.values.back());
  }
  const double margin = std::max(0.5, 0.15 * (high - low));
  panel.low = low - margin;
  panel.high = high + margin;
  panel.curves = {measured, truth, lagging, ours};
  return panel;
}

int run(const BaseMotionOptions& options, const std::string& plot, const std::string& json) {
  check_output("--plot", plot, kPictureExtensions);
  check_output("--json", json);
  std::vector<Row> rows;
  std::vector<PlotPanel> panels;
  for (const BaseMotionKind kind : kAllBaseMotions) {
    const auto frames = make_base_motion(kind, options);
    calibration::BaseFilterOptions paper, kalman;
    paper.kind = BaseFilterKind::kPaper;
    rows.push_back({kind, "paper", evaluate_base_filter(frames, paper)});
    rows.push_back({kind, "kalman", evaluate_base_filter(frames, kalman)});
    panels.push_back(
        panel_of(kind, frames, rows[rows.size() - 2].score, rows[rows.size() - 1].score));
  }
  print(rows);
  RunErrors errors;
  errors.attempt([&] { write_json(rows, json); });
  if (!plot.empty()) errors.attempt([&] { write_picture(plot, draw(panels)); });
  errors.report();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  CLI::App app("Compares filters of the base's motion on synthetic motions", "base-filter-eval");
  std::string plot, json;
  BaseMotionOptions options;
  options.mistrack_length_s = 1;
  app.add_option("--plot", plot, "draw truth and estimates to this image file");
  app.add_option("--json", json, "write the numbers to this file");
  app.add_option("--noise", options.noise_m, "noise of the camera's place per frame, m (3D)");
  app.add_option("--noise-deg", options.noise_deg, "noise of its orientation per frame, deg (3D)");
  app.add_option("--mistrack", options.mistrack_length_s, "length of the mistracked piece, s");
  app.add_option("--mistrack-by", options.mistrack_m, "its error, m; 0.5 deg per cm");
  app.add_option("--seed", options.seed, "of the noise");
  return tool_main(app, argc, argv, [&] {
    options.mistrack_deg = 50 * options.mistrack_m;
    return run(options, plot, json);
  });
}
