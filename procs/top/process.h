#pragma once

namespace foresight {

/// foresight-top: shows what every process reports, in both domains; see README.md. Returns the
/// exit code.
int run_top(int argc, char** argv);

}  // namespace foresight
