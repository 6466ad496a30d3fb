// The figures of runs as a Markdown table and as JSON, under the same keys.
#pragma once

#include <string>
#include <vector>

#include "bench/mesh_eval/mesh_evaluation.h"

namespace foresight {

/// Two rows a run: the final mesh, and the mesh as it was when each image came.
std::string table_of(const std::vector<MeshEvaluation>& evaluations);
/// One object for each row. Throws UnavailableError if the file cannot be written.
void write_json(const std::vector<MeshEvaluation>& evaluations, const std::string& path);

}  // namespace foresight
