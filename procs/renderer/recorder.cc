#include "procs/renderer/recorder.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include "common/errors.h"
#include "procs/renderer/picture_fit.h"

extern char** environ;

namespace foresight {
namespace {

using Clock = std::chrono::steady_clock;

// As much as anybody may ask for: a picture then leaves in few pieces.
constexpr size_t kPipe_bytes = 1 << 20;
// ffmpeg finishes its file within so long; supervisord waits for us for 7 s.
constexpr std::chrono::milliseconds kFinish{3000};

std::vector<std::string> command_of(const std::string& path, int width_px, int height_px,
                                    double fps) {
  std::vector<std::string> words{"ffmpeg",
                                 "-y",
                                 "-loglevel",
                                 "error",
                                 "-f",
                                 "rawvideo",
                                 "-pixel_format",
                                 "rgb24",
                                 "-video_size",
                                 std::to_string(width_px) + "x" + std::to_string(height_px),
                                 "-framerate",
                                 std::to_string(fps),
                                 "-i",
                                 "-"};
  if (!path.ends_with(".png")) {
    for (const char* word :
         {"-c:v", "libx264", "-preset", "ultrafast", "-crf", "20", "-threads", "1", "-pix_fmt",
          "yuv420p", "-movflags", "+frag_keyframe+empty_moov", "-g", "30"}) {
      words.emplace_back(word);
    }
  }
  words.push_back(path);
  return words;
}

// With `input` and `complaints` as its stdin and stderr, in a session of its own: Ctrl-C must reach
// us first, so that it can finish the file after our last frame. Returns an error number.
int spawn(std::vector<std::string> words, int input, int complaints, pid_t* pid) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, complaints, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  const int error = posix_spawnp(pid, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

}  // namespace

Recorder::Recorder(const std::string& path, int width_px, int height_px, double fps)
    : width_px_(width_px), height_px_(height_px) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) throw UnavailableError("record: " + folder.string() + ": " + error.message());
  complaints_ = std::tmpfile();
  if (complaints_ == nullptr) throw UnavailableError("record: no room for a temporary file");
  try {
    start(path, fps);
  } catch (...) {
    std::fclose(complaints_);
    throw;
  }
}

void Recorder::start(const std::string& path, double fps) {
  std::signal(SIGPIPE, SIG_IGN);  // a dead ffmpeg is reported by write()
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw UnavailableError(std::string("record: no pipe: ") + std::strerror(errno));
  }
  const int error =
      spawn(command_of(path, width_px_, height_px_, fps), ends[0], fileno(complaints_), &ffmpeg_);
  ::close(ends[0]);
  pipe_ = ends[1];
  if (error != 0) {
    ::close(pipe_);
    throw UnavailableError(error == ENOENT
                               ? "record: the program ffmpeg is missing: run scripts/setup"
                               : std::string("record: ffmpeg: ") + std::strerror(error));
  }
  fcntl(pipe_, F_SETPIPE_SZ, static_cast<int>(kPipe_bytes));
  fcntl(pipe_, F_SETFL, O_NONBLOCK);
}

Recorder::~Recorder() {
  close();
  std::fclose(complaints_);
}

Recorder::Written Recorder::write(const Image& rgb) {
  if (pipe_ < 0 || rgb.channels != 3 || !rgb.is_valid()) return Written::kEnded;
  // What hangs is not waited for again.
  const Patience patience = total_ > kPipe_bytes ? kPatience : kPatienceAtBegin;
  hangs_ = !push(hangs_ ? Patience(0) : patience);
  if (pipe_ < 0) return Written::kEnded;
  if (hangs_) {
    ++dropped_;
    return Written::kDropped;
  }
  picture_ = fit_picture(rgb, width_px_, height_px_).bytes;
  taken_ = 0;
  hangs_ = !push(patience);
  if (pipe_ < 0) return Written::kEnded;
  ++frames_;
  return Written::kYes;
}

// Hands over what is left of the picture under way; false when that takes longer. Closes the pipe
// when ffmpeg has ended.
bool Recorder::push(Patience patience) {
  const auto end = Clock::now() + patience;
  while (taken_ < picture_.size()) {
    const ssize_t count = ::write(pipe_, picture_.data() + taken_, picture_.size() - taken_);
    if (count > 0) {
      taken_ += static_cast<size_t>(count);
      total_ += static_cast<size_t>(count);
      continue;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno != EAGAIN) {
      picture_.clear();
      close();
      return false;
    }
    const auto left = std::chrono::ceil<Patience>(end - Clock::now());
    if (left <= Patience(0)) return false;
    pollfd wait{pipe_, POLLOUT, 0};
    poll(&wait, 1, static_cast<int>(left.count()));
  }
  return true;
}

void Recorder::close() {
  if (pipe_ < 0) return;
  // Of a picture that is cut off ffmpeg keeps nothing.
  const bool is_whole = picture_.empty() || push(kPatienceAtEnd);
  if (pipe_ < 0) return;  // push() has found that it had ended
  ::close(std::exchange(pipe_, -1));
  if (!is_whole) --frames_;
  const int status = wait_for_end();
  why_ended_ = "ffmpeg ended";
  if (WIFEXITED(status)) why_ended_ += " with exit code " + std::to_string(WEXITSTATUS(status));
  if (WIFSIGNALED(status)) why_ended_ += " by signal " + std::to_string(WTERMSIG(status));
  const std::string complaint = last_complaint();
  if (!complaint.empty()) why_ended_ += ": " + complaint;
}

// One that does not end by itself is ended; its status.
int Recorder::wait_for_end() {
  // (The C library of Debian 12 declares pidfd_open() for C only.)
  const int process = static_cast<int>(syscall(SYS_pidfd_open, ffmpeg_, 0));
  pollfd wait{process, POLLIN, 0};
  int ended = -1;
  do {
    ended = process < 0 ? -1 : poll(&wait, 1, static_cast<int>(kFinish.count()));
  } while (ended < 0 && process >= 0 && errno == EINTR);
  if (process >= 0) ::close(process);
  if (ended <= 0) kill(ffmpeg_, SIGKILL);
  int status = 0;
  waitpid(ffmpeg_, &status, 0);
  return status;
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
