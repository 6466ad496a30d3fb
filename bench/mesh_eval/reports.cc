#include "bench/mesh_eval/reports.h"

#include <cstdio>
#include <sstream>
#include <utility>

#include "common/output_file.h"

namespace foresight {
namespace {

struct Figure {
  const char* key;
  double value;
  int digits;
};

std::string text_of(const Figure& f) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", f.digits, f.value);
  return text;
}

struct Row {
  std::string sequence, mesh;
  std::vector<Figure> figures;
};

Row row_of(const MeshEvaluation& e, const char* mesh, const DepthScore& s) {
  return {e.sequence,
          mesh,
          {{"images", static_cast<double>(s.images), 0},
           {"pixels", static_cast<double>(s.pixels), 0},
           {"measured_share", s.measured_share, 3},
           {"guessed_share", s.guessed_share, 3},
           {"open_share", s.open_share, 3},
           {"right_share", s.right_share(), 3},
           {"within_5_percent", s.within_5_percent, 3},
           {"within_10_percent", s.within_10_percent, 3},
           {"in_front_10_percent", s.in_front_10_percent, 3},
           {"behind_10_percent", s.behind_10_percent, 3},
           {"median_error_percent", s.median_error_percent, 2},
           {"metres_per_mu", e.metres_per_mu, 4},
           {"truth_metres_per_mu", e.truth_metres_per_mu.value_or(-1), 4},
           {"points", static_cast<double>(e.points), 0},
           {"keyframes", static_cast<double>(e.keyframes), 0},
           {"triangles", static_cast<double>(e.triangles), 0},
           {"refused_images", static_cast<double>(e.refused_images), 0}}};
}

std::vector<Row> rows_of(const std::vector<MeshEvaluation>& evaluations) {
  std::vector<Row> rows;
  for (const MeshEvaluation& e : evaluations) {
    rows.push_back(row_of(e, "final", e.final_mesh));
    rows.push_back(row_of(e, "live", e.live_mesh));
  }
  return rows;
}

}  // namespace

std::string table_of(const std::vector<MeshEvaluation>& evaluations) {
  const std::vector<Row> rows = rows_of(evaluations);
  if (rows.empty()) return "";
  std::string text = "| sequence | mesh |", line = "\n|---|---|";
  for (const Figure& f : rows.front().figures) {
    text += std::string(" ") + f.key + " |";
    line += "---|";
  }
  text += line;
  for (const Row& row : rows) {
    text += "\n| " + row.sequence + " | " + row.mesh + " |";
    for (const Figure& f : row.figures) text += " " + text_of(f) + " |";
  }
  return text + "\n";
}

void write_json(const std::vector<MeshEvaluation>& evaluations, const std::string& path) {
  std::ostringstream file;
  file << "[";
  const char* separator = "\n";
  for (const Row& row : rows_of(evaluations)) {
    file << std::exchange(separator, ",\n") << "  {\"sequence\": " << json_text(row.sequence)
         << ", \"mesh\": \"" << row.mesh << "\"";
    for (const Figure& f : row.figures) file << ", \"" << f.key << "\": " << text_of(f);
    file << "}";
  }
  file << "\n]\n";
  write_output(path, file.str());
}

}  // namespace foresight
