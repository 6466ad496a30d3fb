#include "bench/evaluate/figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "bench/evaluate/image_scores.h"
#include "common/output_file.h"

namespace foresight {
namespace {

std::string number(const Figure& f, bool json) {
  if (!std::isfinite(f.value)) return json ? "null" : "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", json && f.digits > 0 ? 6 : f.digits, f.value);
  return text;
}

std::string name_of(const std::string& sequence) {
  const auto path = std::filesystem::path(sequence).lexically_normal();
  return path.filename().empty() ? path.parent_path().filename().string()
                                 : path.filename().string();
}

// As a field of a CSV file.
std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

void add_pictures(const PictureScores& r, std::vector<Figure>* figures) {
  figures->push_back({"scored_frames", static_cast<double>(r.scored_frames), 0});
  figures->push_back({"truth_share", r.truth_share, 3});
  figures->push_back({"coverage", r.coverage, 3});
  figures->push_back({"measured", r.measured, 3});
  const auto add = [&](const std::string& name, const DisplayScore& s) {
    figures->push_back({"psnr_" + name + "_db", s.mean_psnr_common_db(), 2});
    figures->push_back({"psnr_" + name + "_measured_db", s.mean_psnr_measured_db(), 2});
    figures->push_back({"psnr_" + name + "_whole_db", s.mean_psnr_whole_db(), 2});
    figures->push_back({"ssim_" + name, s.mean_ssim_common(), 3});
    figures->push_back({"ssim_" + name + "_whole", s.mean_ssim_whole(), 3});
    figures->push_back(
        {"displacement_" + name + "_median_px", percentile(s.displacement_px, 0.5), 2});
    figures->push_back(
        {"displacement_" + name + "_p95_px", percentile(s.displacement_px, 0.95), 2});
  };
  add("delayed", r.delayed);
  add("homography", r.homography);
  add("predicted", r.predicted);
}

template <class Member>
double at(const std::vector<PoseError>& errors, Member member, double p) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const PoseError& e : errors) values.push_back(e.*member);
  return percentile(std::move(values), p);
}

void add_errors(const std::string& name, const std::vector<PoseError>& errors, bool with_shift,
                std::vector<Figure>* figures) {
  for (const auto& [suffix, p] : {std::pair{"median", 0.5}, {"p95", 0.95}}) {
    const std::string end = std::string("_") + suffix;
    figures->push_back({name + end + "_mm", at(errors, &PoseError::position_mm, p), 2});
    figures->push_back({name + end + "_deg", at(errors, &PoseError::angle_deg, p), 3});
    if (with_shift)
      figures->push_back({name + end + "_px", at(errors, &PoseError::shift_px, p), 2});
  }
}

void print_pictures(const PictureScores& r) {
  std::printf("  %-18s %9s %9s %9s %7s %7s %10s %9s\n", "against the truth", "PSNR dB", "measured",
              "whole", "SSIM", "whole", "shift px", "p95 px");
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

void write_errors(const std::string& path, const std::vector<PoseError>& errors) {
  std::ostringstream file;
  file << "time_s,position_mm,angle_deg,shift_px\n";
  for (const PoseError& e : errors) {
    file << e.time_s << "," << e.position_mm << "," << e.angle_deg << "," << e.shift_px << "\n";
  }
  write_output(path, file.str());
}

}  // namespace

Report report_of(const EvaluationResult& r) {
  const double after_init = std::max(1, r.frames_after_init);
  Report report{name_of(r.sequence), r.delay_s, {}, r.grid_rows};
  report.figures = {{"delay_s", r.delay_s, 2},
                    {"frames", static_cast<double>(r.frames), 0},
                    {"refused_images", static_cast<double>(r.input.refused()), 0},
                    {"focal_px", r.focal_px, 1},
                    {"intrinsics_guessed", r.intrinsics_are_guessed ? 1.0 : 0.0, 0},
                    {"first_prediction_s", r.first_prediction_s, 2},
                    {"predicted_fraction", r.predicted_frames / after_init, 3}};
  add_pictures(r, &report.figures);
  report.figures.push_back({"map_points", static_cast<double>(r.map_points), 0});
  report.figures.push_back({"keyframes", static_cast<double>(r.keyframes), 0});
  report.figures.push_back({"triangles", static_cast<double>(r.triangles), 0});
  return report;
}

