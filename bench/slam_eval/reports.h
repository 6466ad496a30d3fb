// The figures of runs as text, JSON and a Markdown table beside the peers'.
#pragma once

#include <string>
#include <vector>

#include "bench/slam_eval/evaluation.h"

namespace foresight {

void print(const Evaluation& evaluation);
/// Throw UnavailableError if the file cannot be written. An empty path is no output.
void write_json(const std::vector<Evaluation>& evaluations, const std::string& path);
void write_table(const std::vector<Evaluation>& evaluations, const std::string& path);

}  // namespace foresight
