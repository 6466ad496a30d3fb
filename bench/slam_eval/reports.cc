#include "bench/slam_eval/reports.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <sstream>
#include <utility>

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

void print_minutes(const std::vector<Minute>& minutes) {
  if (minutes.size() < 3) return;
  std::printf("  minute  keyframes  points  map MB  track ms median, p95  job ms max  error cm\n");
  for (const Minute& m : minutes) {
    const std::string error = m.error_m_rmse < 0 ? "-" : format("%.2f", 100 * m.error_m_rmse);
    std::printf(
        "  %6d  %9d  %6d  %6.0f  %15.1f, %4.1f  %10.0f  %8s%s\n", m.minute + 1, m.keyframes,
        m.points, m.map_mb, m.track_ms_median, m.track_ms_p95, m.job_ms_max, error.c_str(),
        m.tracked < m.images ? format("  (%d images lost)", m.images - m.tracked).c_str() : "");
  }
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
  print_minutes(e.minutes);
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

void write_minutes(const std::vector<Minute>& minutes, std::ostream* file) {
  *file << ", \"minutes\": [";
  const char* separator = "";
  for (const Minute& m : minutes) {
    *file << separator << "{\"minute\": " << m.minute << ", \"images\": " << m.images
          << ", \"tracked\": " << m.tracked << ", \"keyframes\": " << m.keyframes
          << ", \"points\": " << m.points << ", \"map_mb\": " << m.map_mb
          << ", \"track_ms_median\": " << m.track_ms_median
          << ", \"track_ms_p95\": " << m.track_ms_p95 << ", \"job_ms_max\": " << m.job_ms_max
          << ", \"error_m_rmse\": " << m.error_m_rmse << "}";
    separator = ", ";
  }
  *file << "]";
}

using Figures = std::vector<std::pair<const char*, double>>;

Figures input_figures(const Evaluation& e) {
  return {
      {"frames", e.frames},
      {"refused_images", e.input.refused()},
      {"focal_px", e.focal_px},
      {"intrinsics_guessed", e.intrinsics_are_guessed ? 1 : 0},
      {"truth_images", e.truth_images},
  };
}

Figures pose_figures(const Evaluation& e) {
  return {
      {"tracked_fraction", e.tracked_fraction},
      {"first_frame", e.first_frame},
      {"init_s", e.init_s},
      {"ate_rmse_m", e.ate_rmse_m},
      {"ate_max_m", e.ate_max_m},
      {"rpe_rmse_m", e.rpe_rmse_m},
      {"rpe_rmse_deg", e.rpe_rmse_deg},
      {"wrong_by_5_cm", e.wrong_by_5_cm},
      {"wrong_by_10_cm", e.wrong_by_10_cm},
  };
}

Figures work_figures(const Evaluation& e) {
  return {
      {"track_ms_median", e.track_ms_median},
      {"track_ms_p95", e.track_ms_p95},
      {"track_ms_max", e.track_ms_max},
      {"job_ms_median", e.job_ms_median},
      {"job_ms_max", e.job_ms_max},
      {"keyframes", e.statistics.keyframes},
      {"points", e.statistics.published_points},
      {"keyframes_at_half", e.keyframes_at_half},
      {"points_at_half", e.points_at_half},
      {"track_ms_first_tenth", e.track_ms_first_tenth},
      {"track_ms_last_tenth", e.track_ms_last_tenth},
  };
}

Figures event_figures(const Evaluation& e) {
  return {
      {"losses", e.statistics.losses},
      {"relocalisations", e.statistics.relocalisations},
      {"restarts", e.statistics.restarts},
      {"loops", e.statistics.loops},
      {"focal_factor", e.statistics.focal_factor},
      {"focal_cost_ratio", e.statistics.focal_cost_ratio},
      {"disturbances", e.recovery.disturbances},
      {"returned", e.recovery.returned},
      {"returned_within_half_s", e.recovery.within_half_s},
      {"return_slowest_s", e.recovery.slowest_s},
      {"placed_in_black", e.recovery.placed_in_black},
      {"right_quality_p05", e.right_quality_p05},
      {"wrong_quality_max", e.wrong_quality_max},
  };
}

Figures depth_figures(const Evaluation& e) {
  return {
      {"depth_compared", e.depth.compared},
      {"depth_within_5_percent", e.depth.within_5_percent},
      {"depth_within_10_percent", e.depth.within_10_percent},
      {"depth_in_front_10_percent", e.depth.in_front_10_percent},
      {"depth_within_2_sigma", e.depth.within_2_sigma},
      {"transfer_px", e.transfer.px},
      {"truth_transfer_px", e.truth_transfer.px},
      {"transfer_from_fit_m", e.transfer.from_fit_m},
      {"truth_transfer_from_fit_m", e.truth_transfer.from_fit_m},
      {"peak_mb", e.peak_mb},
  };
}

std::string json_of(const Evaluation& e) {
  std::ostringstream text;
  text << "  {\"sequence\": " << json_text(e.sequence) << ", \"degradation\": \"" << e.degradation
       << "\"";
  for (const Figures& figures :
       {input_figures(e), pose_figures(e), work_figures(e), event_figures(e), depth_figures(e)}) {
    for (const auto& [key, value] : figures) text << ", \"" << key << "\": " << value;
  }
  write_bins(e.quality_bins, &text);
  write_minutes(e.minutes, &text);
  text << "}";
  return text.str();
}

}  // namespace

void write_json(const std::vector<Evaluation>& evaluations, const std::string& path) {
  if (path.empty()) return;
  std::string text = "[\n";
  for (const Evaluation& e : evaluations) {
    text += json_of(e) + (&e == &evaluations.back() ? "\n" : ",\n");
  }
  write_output(path, text + "]\n");
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