Report report_of(const ClosedLoopResult& r) {
  Report report{r.name, r.delay_s, {}, r.grid_rows};
  const double drawn = std::max(1, r.drawn_frames);
  report.figures = {{"delay_s", r.delay_s, 2},
                    {"seconds", r.seconds, 1},
                    {"first_aligned_s", r.first_aligned_s, 2},
                    {"first_prediction_s", r.first_prediction_s, 2},
                    {"predicted_frames", static_cast<double>(r.predicted_frames), 0},
                    {"predicted_fraction", r.predicted_frames / drawn, 3}};
  add_errors("prediction", r.predictions, true, &report.figures);
  add_errors("command", r.commands, true, &report.figures);
  add_errors("alignment", r.alignment, false, &report.figures);
  add_errors("base", r.base, false, &report.figures);
  report.figures.push_back({"scale_error", r.scale_error, 5});
  report.figures.push_back({"tracked_share", r.tracked_share, 3});
  report.figures.push_back({"max_camera_speed_m_per_s", r.max_camera_speed_m_per_s, 3});
  report.figures.push_back({"controller_faults", static_cast<double>(r.controller_faults), 0});
  add_pictures(r, &report.figures);
  report.figures.push_back({"map_points", static_cast<double>(r.map_points), 0});
  report.figures.push_back({"keyframes", static_cast<double>(r.keyframes), 0});
  report.figures.push_back({"triangles", static_cast<double>(r.triangles), 0});
  return report;
}

void print_table(const EvaluationResult& r) {
  std::printf(
      "\n%s, delay %.2f s: %d frames, predicted view on %.1f %% of them after %.1f s; %d scored\n",
      name_of(r.sequence).c_str(), r.delay_s, r.frames,
      100.0 * r.predicted_frames / std::max(1, r.frames_after_init), r.first_prediction_s,
      r.scored_frames);
  for (const std::string& line : r.input.lines()) std::printf("  %s\n", line.c_str());
  if (r.scored_frames == 0) {
    std::printf("  there was no predicted view to score: the model needs more frames\n");
    return;
  }
  std::printf(
      "  coverage %.1f %% of the picture (%.1f %% on measured surface); %d points, %d keyframes, "
      "%d triangles\n",
      100 * r.coverage, 100 * r.measured, r.map_points, r.keyframes, r.triangles);
  print_pictures(r);
}

void print_table(const ClosedLoopResult& r) {
  std::printf(
      "\n%s, delay %.2f s there and back, %.0f s: aligned after %.1f s, %d predicted views\n",
      r.name.c_str(), r.delay_s, r.seconds, r.first_aligned_s, r.predicted_frames);
  if (r.predicted_frames == 0) {
    std::printf("  there was no predicted view to score\n");
    return;
  }
  std::printf("  %-34s %8s %8s %8s %8s %8s %8s\n", "errors against the truth", "mm", "p95", "deg",
              "p95", "px", "p95");
  const auto row = [](const char* name, const std::vector<PoseError>& e, bool with_shift) {
    std::printf("  %-34s %8.2f %8.2f %8.3f %8.3f", name, at(e, &PoseError::position_mm, 0.5),
                at(e, &PoseError::position_mm, 0.95), at(e, &PoseError::angle_deg, 0.5),
                at(e, &PoseError::angle_deg, 0.95));
    if (with_shift) {
      std::printf(" %8.2f %8.2f", at(e, &PoseError::shift_px, 0.5),
                  at(e, &PoseError::shift_px, 0.95));
    }
    std::printf("\n");
  };
  row("predicted camera", r.predictions, true);
  row("commanded joints, true base", r.commands, true);
  row("tracked camera in the world", r.alignment, false);
  row("base", r.base, false);
  std::printf(
      "  scale error %.2f %%; tracked %.1f %%; camera up to %.2f m/s; %d controller faults; "
      "%d points, %d keyframes, %d triangles\n",
      100 * r.scale_error, 100 * r.tracked_share, r.max_camera_speed_m_per_s, r.controller_faults,
      r.map_points, r.keyframes, r.triangles);
  std::printf("  coverage %.1f %% of the picture (%.1f %% on measured surface)\n", 100 * r.coverage,
              100 * r.measured);
  print_pictures(r);
}

