#include "bench/slam_eval/reports.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <sstream>

#include "bench/slam_eval/peers.h"
#include "common/output_file.h"

namespace foresight {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

std::string recovery_text(const Recovery& r) {
  if (r.disturbances == 0) return "";
  return format("%d of %d back, %d in 0.5 s, slowest %.2f s", r.returned, r.disturbances,
                r.within_half_s, r.slowest_s);
}

std::string label(const Evaluation& e) {
  std::string text = e.degradation == "none" ? e.sequence : e.sequence + ", " + e.degradation;
  if (e.intrinsics_are_guessed) text += format(" (focal length guessed: %.0f px)", e.focal_px);
  if (e.input.refused() > 0) text += format(" (%d images refused)", e.input.refused());
  return text;
}

std::string row(const Evaluation& e) {
  const SlamStatistics& s = e.statistics;
  std::string ate = e.ate_rmse_m < 0
                        ? "no truth"
                        : format("%.2f, %.1f cm", 100 * e.ate_rmse_m, 100 * e.ate_max_m);
  std::string rpe =
      e.rpe_rmse_m < 0 ? "–" : format("%.1f cm, %.2f°", 100 * e.rpe_rmse_m, e.rpe_rmse_deg);
  std::string depth =
      e.depth.compared == 0 ? "–" : format("%.1f %%", 100 * e.depth.within_10_percent);
  std::string losses = format("%d", s.losses);
  if (e.recovery.disturbances > 0) losses += "; " + recovery_text(e.recovery);
  return format("| %s | %.1f %% | %d (%.2f s) | %s | %s | %d | %.1f, %.1f, %.0f | %.0f, %.0f | ",
                label(e).c_str(), 100 * e.tracked_fraction, e.first_frame, e.init_s, ate.c_str(),
                rpe.c_str(), e.wrong_by_5_cm, e.track_ms_median, e.track_ms_p95, e.track_ms_max,
                e.job_ms_median, e.job_ms_max) +
         format("%d, %d | %s | %.0f | %s |\n", s.keyframes, s.published_points, depth.c_str(),
                e.peak_mb, losses.c_str());
}

void print_errors(const Evaluation& e) {
  std::printf("  ATE %.2f cm (max %.1f; %d over 5 cm, %d over 10 cm)", 100 * e.ate_rmse_m,
              100 * e.ate_max_m, e.wrong_by_5_cm, e.wrong_by_10_cm);
  if (e.rpe_rmse_m >= 0) {
    std::printf(", RPE over 1 s %.2f cm, %.2f deg", 100 * e.rpe_rmse_m, e.rpe_rmse_deg);
  }
  std::printf("\n");
}

}  // namespace

void print(const Evaluation& e) {
  const SlamStatistics& s = e.statistics;
  if (e.first_frame < 0) {
    std::printf("%s: never placed in %d images\n", label(e).c_str(), e.frames);
  } else {
    std::printf("%s: tracked %.1f %% of %d, first pose frame %d (%.2f s)\n", label(e).c_str(),
                100 * e.tracked_fraction, e.frames + e.input.refused(), e.first_frame, e.init_s);
  }
  for (const std::string& line : e.input.lines()) std::printf("  %s\n", line.c_str());
  if (e.depth_input.refused() > 0) {
    std::printf("  depth: %s\n", e.depth_input.complaint().c_str());
  }
  if (e.ate_rmse_m >= 0) print_errors(e);
  std::printf(
      "  track %.1f ms median, %.1f p95, %.0f max; %d jobs %.0f ms median, %.0f max; %.0f MB\n",
      e.track_ms_median, e.track_ms_p95, e.track_ms_max, e.jobs, e.job_ms_median, e.job_ms_max,
      e.peak_mb);
  std::printf(
      "  %d keyframes, %d points (%d published), %d losses, %d relocalisations, %d restarts, "
      "%d loops\n",
      s.keyframes, s.points, s.published_points, s.losses, s.relocalisations, s.restarts, s.loops);
  if (e.degradation == "passes") {
    std::printf(
        "  from half time to the end: keyframes %d to %d, points %d to %d; track median %.1f ms in "
        "the first tenth, %.1f in the last\n",
        e.keyframes_at_half, s.keyframes, e.points_at_half, s.points, e.track_ms_first_tenth,
        e.track_ms_last_tenth);
  }
  std::printf("  quality: %.2f 5th percentile of right poses, %.2f highest of those off by 10 cm\n",
              e.right_quality_p05, e.wrong_quality_max);
  for (const QualityBin& b : e.quality_bins) {
    if (b.images == 0) continue;
    std::printf(
        "    quality %.1f to %.1f: %d images, off by %.1f cm median, %.1f cm 95 %%, %d by > 5 cm\n",
        b.from, std::min(1.0, b.to), b.images, 100 * b.error_m_median, 100 * b.error_m_p95,
        b.wrong_by_5_cm);
  }
  std::printf("  focal length as it fits best / as given: %.3f, cost ratio %.2f%s%s\n",
              s.focal_factor, s.focal_cost_ratio, e.warning.empty() ? "" : "; ", e.warning.c_str());
  if (e.recovery.disturbances > 0) {
    std::printf("  recovery: %s; %d poses in black images\n", recovery_text(e.recovery).c_str(),
                e.recovery.placed_in_black);
  }
  if (e.depth.compared == 0) return;
  std::printf(
      "  depth of %d points: median error %.2f %%, %.1f %% within 5 %%, %.1f %% within 10 %%, "
      "%.1f %% float more than 10 %% in front, %.1f %% within 2 of their sigmas\n",
      e.depth.compared, e.depth.median_error_percent, 100 * e.depth.within_5_percent,
      100 * e.depth.within_10_percent, 100 * e.depth.in_front_10_percent,
      100 * e.depth.within_2_sigma);
  if (e.transfer.pairs == 0) return;
  std::printf("  over 0.5 s, against the pose that fits %d depth images best:\n", e.transfer.pairs);
  const auto print_transfer = [](const char* whose, const DepthTransfer& t) {
    std::printf("    %s: %.2f px, %.1f mm, %.2f deg\n", whose, t.px, 1e3 * t.from_fit_m,
                t.from_fit_deg);
  };
  print_transfer("ours", e.transfer);
  print_transfer("the truth", e.truth_transfer);
}

