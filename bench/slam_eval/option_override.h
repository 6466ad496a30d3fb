// `--set name=value`: tries other parameters without a rebuild.
#pragma once

#include <string>

#include "procs/slam/slam_options.h"

namespace foresight {

/// Throws UsageError for an unknown name or a value that is not a number.
void override_option(const std::string& assignment, SlamOptions* options);

}  // namespace foresight
