// evaluate: does the predicted view help? See scorer.h.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/evaluate/image_scores.h"
#include "bench/evaluate/scorer.h"
#include "common/errors.h"

namespace foresight {
namespace {

struct Options {
  std::vector<std::string> sequences;
  std::vector<double> delays_s{0.3};
  std::string json, csv, grid;
  int frames = 0, first_frame = 0, every = 3;
  std::vector<std::string> settings;
};

// One figure of the result, under the same name in the table, the CSV and the JSON.
struct Figure {
  std::string key;
  double value;
  int digits;
};

std::vector<Figure> figures(const EvaluationResult& r) {
  const double init = std::max(1, r.frames_after_init);
  std::vector<Figure> f{{"delay_s", r.delay_s, 2},
                        {"frames", static_cast<double>(r.frames), 0},
                        {"first_prediction_s", r.first_prediction_s, 2},
                        {"predicted_fraction", r.predicted_frames / init, 3},
                        {"scored_frames", static_cast<double>(r.scored_frames), 0},
                        {"coverage", r.coverage, 3},
                        {"measured", r.measured, 3}};
  const auto add = [&](const std::string& name, const DisplayScore& s) {
    f.push_back({"psnr_" + name + "_db", s.mean_psnr_common_db(), 2});
    f.push_back({"psnr_" + name + "_measured_db", s.mean_psnr_measured_db(), 2});
    f.push_back({"psnr_" + name + "_whole_db", s.mean_psnr_whole_db(), 2});
    f.push_back({"ssim_" + name, s.mean_ssim_common(), 3});
    f.push_back({"ssim_" + name + "_whole", s.mean_ssim_whole(), 3});
    f.push_back({"displacement_" + name + "_median_px", percentile(s.displacement_px, 0.5), 2});
    f.push_back({"displacement_" + name + "_p95_px", percentile(s.displacement_px, 0.95), 2});
  };
  add("delayed", r.delayed);
  add("homography", r.homography);
  add("predicted", r.predicted);
  f.push_back({"map_points", static_cast<double>(r.map_points), 0});
  f.push_back({"keyframes", static_cast<double>(r.keyframes), 0});
  f.push_back({"triangles", static_cast<double>(r.triangles), 0});
  return f;
}

std::string number(const Figure& f, bool json) {
  if (!std::isfinite(f.value)) return json ? "null" : "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", json && f.digits > 0 ? 6 : f.digits, f.value);
  return text;
}

std::string name_of(const EvaluationResult& r) {
  const auto path = std::filesystem::path(r.sequence).lexically_normal();
  return path.filename().empty() ? path.parent_path().filename().string()
                                 : path.filename().string();
}

void print_table(const std::vector<EvaluationResult>& results) {
  for (const EvaluationResult& r : results) {
    std::printf(
        "\n%s, delay %.2f s: %d frames, predicted view on %.1f %% of them after %.1f s; "
        "%d scored\n",
        name_of(r).c_str(), r.delay_s, r.frames,
        100.0 * r.predicted_frames / std::max(1, r.frames_after_init), r.first_prediction_s,
        r.scored_frames);
    if (r.scored_frames == 0) {
      std::printf("  there was no predicted view to score: the model needs more frames\n");
      continue;
    }
    std::printf(
        "  coverage %.1f %% of the picture (%.1f %% on measured surface); %d points, %d "
        "keyframes, %d triangles\n",
        100 * r.coverage, 100 * r.measured, r.map_points, r.keyframes, r.triangles);
    std::printf("  %-18s %9s %9s %9s %7s %7s %10s %9s\n", "against the truth", "PSNR dB",
                "measured", "whole", "SSIM", "whole", "shift px", "p95 px");
    const auto row = [](const char* name, const DisplayScore& s) {
      std::printf("  %-18s %9.2f %9.2f %9.2f %7.3f %7.3f %10.2f %9.2f\n", name,
                  s.mean_psnr_common_db(), s.mean_psnr_measured_db(), s.mean_psnr_whole_db(),
                  s.mean_ssim_common(), s.mean_ssim_whole(), percentile(s.displacement_px, 0.5),
                  percentile(s.displacement_px, 0.95));
    };
    row("delayed video", r.delayed);
    row("best homography", r.homography);
    row("predicted view", r.predicted);
  }
}

std::ofstream open_output(const std::string& path) {
  std::ofstream file(path);
  if (!file) throw UnavailableError(path + ": cannot be written");
  return file;
}

void write_json(const std::string& path, const std::vector<EvaluationResult>& results) {
  std::ofstream file = open_output(path);
  file << "[\n";
  for (size_t i = 0; i < results.size(); ++i) {
    file << "  {\"sequence\": \"" << name_of(results[i]) << "\"";
    for (const Figure& f : figures(results[i]))
      file << ", \"" << f.key << "\": " << number(f, true);
    file << "}" << (i + 1 < results.size() ? "," : "") << "\n";
  }
  file << "]\n";
}

void write_csv(const std::string& path, const std::vector<EvaluationResult>& results) {
  std::ofstream file = open_output(path);
  file << "sequence";
  for (const Figure& f : figures(results.front())) file << "," << f.key;
  file << "\n";
  for (const EvaluationResult& r : results) {
    file << name_of(r);
    for (const Figure& f : figures(r))
      file << "," << (std::isfinite(f.value) ? number(f, true) : "");
    file << "\n";
  }
}

// One picture for all results: a titled block of rows for each.
void write_grid(const std::string& path, const std::vector<EvaluationResult>& results) {
  std::vector<cv::Mat> rows;
  for (const EvaluationResult& r : results) {
    if (r.grid_rows.empty()) continue;
    cv::Mat title(28, r.grid_rows.front().cols, CV_8UC3, cv::Scalar(32, 32, 32));
    char text[160];
    std::snprintf(text, sizeof text, "%s  %.1f s", name_of(r).c_str(), r.delay_s);
    const char* columns[] = {text, "delayed", "best homography", "predicted", "error x2"};
    for (int i = 0; i < 5; ++i) {
      cv::putText(title, columns[i], {320 * i + 8, 20}, cv::FONT_HERSHEY_SIMPLEX, 0.55,
                  cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    }
    rows.push_back(title);
    rows.insert(rows.end(), r.grid_rows.begin(), r.grid_rows.end());
  }
  if (rows.empty()) return;
  int width = 0;
  for (const cv::Mat& row : rows) width = std::max(width, row.cols);
  for (cv::Mat& row : rows) cv::copyMakeBorder(row, row, 0, 0, 0, width - row.cols, 0);
  cv::Mat grid;
  cv::vconcat(rows, grid);
  cv::cvtColor(grid, grid, cv::COLOR_RGB2BGR);
  if (!cv::imwrite(path, grid)) throw UnavailableError(path + ": cannot be written");
}

void declare(CLI::App& app, Options& o) {
  app.add_option("sequence", o.sequences, "folders in TUM layout, or videos")->required();
  app.add_option("--delay", o.delays_s, "delays in s")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--frames", o.frames, "frames to use; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--first-frame", o.first_frame, "frames to skip")->check(CLI::NonNegativeNumber);
  app.add_option("--every", o.every, "score each Nth predicted frame")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--set", o.settings, "process.key=value (repeatable)")->allow_extra_args(false);
  app.add_option("--json", o.json, "write one object per sequence and delay");
  app.add_option("--csv", o.csv, "write one line per sequence and delay");
  app.add_option("--grid", o.grid, "write a PNG: truth, delayed, homography, predicted, error");
}

void check_settings(const std::vector<std::string>& settings) {
  for (const std::string& s : settings) {
    const std::string process = s.substr(0, s.find('.'));
    const bool known = process == "camera" || process == "slam" || process == "carver" ||
                       process == "mesher" || process == "link" || process == "renderer";
    if (!known || s.find('.') == std::string::npos) {
      throw UsageError("--set " + s +
                       ": must be process.key=value with process one of camera, slam, carver, "
                       "mesher, link, renderer");
    }
  }
}

int run(const Options& o) {
  check_settings(o.settings);
  std::vector<EvaluationResult> results;
  for (const std::string& sequence : o.sequences) {
    for (double delay_s : o.delays_s) {
      const RecordedLineOptions line{sequence, delay_s, o.first_frame, o.frames, o.settings};
      results.push_back(evaluate(line, {.every = o.every}, [&](int frames, int scored) {
        std::fprintf(stderr, "\r%s, delay %.2f s: frame %d, %d scored ", sequence.c_str(), delay_s,
                     frames, scored);
      }));
      std::fprintf(stderr, "\n");
    }
  }
  print_table(results);
  if (!o.json.empty()) write_json(o.json, results);
  if (!o.csv.empty()) write_csv(o.csv, results);
  if (!o.grid.empty()) write_grid(o.grid, results);
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  Options options;
  CLI::App app(
      "Runs the whole line on recorded video, deterministically, and scores the predicted view "
      "against the delayed video and the best homography.",
      "evaluate");
  declare(app, options);
  try {
    app.parse(argc, argv);
    return run(options);
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::cerr << "evaluate: " << e.what() << " (see --help)\n";
    return kExitUsage;
  } catch (const StartupError& e) {
    std::cerr << "evaluate: " << e.what() << "\n";
    return e.code();
  }
}
