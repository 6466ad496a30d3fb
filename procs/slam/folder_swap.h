// Puts a new folder in the place of an old one so that nothing is lost, whatever happens meanwhile:
// the new one is written beside it under a name that begins with a dot, and the two change places
// only when all of it is on the disk. Nothing is ever removed or replaced that the caller does not
// know to be its own.
//
//   replace_folder("maps/lab", own_files_of, Durability::kSurvivesPowerLoss,
//                  [&](const auto& part) { write_everything_into(part); });
#pragma once

#include <filesystem>
#include <functional>

namespace foresight {

/// Whether a file or folder, named relative to its map folder, is one that the caller wrote.
using IsOwn = std::function<bool(const std::filesystem::path& relative, bool is_folder)>;
/// That question for one folder (its own name begins with a dot while it is being written).
using OwnFilesOf = std::function<IsOwn(const std::filesystem::path& folder)>;

enum class Durability {
  kSurvivesThisProcess,  // nothing waits for the disk
  kSurvivesPowerLoss,
};

/// Makes `target` the folder that `fill` writes; it must not exist, be empty, or hold own files
/// only. One program at a time saves in a parent folder; the others are refused. Throws
/// UnavailableError with one line that names the path; `target` is as it was then.
void replace_folder(const std::filesystem::path& target, const OwnFilesOf& own_files_of,
                    Durability how,
                    const std::function<void(const std::filesystem::path& part)>& fill);

/// Finishes or takes back what a crash in replace_folder() left half done. Call before reading.
void mend_folder(const std::filesystem::path& target);

/// Removes `target`, and what a crash left beside it, if they hold own files only.
void remove_own_folder(const std::filesystem::path& target, const OwnFilesOf& own_files_of);

}  // namespace foresight
