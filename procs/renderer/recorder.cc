#include "procs/renderer/recorder.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "common/errors.h"

namespace foresight {
namespace {

// For /bin/sh inside single quotes.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace

Recorder::Recorder(const std::string& path, int width_px, int height_px, double fps)
    : width_px_(width_px), height_px_(height_px) {
  namespace fs = std::filesystem;
  if (std::system("command -v ffmpeg >/dev/null 2>&1") != 0) {
    throw UnavailableError("record: the program ffmpeg is missing: run scripts/setup");
  }
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) throw UnavailableError("record: " + folder.string() + ": " + error.message());
  std::signal(SIGPIPE, SIG_IGN);  // a dead ffmpeg is reported by write()
  const bool is_video = !path.ends_with(".png");
  // setsid: Ctrl-C must reach us first, so that ffmpeg can finish the file after our last frame.
  const std::string command =
      "exec setsid ffmpeg -y -loglevel error -f rawvideo -pixel_format rgb24 -video_size " +
      std::to_string(width_px) + "x" + std::to_string(height_px) + " -framerate " +
      std::to_string(fps) + " -i - " +
      (is_video ? "-c:v libx264 -preset ultrafast -crf 20 -threads 1 -pix_fmt yuv420p -movflags "
                  "+frag_keyframe+empty_moov -g 30 "
                : "") +
      quoted(path);
  pipe_ = popen(command.c_str(), "w");
  if (pipe_ == nullptr) throw UnavailableError("record: ffmpeg cannot be started");
}

Recorder::~Recorder() {
  if (pipe_ != nullptr) pclose(pipe_);
}

bool Recorder::write(const Image& rgb) {
  if (rgb.width_px != width_px_ || rgb.height_px != height_px_ || rgb.channels != 3) return false;
  if (std::fwrite(rgb.bytes.data(), 1, rgb.bytes.size(), pipe_) != rgb.bytes.size()) return false;
  ++frames_;
  return true;
}

}  // namespace foresight
