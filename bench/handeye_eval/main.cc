// handeye-eval FOLDER… [--json FILE] [--step N]: our alignment with its refinement of the camera's
// place, and OpenCV's hand-eye calibrations, on recorded data; see handeye_data.h.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <sstream>

#include "bench/handeye_eval/handeye_evaluation.h"
#include "common/output_file.h"
#include "common/tool_main.h"
#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

void print(const HandEyeEvaluation& e) {
  const calibration::AlignmentSolution& s = e.solution;
  std::printf("%s: %d views; ours %s%s\n", e.dataset.c_str(), e.views,
              s.reason.empty() ? "accepted" : "refused: ", s.reason.c_str());
  std::printf("  %d agree, each to %.1f mm %.2f deg; sigma: scale %.2f %%, camera %.2f mm %.3f deg",
              s.inliers, 1e3 * s.pair_position_error_m,
              s.pair_rotation_error_rad / calibration::kDegree, 100 * s.scale_sigma,
              1e3 * s.ee_from_cam_position_sigma_m,
              s.ee_from_cam_rotation_sigma_rad / calibration::kDegree);
  if (s.delay_is_estimated) std::printf(", delay %.2f ms", 1e3 * s.delay_sigma_s);
  std::printf("\n  %-22s %26s %18s %18s %9s %9s\n", "method", "px: median   90 %  worst",
              "mm: median   90 %", "reference mm, deg", "scale %", "delay ms");
  for (const HandEyeScore& r : e.scores) {
    const HandEyeAnswer& a = r.answer;
    std::printf("  %-22s", a.method.c_str());
    if (e.has_corners) {
      std::printf(" %11.2f %6.2f %6.2f", r.median_px, r.p90_px, r.worst_view_px);
    } else {
      std::printf(" %11s %6s %6s", "-", "-", "-");
    }
    std::printf(" %11.2f %6.2f", r.median_mm, r.p90_mm);
    if (e.has_reference) {
      std::printf(" %11.2f %6.2f", r.camera_shift_mm, r.camera_turn_deg);
    } else {
      std::printf(" %11s %6s", "-", "-");
    }
    if (a.has_scale) {
      std::printf(" %+9.2f", 100 * (a.base_from_target.scale() - 1));
    } else {
      std::printf(" %9s", "given");
    }
    std::printf(" %+9.1f\n", 1e3 * a.joint_delay_s);
  }
}

void write_json(const std::vector<HandEyeEvaluation>& evaluations, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream file;
  file << "[\n";
  for (size_t i = 0; i < evaluations.size(); ++i) {
    const HandEyeEvaluation& e = evaluations[i];
    file << "  {\"dataset\": \"" << e.dataset << "\", \"views\": " << e.views
         << ", \"accepted\": " << (e.solution.reason.empty() ? "true" : "false")
         << ", \"reason\": \"" << e.solution.reason << "\", \"methods\": [\n";
    for (size_t k = 0; k < e.scores.size(); ++k) {
      const HandEyeScore& r = e.scores[k];
      file << "    {\"method\": \"" << r.answer.method << "\", \"median_px\": " << r.median_px
           << ", \"p90_px\": " << r.p90_px << ", \"worst_view_px\": " << r.worst_view_px
           << ", \"median_mm\": " << r.median_mm << ", \"p90_mm\": " << r.p90_mm
           << ", \"camera_shift_mm\": " << r.camera_shift_mm
           << ", \"camera_turn_deg\": " << r.camera_turn_deg
           << ", \"scale\": " << r.answer.base_from_target.scale()
           << ", \"joint_delay_s\": " << r.answer.joint_delay_s << "}"
           << (k + 1 < e.scores.size() ? ",\n" : "\n");
    }
    file << "  ]}" << (i + 1 < evaluations.size() ? ",\n" : "\n");
  }
  file << "]\n";
  write_output(path, file.str());
}

int run(const std::vector<std::string>& folders, int step, const std::string& json) {
  check_output("--json", json);
  RunErrors errors;
  std::vector<HandEyeEvaluation> evaluations;
  for (const std::string& folder : folders) {
    errors.attempt([&] {
      evaluations.push_back(evaluate_handeye(load_handeye(folder, step)));
      print(evaluations.back());
    });
  }
  errors.attempt([&] { write_json(evaluations, json); });
  errors.report();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  CLI::App app("Compares our alignment with OpenCV's hand-eye calibrations on recorded data",
               "handeye-eval");
  std::vector<std::string> folders;
  std::string json;
  int step = 4;
  app.add_option("folder", folders, "folders with robot poses and target corners, or with a log")
      ->required();
  app.add_option("--json", json, "write the numbers to this file");
  app.add_option("--step", step, "take every so many poses of a log")->check(CLI::PositiveNumber);
  return foresight::tool_main(app, argc, argv, [&] { return foresight::run(folders, step, json); });
}
