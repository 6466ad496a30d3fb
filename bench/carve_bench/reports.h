// What carve-bench tells: text for people, JSON, a CSV of single events, the mesh as OBJ.
#pragma once

#include <string>

#include "bench/carve_bench/measure.h"

namespace foresight {

void print(const CarveResult& result);

// These throw UnavailableError if the file cannot be written. An empty path is no output.
void write_json(const CarveResult& result, const std::string& path);
/// One line per event: kind, points in the map after it, constraints it adds, ms of carver and cut
/// (0 if not measured).
void write_events(const CarvSequence& sequence, const CarveResult& result, const std::string& path);
/// Without what only the hull's corners span: that is no surface that was seen.
void write_obj(const Mesh& mesh, const std::string& path);

}  // namespace foresight
