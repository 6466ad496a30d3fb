// calibrate-camera: intrinsics and lens distortion from a video of a chessboard or of a grid of
// AprilTags. scripts/calibrate_camera builds and runs it.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "common/output_file.h"
#include "common/tool_main.h"
#include "procs/camera/camera_choice.h"
#include "procs/camera/frame_source.h"
#include "procs/camera/input_report.h"
#include "procs/camera/lens_calibration.h"

namespace foresight {
namespace {

struct Options {
  std::string source, output = "camera.yaml", picture, board = "chessboard", lens = "radtan";
  CalibrationBoard target;
  int every = 3, max_views = 60, max_frames = 3000;
  bool overwrite = false;
};

const std::map<std::string, CalibrationBoard::Kind> kBoards = {
    {"chessboard", CalibrationBoard::Kind::kChessboard},
    {"apriltags", CalibrationBoard::Kind::kAprilTags}};
const std::map<std::string, LensModel> kLenses = {{"radtan", LensModel::kRadtan},
                                                  {"fisheye", LensModel::kEquidistant}};

constexpr double kHopeless_px = 3;  // rms on views held out: nothing is written

cv::Mat gray_of(const Picture& picture) {
  return cv::Mat(picture.image.height_px, picture.image.width_px, CV_8UC(picture.image.channels),
                 const_cast<uint8_t*>(picture.image.bytes.data()))  // cv::Mat has no const view
      .clone();
}

// Left: all corners kept; right: the last view without its distortion, where lines must be
// straight.
void draw(const ViewCollector& collector, const Calibration& calibration, const cv::Mat& sample,
          const std::string& file) {
  cv::Mat corners(sample.size(), CV_8UC3, cv::Scalar::all(255)), straight, colour;
  for (const BoardView& v : collector.views()) {
    for (const cv::Point2f& p : v.pixels) {
      cv::circle(corners, p, 2, cv::Scalar(200, 80, 0), cv::FILLED, cv::LINE_AA);
    }
  }
  const CameraModel& c = calibration.camera;
  const cv::Matx33d matrix(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  const size_t count = c.lens == LensModel::kEquidistant ? 4 : 5;
  const std::vector<double> distortion(c.distortion.begin(), c.distortion.begin() + count);
  if (c.lens == LensModel::kEquidistant) {
    cv::fisheye::undistortImage(sample, straight, matrix, distortion, matrix);
  } else {
    cv::undistort(sample, straight, matrix, distortion);
  }
  cv::cvtColor(straight, colour, cv::COLOR_GRAY2BGR);
  cv::hconcat(corners, colour, corners);
  std::vector<uint8_t> bytes;
  cv::imencode(std::filesystem::path(file).extension().string(), corners, bytes);
  write_output(file, bytes);
}

void say_how_good(const Calibration& c, const ViewCollector& collector) {
  std::printf("%.2f px rms over %d views (%d dropped), %.2f px over %d others\n", c.rms_px, c.views,
              c.dropped_views, c.held_out_rms_px, c.held_out_views);
  std::printf("focal length %.1f, %.1f px", c.camera.fx_px, c.camera.fy_px);
  if (c.focal_sigma > 0) std::printf(" (+- %.2f %%)", 100 * c.focal_sigma);
  std::printf(", centre %.1f, %.1f px; corners in %.0f %% of the image\n", c.camera.cx_px,
              c.camera.cy_px, 100 * collector.coverage());
  if (c.held_out_rms_px > 1) {
    std::printf("over 1 px: is the board flat, the picture sharp, the board's size right?\n");
  }
  if (c.focal_sigma > 0.005) std::printf("tilt the board more: the focal length is not sure\n");
  if (collector.coverage() < 0.8) {
    std::printf("hold the board into %s corner too\n", collector.emptiest_part().c_str());
  }
}

struct Footage {
  std::optional<ViewCollector> collector;  // of the first image's size
  cv::Mat sample;                          // the last image with a view that was kept
  int frames = 0, found = 0;
  InputReport report;

  int kept() const { return collector ? static_cast<int>(collector->views().size()) : 0; }
};

void look_at(const Frame& frame, const CalibrationBoard& board, Footage* footage) {
  Picture picture = picture_of(frame, 1);
  if (picture.error.empty() && footage->collector && !footage->sample.empty() &&
      (picture.image.width_px != footage->sample.cols ||
       picture.image.height_px != footage->sample.rows)) {
    picture.error = wrong_size(picture.image, footage->sample.cols, footage->sample.rows);
  }
  if (!picture.error.empty()) return footage->report.refuse(frame.name, picture.error);
  footage->report.use();
  if (!picture.warning.empty()) footage->report.warn(frame.name, picture.warning);
  const cv::Mat gray = gray_of(picture);
  if (!footage->collector) {
    footage->collector.emplace(gray.cols, gray.rows);
    footage->sample = gray;
  }
  if (auto view = find_board(gray, board)) {
    ++footage->found;
    if (footage->collector->add(std::move(*view))) footage->sample = gray;
  }
}

Footage collect(const Options& options, const CalibrationBoard& board) {
  const std::unique_ptr<FrameSource> source = open_frame_source(options.source);
  Footage footage;
  footage.report.note(source->note());
  while (footage.kept() < options.max_views && footage.frames < options.max_frames) {
    const auto frame = source->next();
    if (!frame) {
      if (!source->error().empty()) throw UnavailableError(source->error());
      footage.report.end(source->shortfall());
      break;
    }
    if (footage.frames++ % options.every != 0) continue;
    look_at(*frame, board, &footage);
    if (footage.frames % 30 < options.every) {
      std::fprintf(stderr, "calibrate-camera: %d frames, board in %d, %d views kept\n",
                   footage.frames, footage.found, footage.kept());
    }
  }
  if (footage.report.used() == 0) {
    throw UnavailableError(options.source + ": no image: " + footage.report.complaint());
  }
  if (footage.found == 0) {
    throw UnavailableError("no board in " + std::to_string(footage.report.used()) +
                           " frames: --columns and --rows count the inner corners of a chessboard, "
                           "or the tags of a grid");
  }
  return footage;
}

int calibrate(const Options& options) {
  CalibrationBoard board = options.target;
  board.kind = kBoards.at(options.board);
  if (board.kind == CalibrationBoard::Kind::kChessboard &&
      std::min(board.columns, board.rows) < 3) {
    throw UsageError("a chessboard needs at least 3 x 3 inner corners");
  }
  if (std::filesystem::exists(options.output) && !options.overwrite) {
    throw UsageError(options.output + " exists: --overwrite replaces it");
  }
  check_output("--output", options.output);
  check_output("--picture", options.picture, kPictureExtensions);
  const Footage footage = collect(options, board);
  for (const std::string& line : footage.report.lines()) std::printf("%s\n", line.c_str());
  const Calibration calibration = calibrate_lens(footage.collector->views(), footage.sample.cols,
                                                 footage.sample.rows, kLenses.at(options.lens));
  if (!(calibration.held_out_rms_px <= kHopeless_px)) {
    char rms[32];
    std::snprintf(rms, sizeof rms, "%.1f px", calibration.held_out_rms_px);
    throw UnavailableError("no lens fits the views (" + std::string(rms) +
                           " on those held out): are "
                           "--columns, --rows, --size and --gap those of the board, is it flat?");
  }
  say_how_good(calibration, *footage.collector);
  RunErrors errors;
  errors.attempt([&] {
    write_output(options.output, camera_file_text(calibration));
    std::printf("wrote %s\n", options.output.c_str());
  });
  if (!options.picture.empty()) {
    errors.attempt([&] { draw(*footage.collector, calibration, footage.sample, options.picture); });
  }
  if (!footage.report.complete()) errors.add(options.source + ": " + footage.report.complaint());
  errors.report();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  Options o;
  CLI::App app(
      "Intrinsics and lens distortion from a video of a chessboard (9 x 6 inner corners unless "
      "said otherwise) or of a grid of AprilTags (family 36h11, ids from 0 in rows). Film it flat "
      "and sharp, tilted, near and far, in every corner of the picture.",
      "calibrate-camera");
  app.add_option("source", o.source, "a video, a folder in TUM layout, or a device (/dev/video0)")
      ->required();
  app.add_option("--output", o.output, "the camera file")->capture_default_str();
  app.add_flag("--overwrite", o.overwrite, "replace the camera file if it exists");
  app.add_option("--picture", o.picture, "draw the corners and an undistorted view (PNG)");
  app.add_option("--board", o.board, "the target")
      ->check(CLI::IsMember(&kBoards))
      ->capture_default_str();
  app.add_option("--columns", o.target.columns, "inner corners or tags in a row")
      ->check(CLI::Range(2, 100))
      ->capture_default_str();
  app.add_option("--rows", o.target.rows, "rows of them")
      ->check(CLI::Range(2, 100))
      ->capture_default_str();
  app.add_option("--size", o.target.spacing_m, "side of a square or tag, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--gap", o.target.gap_m, "between tags, m")->check(CLI::NonNegativeNumber);
  app.add_option("--lens", o.lens, "radtan (k1 k2 p1 p2 k3) or fisheye (equidistant, k1 … k4)")
      ->check(CLI::IsMember(&kLenses))
      ->capture_default_str();
  app.add_option("--every", o.every, "look at every so many frames")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--views", o.max_views, "enough views")->check(CLI::Range(8, 500));
  app.add_option("--frames", o.max_frames, "stop after so many frames (a device never ends)")
      ->check(CLI::PositiveNumber);
  return tool_main(app, argc, argv, [&] { return calibrate(o); });
}