namespace {

void write_bins(const std::vector<QualityBin>& bins, std::ostream* file) {
  *file << ", \"quality_bins\": [";
  for (size_t b = 0; b < bins.size(); ++b) {
    *file << (b > 0 ? ", " : "") << "{\"from\": " << bins[b].from
          << ", \"images\": " << bins[b].images
          << ", \"error_m_median\": " << bins[b].error_m_median
          << ", \"error_m_p95\": " << bins[b].error_m_p95
          << ", \"wrong_by_5_cm\": " << bins[b].wrong_by_5_cm << "}";
  }
  *file << "]";
}

}  // namespace

void write_json(const std::vector<Evaluation>& evaluations, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream file;
  file << "[\n";
  for (size_t i = 0; i < evaluations.size(); ++i) {
    const Evaluation& e = evaluations[i];
    const auto add = [&](const char* key, double value) {
      file << ", \"" << key << "\": " << value;
    };
    file << "  {\"sequence\": " << json_text(e.sequence) << ", \"degradation\": \"" << e.degradation
         << "\"";
    add("frames", e.frames);
    add("refused_images", e.input.refused());
    add("focal_px", e.focal_px);
    add("intrinsics_guessed", e.intrinsics_are_guessed ? 1 : 0);
    add("truth_images", e.truth_images);
    add("tracked_fraction", e.tracked_fraction);
    add("first_frame", e.first_frame);
    add("init_s", e.init_s);
    add("ate_rmse_m", e.ate_rmse_m);
    add("ate_max_m", e.ate_max_m);
    add("rpe_rmse_m", e.rpe_rmse_m);
    add("rpe_rmse_deg", e.rpe_rmse_deg);
    add("wrong_by_5_cm", e.wrong_by_5_cm);
    add("wrong_by_10_cm", e.wrong_by_10_cm);
    add("track_ms_median", e.track_ms_median);
    add("track_ms_p95", e.track_ms_p95);
    add("track_ms_max", e.track_ms_max);
    add("job_ms_median", e.job_ms_median);
    add("job_ms_max", e.job_ms_max);
    add("keyframes", e.statistics.keyframes);
    add("points", e.statistics.published_points);
    add("keyframes_at_half", e.keyframes_at_half);
    add("points_at_half", e.points_at_half);
    add("track_ms_first_tenth", e.track_ms_first_tenth);
    add("track_ms_last_tenth", e.track_ms_last_tenth);
    add("losses", e.statistics.losses);
    add("relocalisations", e.statistics.relocalisations);
    add("restarts", e.statistics.restarts);
    add("loops", e.statistics.loops);
    add("focal_factor", e.statistics.focal_factor);
    add("focal_cost_ratio", e.statistics.focal_cost_ratio);
    add("disturbances", e.recovery.disturbances);
    add("returned", e.recovery.returned);
    add("returned_within_half_s", e.recovery.within_half_s);
    add("return_slowest_s", e.recovery.slowest_s);
    add("placed_in_black", e.recovery.placed_in_black);
    add("right_quality_p05", e.right_quality_p05);
    add("wrong_quality_max", e.wrong_quality_max);
    add("depth_compared", e.depth.compared);
    add("depth_within_5_percent", e.depth.within_5_percent);
    add("depth_within_10_percent", e.depth.within_10_percent);
    add("depth_in_front_10_percent", e.depth.in_front_10_percent);
    add("depth_within_2_sigma", e.depth.within_2_sigma);
    add("transfer_px", e.transfer.px);
    add("truth_transfer_px", e.truth_transfer.px);
    add("transfer_from_fit_m", e.transfer.from_fit_m);
    add("truth_transfer_from_fit_m", e.truth_transfer.from_fit_m);
    add("peak_mb", e.peak_mb);
    write_bins(e.quality_bins, &file);
    file << "}" << (i + 1 < evaluations.size() ? ",\n" : "\n");
  }
  file << "]\n";
  write_output(path, file.str());
}

void write_table(const std::vector<Evaluation>& evaluations, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream file;
  file
      << "| sequence | tracked | first pose, frame | ATE rmse, max | RPE over 1 s | off by > 5 cm "
         "| "
         "track ms median, p95, max | job ms median, max | keyframes, points | depth within 10 % | "
         "MB | losses |\n"
      << "|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const Evaluation& e : evaluations) {
    file << row(e);
    if (e.degradation != "none") continue;
    for (const PeerResult& p : peers_on(e.sequence)) {
      file << "| *" << p.system << "* | " << p.tracked << " | " << p.first_frame << " | " << p.ate
           << " | | | " << p.track_ms << " | | " << p.points << " points | | | |\n";
    }
  }
  write_output(path, file.str());
}

}  // namespace foresight
