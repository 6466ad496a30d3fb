#include "common/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include "common/errors.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& where, const std::string& why) {
  throw UnavailableError(where + ": cannot be written: " + why);
}

std::string reason() { return std::strerror(errno); }

void check_extension(const std::string& option, const std::string& path,
                     const std::vector<std::string_view>& extensions) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extensions.empty() ||
      std::find(extensions.begin(), extensions.end(), extension) != extensions.end()) {
    return;
  }
  std::string known;
  for (const std::string_view e : extensions) known += (known.empty() ? "" : ", ") + std::string(e);
  throw UsageError(option + " " + path + ": must end with one of " + known);
}

// Opens it as the writing will, and leaves no trace.
void check_writable(const std::string& where, const std::string& path) {
  std::error_code error;
  const bool was_there = fs::exists(path, error);
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0666);
  if (file < 0) refuse(where, reason());
  close(file);
  if (!was_there) fs::remove(path, error);
}

void write_all(const std::string& path, const void* data, size_t size) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) refuse(path, reason());
  if (std::fwrite(data, 1, size, file.get()) != size || std::fflush(file.get()) != 0) {
    refuse(path, reason());
  }
}

}  // namespace

void check_output(const std::string& option, const std::string& path,
                  const std::vector<std::string_view>& extensions) {
  if (path.empty()) return;
  check_extension(option, path, extensions);
  const std::string where = option + " " + path;
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (!folder.empty() && !fs::is_directory(folder, error)) {
    refuse(where, "there is no folder " + folder.string());
  }
  if (fs::is_directory(path, error)) refuse(where, "is a folder");
  check_writable(where, path);
}

void check_output_folder(const std::string& option, const std::string& folder) {
  if (folder.empty()) return;
  const std::string where = option + " " + folder;
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) refuse(where, error ? error.message() : "is not a folder");
  if (access(folder.c_str(), W_OK | X_OK) != 0) refuse(where, reason());
}

void write_output(const std::string& path, std::string_view text) {
  write_all(path, text.data(), text.size());
}

void write_output(const std::string& path, std::span<const unsigned char> bytes) {
  write_all(path, bytes.data(), bytes.size());
}

void replace_output(const std::string& path, std::string_view text) {
  const std::string part = path + ".part";
  write_output(part, text);
  if (std::rename(part.c_str(), path.c_str()) != 0) refuse(path, reason());
}

std::string json_text(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    char code[8];
    std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned char>(c));
    if (c == '"' || c == '\\') {
      quoted += {'\\', c};
    } else {
      quoted += static_cast<unsigned char>(c) < 0x20 ? std::string(code) : std::string(1, c);
    }
  }
  return quoted + "\"";
}

void RunErrors::attempt(const std::function<void()>& step) {
  try {
    step();
  } catch (const StartupError& error) {
    if (code_ == kExitDone) code_ = error.code();
    text_ += (text_.empty() ? "" : "\n") + std::string(error.what());
  }
}

void RunErrors::add(const std::string& line) {
  attempt([&] { throw UnavailableError(line); });
}

void RunErrors::report() const {
  if (code_ != kExitDone) throw StartupError(code_, text_);
}

}  // namespace foresight
