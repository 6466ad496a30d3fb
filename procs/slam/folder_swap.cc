#include "procs/slam/folder_swap.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "common/errors.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw UnavailableError(path.string() + ": " + what);
}

// Names beside the target that nobody else uses.
fs::path beside(const fs::path& target, const char* ending) {
  return target.parent_path() / ("." + target.filename().string() + ending);
}
fs::path part_of(const fs::path& target) { return beside(target, ".part"); }
fs::path old_of(const fs::path& target) { return beside(target, ".old"); }

// An open folder, closed at the end; its lock goes with it, also when the process is killed.
class OpenFolder {
 public:
  explicit OpenFolder(const fs::path& path) : path_(path) {
    descriptor_ = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ < 0) fail(path, std::strerror(errno));
  }
  ~OpenFolder() { close(descriptor_); }
  OpenFolder(const OpenFolder&) = delete;
  OpenFolder& operator=(const OpenFolder&) = delete;

  void lock() const {
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
    fail(path_, errno == EWOULDBLOCK ? "another program is saving in it: try again"
                                     : std::strerror(errno));
  }
  // Waits for the disk; a write that failed late (a full disk) is told here.
  void sync() const {
    if (syncfs(descriptor_) != 0) fail(path_, std::strerror(errno));
  }

 private:
  fs::path path_;
  int descriptor_;
};

// Everything below a folder: files, then the folders that held them, innermost first.
struct Contents {
  std::vector<fs::path> files, folders;
  fs::path foreign;  // the first that is not own; empty: there is none
};

Contents contents_of(const fs::path& folder, const OwnFilesOf& own_files_of) {
  const IsOwn is_own = own_files_of(folder);
  Contents contents;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::file_status status = entry.symlink_status();
    const bool is_folder = fs::is_directory(status);
    if (is_folder) {
      contents.folders.insert(contents.folders.begin(), entry.path());
    } else {
      contents.files.push_back(entry.path());
    }
    const bool own = (is_folder || fs::is_regular_file(status)) &&
                     is_own(entry.path().lexically_relative(folder), is_folder);
    if (!own && contents.foreign.empty()) contents.foreign = entry.path();
  }
  return contents;
}

// One by one, and a folder only when it is empty: what comes into it meanwhile stays.
void remove(const fs::path& folder, const Contents& contents) {
  std::error_code ignored;
  for (const fs::path& file : contents.files) fs::remove(file, ignored);
  for (const fs::path& inner : contents.folders) fs::remove(inner, ignored);
  fs::remove(folder, ignored);
}

void check_target(const fs::path& target, const OwnFilesOf& own_files_of) {
  const fs::file_status status = fs::symlink_status(target);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) fail(target, "exists and is no folder of its own");
  const Contents contents = contents_of(target, own_files_of);
  if (!contents.foreign.empty()) {
    fail(contents.foreign, "was not written by this program: nothing is replaced there");
  }
}

void change_places(const fs::path& part, const fs::path& target) {
  if (!fs::exists(fs::symlink_status(target))) return fs::rename(part, target);
  if (renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) return;
  // A file system that cannot do it in one step; mend_folder() knows the steps.
  fs::rename(target, old_of(target));
  fs::rename(part, target);
  fs::rename(old_of(target), part);
}

void clear_part(const fs::path& part, const OwnFilesOf& own_files_of) {
  if (!fs::exists(fs::symlink_status(part))) return;
  check_target(part, own_files_of);
  remove(part, contents_of(part, own_files_of));
}

void fill_part(const fs::path& part, const OwnFilesOf& own_files_of, Durability how,
               const std::function<void(const fs::path&)>& fill) {
  try {
    fs::create_directory(part);
    fill(part);
    if (how == Durability::kSurvivesPowerLoss) OpenFolder(part).sync();
  } catch (const std::exception&) {
    std::error_code error;
    if (fs::is_directory(part, error)) remove(part, contents_of(part, own_files_of));
    throw;
  }
}

fs::path without_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

void mend_folder(const fs::path& path) {
  const fs::path target = without_slash(path), old = old_of(target);
  std::error_code error;
  if (fs::exists(old, error) && !fs::exists(target, error)) fs::rename(old, target, error);
}

void replace_folder(const fs::path& path, const OwnFilesOf& own_files_of, Durability how,
                    const std::function<void(const fs::path& part)>& fill) {
  const fs::path target = without_slash(path), part = part_of(target);
  try {
    if (!target.parent_path().empty()) fs::create_directories(target.parent_path());
    const OpenFolder parent(target.parent_path().empty() ? "." : target.parent_path());
    parent.lock();
    mend_folder(target);
    check_target(target, own_files_of);
    clear_part(part, own_files_of);
    fill_part(part, own_files_of, how, fill);
    change_places(part, target);
    if (how == Durability::kSurvivesPowerLoss) parent.sync();
    if (fs::exists(fs::symlink_status(part))) remove_own_folder(part, own_files_of);
  } catch (const fs::filesystem_error& error) {
    fail(error.path1().empty() ? target : error.path1(), error.code().message());
  }
}

void remove_own_folder(const fs::path& target, const OwnFilesOf& own_files_of) {
  for (const fs::path& folder : {target, part_of(target)}) {
    std::error_code error;
    if (!fs::is_directory(fs::symlink_status(folder, error))) continue;
    try {
      const Contents contents = contents_of(folder, own_files_of);
      if (contents.foreign.empty()) remove(folder, contents);
    } catch (const fs::filesystem_error&) {  // it stays
    }
  }
}

}  // namespace foresight
