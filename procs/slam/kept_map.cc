#include "procs/slam/kept_map.h"

#include <fstream>
#include <vector>

#include "common/errors.h"
#include "procs/slam/map_shelf.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRunHeader = "foresight_run 1";
constexpr const char* kRunFile = "run.txt";
constexpr const char* kUnfinishedRunFile = "run.txt.part";
constexpr const char* kPrefix = "_running_";
constexpr int kMostLoads = 3;

IsOwn own_kept_files(const fs::path& folder) {
  return [is_own = own_map_files(folder)](const fs::path& relative, bool is_folder) {
    return is_own(relative, is_folder) ||
           (!is_folder && (relative == kRunFile || relative == kUnfinishedRunFile));
  };
}

struct RunFile {
  RunIdentity run;
  KeptMap::Mark mark;
};

std::optional<RunFile> read_run_file(const fs::path& folder) {
  std::ifstream file(folder / kRunFile);
  std::string header, word;
  RunFile r;
  if (!std::getline(file, header) || header != kRunHeader) return std::nullopt;
  file >> r.run >> word >> r.mark.epoch >> word >> r.mark.image.us >> word >> r.mark.loads;
  if (!file) return std::nullopt;
  return r;
}

void write_run_file(const fs::path& folder, const RunFile& r) {
  const fs::path part = folder / kUnfinishedRunFile;
  std::ofstream file(part);
  file << kRunHeader << "\n"
       << r.run << "epoch " << r.mark.epoch << "\nimage " << r.mark.image.us << "\nloads "
       << r.mark.loads << "\n";
  file.close();
  std::error_code error;
  if (file) fs::rename(part, folder / kRunFile, error);
  if (!file || error) throw UnavailableError((folder / kRunFile).string() + ": cannot be written");
}

}  // namespace

KeptMap::KeptMap(const std::string& root, const std::string& name, const RunIdentity& run)
    : root_(root),
      folder_(root + "/" + kPrefix + (find_name_trouble(name).empty() ? name : "slam") + "_" +
              std::to_string(run.parent_pid)),
      run_(run) {}

std::optional<KeptMap::Mark> KeptMap::find() const {
  mend_folder(folder_);
  const auto found = read_run_file(folder_);
  if (!found || found->run != run_ || found->mark.loads >= kMostLoads) return std::nullopt;
  return found->mark;
}

StoredMap KeptMap::read(const Mark& mark) {
  write_run_file(folder_, {run_, {mark.epoch, mark.image, mark.loads + 1}});
  StoredMap map = read_map_folder(folder_);
  written_ = written_images(map, folder_);
  return map;
}

void KeptMap::write(const Mark& mark, const StoredMap& map) {
  replace_folder(folder_, own_kept_files, Durability::kSurvivesThisProcess,
                 [&](const fs::path& part) {
                   write_core_files(map, part, written_);
                   write_run_file(part, {run_, mark});
                 });
  written_ = written_images(map, folder_);
}

void KeptMap::remove() {
  const auto found = read_run_file(folder_);
  if (found && found->run == run_) remove_own_folder(folder_, own_kept_files);
  written_ = {};
}

void KeptMap::remove_those_of_ended_runs() const {
  std::error_code error;
  std::vector<fs::path> ended;
  for (const auto& entry : fs::directory_iterator(root_, error)) {
    if (!entry.path().filename().string().starts_with(kPrefix)) continue;
    const auto found = read_run_file(entry.path());
    if (!found || found->run == run_) continue;
    if (!goes_on(found->run)) ended.push_back(entry.path());
  }
  for (const fs::path& folder : ended) remove_own_folder(folder, own_kept_files);
}

}  // namespace foresight
