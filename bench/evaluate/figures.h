// The figures of a result under the same names in tables, CSV and JSON, and its pictures.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "bench/evaluate/closed_loop_scorer.h"
#include "bench/evaluate/recorded_line_scorer.h"

namespace foresight {

struct Figure {
  std::string key;
  double value;
  int digits;
};

/// One run: its name, its figures, rows of pictures.
struct Report {
  std::string name;
  double delay_s = 0;
  std::vector<Figure> figures;
  std::vector<cv::Mat> grid_rows;
};

Report report_of(const EvaluationResult& result);
Report report_of(const ClosedLoopResult& result);

void print_table(const EvaluationResult& result);
void print_table(const ClosedLoopResult& result);

/// Each throws UnavailableError when the file cannot be written. An empty path is no output.
void write_json(const std::string& path, const std::vector<Report>& reports);
void write_csv(const std::string& path, const std::vector<Report>& reports);
void write_grid(const std::string& path, const std::vector<Report>& reports);
/// FOLDER/predictions.csv, commands.csv, base.csv, alignment.csv: errors over time.
void write_series(const std::string& folder, const ClosedLoopResult& result);

}  // namespace foresight
