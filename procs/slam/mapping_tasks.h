// Slow work beside tracking. A task owns copies of all that it needs (images are shared and never
// written), so that it may run on any thread while tracking goes on; it is taken and applied on the
// main thread, and need not mind whether the map is still the same one: Slam sees to that. What is
// done first: the table at the end of the .cc. A new kind is a class there and a line of the table,
// and an entry of the Agenda (live_map.h) if something has to happen before it is due.
#pragma once

#include <memory>

#include "procs/slam/initializer.h"
#include "procs/slam/live_map.h"
#include "procs/slam/slam.h"

namespace foresight::slam {

/// What tasks are taken from and applied to.
struct Mapping {
  Initializer& initializer;
  LiveMap& live;
  SlamStatistics& counters;
};

class MappingTask {
 public:
  virtual ~MappingTask() = default;
  /// Before it has run: what it usually costs, in local bundle adjustments.
  virtual double relative_cost() const = 0;
  virtual void run() = 0;  // pure; any thread; once
  /// After it has run. The map may have changed meanwhile: keyframes and points may be gone.
  virtual void apply(Mapping* mapping) = 0;
};

/// The most urgent one; null if there is nothing to do.
std::unique_ptr<MappingTask> next_task(Mapping* mapping);

}  // namespace foresight::slam
