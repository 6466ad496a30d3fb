// The map of a running slam on the disk, so that it outlives slam: after a crash or a SIGKILL the
// next slam of the same run goes on in it (docs/decisions/0007). Below the root, in a folder of its
// own per run (_running_<name>_<process that started slam>): foresight.txt and images as in a map
// folder, and run.txt with what follows here.
//
//   KeptMap kept(root, node.name(), this_run());
//   if (auto earlier = kept.find()) …;      // at the start: a map to go on with
//   kept.write({epoch, image}, map);        // now and then; slow: beside the loop
//   kept.remove();                          // ended on purpose: nobody is to go on
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/run_identity.h"
#include "procs/slam/map_folder.h"
#include "procs/slam/stored_map.h"

namespace foresight {

class KeptMap {
 public:
  /// What goes with the map.
  struct Mark {
    int64_t epoch = 0;  // of the map, as published
    Time image;         // newest that slam had seen
    int loads = 0;      // slams that have begun with it and not written it since
  };

  /// `name`: slam's own, so that two of one run do not share a map.
  KeptMap(const std::string& root, const std::string& name, const RunIdentity& run);
  const std::string& folder() const { return folder_; }

  /// That of a map that an earlier slam of this run has left; nothing if there is none, if it
  /// cannot be read, or if slam has died three times with it: then the map may be the reason.
  std::optional<Mark> find() const;
  /// Reads the map and counts the attempt. Throws StartupError.
  StoredMap read(const Mark& mark);
  /// Replaces what is there, all or nothing; images that lie there are not written again. Throws
  /// UnavailableError.
  void write(const Mark& mark, const StoredMap& map);
  void remove();
  /// Removes what runs that are over have left below the root.
  void remove_those_of_ended_runs() const;

 private:
  std::string root_, folder_;
  RunIdentity run_;
  WrittenImages written_;
};

}  // namespace foresight
