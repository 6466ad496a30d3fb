#include "procs/renderer/recorder.h"

#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "common/errors.h"
#include "procs/renderer/picture_fit.h"

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
  complaints_ = std::tmpfile();
  if (complaints_ == nullptr) throw UnavailableError("record: no room for a temporary file");
  std::signal(SIGPIPE, SIG_IGN);  // a dead ffmpeg is reported by write()
  const bool is_video = !path.ends_with(".png");
  // setsid: Ctrl-C must reach us first, so that ffmpeg can finish the file after our last frame.
  // /proc/self/fd: "2>&N" is no redirection for dash when N has two digits.
  const std::string command =
      "exec setsid ffmpeg -y -loglevel error -f rawvideo -pixel_format rgb24 -video_size " +
      std::to_string(width_px) + "x" + std::to_string(height_px) + " -framerate " +
      std::to_string(fps) + " -i - " +
      (is_video ? "-c:v libx264 -preset ultrafast -crf 20 -threads 1 -pix_fmt yuv420p -movflags "
                  "+frag_keyframe+empty_moov -g 30 "
                : "") +
      quoted(path) + " 2>>/proc/self/fd/" + std::to_string(fileno(complaints_));
  pipe_ = popen(command.c_str(), "w");
  if (pipe_ == nullptr) throw UnavailableError("record: ffmpeg cannot be started");
}

Recorder::~Recorder() {
  close();
  std::fclose(complaints_);
}

bool Recorder::write(const Image& rgb) {
  if (pipe_ == nullptr || rgb.channels != 3 || !rgb.is_valid()) return false;
  const Image framed = fit_picture(rgb, width_px_, height_px_);
  // Flushed, so that the end of ffmpeg is noticed with the picture that it did not take.
  if (std::fwrite(framed.bytes.data(), 1, framed.bytes.size(), pipe_) != framed.bytes.size() ||
      std::fflush(pipe_) != 0) {
    close();
    return false;
  }
  ++frames_;
  return true;
}

void Recorder::close() {
  if (pipe_ == nullptr) return;
  const int status = pclose(std::exchange(pipe_, nullptr));
  why_ended_ = "ffmpeg ended";
  if (WIFEXITED(status)) why_ended_ += " with exit code " + std::to_string(WEXITSTATUS(status));
  if (WIFSIGNALED(status)) why_ended_ += " by signal " + std::to_string(WTERMSIG(status));
  const std::string complaint = last_complaint();
  if (!complaint.empty()) why_ended_ += ": " + complaint;
}

// The last line often says only what the one before it has led to.
std::string Recorder::last_complaint() const {
  std::rewind(complaints_);
  std::string last, before;
  char line[512];
  while (std::fgets(line, sizeof line, complaints_) != nullptr) {
    std::string text(line);
    std::erase_if(text, [](char c) { return c < ' ' || c > '~'; });
    if (text.empty() || text.find("Last message repeated") != std::string::npos) continue;
    before = std::exchange(last, text);
  }
  return before.empty() ? last : before + " / " + last;
}

}  // namespace foresight