void write_json(const std::string& path, const std::vector<Report>& reports) {
  if (path.empty()) return;
  std::ostringstream file;
  file << "[\n";
  for (size_t i = 0; i < reports.size(); ++i) {
    file << "  {\"sequence\": " << json_text(reports[i].name);
    for (const Figure& f : reports[i].figures) {
      file << ", \"" << f.key << "\": " << number(f, true);
    }
    file << "}" << (i + 1 < reports.size() ? "," : "") << "\n";
  }
  file << "]\n";
  write_output(path, file.str());
}

void write_csv(const std::string& path, const std::vector<Report>& reports) {
  if (path.empty() || reports.empty()) return;
  std::ostringstream file;
  file << "sequence";
  for (const Figure& f : reports.front().figures) file << "," << f.key;
  file << "\n";
  for (const Report& r : reports) {
    file << csv_text(r.name);
    for (const Figure& f : r.figures) {
      file << "," << (std::isfinite(f.value) ? number(f, true) : "");
    }
    file << "\n";
  }
  write_output(path, file.str());
}

// One picture for all results: a titled block of rows for each.
void write_grid(const std::string& path, const std::vector<Report>& reports) {
  std::vector<cv::Mat> rows;
  for (const Report& r : reports) {
    if (r.grid_rows.empty()) continue;
    cv::Mat title(28, r.grid_rows.front().cols, CV_8UC3, cv::Scalar(32, 32, 32));
    char text[160];
    std::snprintf(text, sizeof text, "%s  %.1f s", r.name.c_str(), r.delay_s);
    const char* columns[] = {text, "delayed", "best homography", "predicted", "error x2"};
    for (int i = 0; i < 5; ++i) {
      cv::putText(title, columns[i], {320 * i + 8, 20}, cv::FONT_HERSHEY_SIMPLEX, 0.55,
                  cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
    }
    rows.push_back(title);
    rows.insert(rows.end(), r.grid_rows.begin(), r.grid_rows.end());
  }
  if (path.empty() || rows.empty()) return;
  int width = 0;
  for (const cv::Mat& row : rows) width = std::max(width, row.cols);
  for (cv::Mat& row : rows) cv::copyMakeBorder(row, row, 0, 0, 0, width - row.cols, 0);
  cv::Mat grid;
  cv::vconcat(rows, grid);
  cv::cvtColor(grid, grid, cv::COLOR_RGB2BGR);
  std::vector<uint8_t> bytes;
  cv::imencode(std::filesystem::path(path).extension().string(), grid, bytes);
  write_output(path, bytes);
}

void write_series(const std::string& folder, const ClosedLoopResult& r) {
  check_output_folder("series", folder);
  write_errors(folder + "/predictions.csv", r.predictions);
  write_errors(folder + "/commands.csv", r.commands);
  write_errors(folder + "/alignment.csv", r.alignment);
  std::ostringstream file;
  file << "time_s,true_x_m,true_y_m,true_z_m,true_yaw_deg,x_m,y_m,z_m,yaw_deg,position_mm,"
          "angle_deg\n";
  for (size_t i = 0; i < r.base_path.size(); ++i) {
    const BaseSample& b = r.base_path[i];
    file << b.time_s << "," << b.true_m[0] << "," << b.true_m[1] << "," << b.true_m[2] << ","
         << b.true_yaw_deg << "," << b.estimated_m[0] << "," << b.estimated_m[1] << ","
         << b.estimated_m[2] << "," << b.estimated_yaw_deg << "," << r.base[i].position_mm << ","
         << r.base[i].angle_deg << "\n";
  }
  write_output(folder + "/base.csv", file.str());
}

}  // namespace foresight
