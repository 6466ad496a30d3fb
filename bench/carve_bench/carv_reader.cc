#include "bench/carve_bench/carv_reader.h"

#include <zlib.h>

#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <sstream>

namespace foresight {
namespace {

class Parser {
 public:
  Parser(const CarvReadOptions& options, CarvSequence& sequence)
      : options_(options), sequence_(sequence) {}

  // Returns false if the line cannot be understood.
  bool parse(const std::string& line) {
    std::istringstream in(line);
    char kind = 0;
    if (!(in >> kind)) return true;
    switch (kind) {
      case '#':
      case 'I':
        return true;
      case 'K':
        return parse_keyframe(in);
      case 'P':
        return parse_point(in);
      case 'O':
        return parse_observations(in);
      case 'D':
        return parse_deletion(in);
      case 'B':
        start(CarvEventKind::kAdjustment);
        return true;
      case 'M':
        return !sequence_.events.empty() && parse_position(in);
      case 'C':
        return !sequence_.events.empty() && parse_centre(in);
      default:
        return false;
    }
  }

 private:
  MapDelta& start(CarvEventKind kind) {
    sequence_.events.push_back({kind, {}});
    return sequence_.events.back().delta;
  }
  MapDelta& delta() { return sequence_.events.back().delta; }

  bool parse_keyframe(std::istringstream& in) {
    start(CarvEventKind::kKeyframe);
    if (!parse_centre(in)) return false;
    keyframe_ = delta().keyframes_set.back().id;
    double w = 0, x = 0, y = 0, z = 0;
    if (!(in >> w >> x >> y >> z)) return false;
    MapKeyframe& keyframe = delta().keyframes_set.back();
    keyframe.map_from_cam = {Eigen::Quaterniond(w, x, y, z), keyframe.map_from_cam.translation()};
    return true;
  }

  bool parse_centre(std::istringstream& in) {
    MapKeyframe keyframe;
    Eigen::Vector3d c;
    if (!(in >> keyframe.id >> c.x() >> c.y() >> c.z())) return false;
    keyframe.map_from_cam = {Eigen::Quaterniond::Identity(), options_.mu_per_m * c};
    delta().keyframes_set.push_back(keyframe);
    return true;
  }

  bool parse_position(std::istringstream& in) {
    MapPoint point;
    Eigen::Vector3d p;
    if (!(in >> point.id >> p.x() >> p.y() >> p.z())) return false;
    p *= options_.mu_per_m;
    if (options_.mu_per_m == 1e5) p = p.array().round();
    point.position_in_map = p.cast<float>();
    delta().points_set.push_back(point);
    return true;
  }

  bool parse_point(std::istringstream& in) {
    if (sequence_.events.empty() || !parse_position(in)) return false;
    const PointId id = delta().points_set.back().id;
    for (KeyframeId earlier; in >> earlier;) {
      if (options_.earlier_observations) delta().observations_added.push_back({earlier, id});
    }
    return true;
  }

  bool parse_observations(std::istringstream& in) {
    if (sequence_.events.empty()) return false;
    for (PointId id; in >> id;) delta().observations_added.push_back({keyframe_, id});
    return true;
  }

  bool parse_deletion(std::istringstream& in) {
    PointId id;
    if (!(in >> id)) return false;
    start(CarvEventKind::kDeletion).points_removed.push_back(id);
    return true;
  }

  CarvReadOptions options_;
  CarvSequence& sequence_;
  KeyframeId keyframe_;
};

// Reads one line of any length; false at the end of the file.
bool read_line(gzFile file, std::string& line) {
  line.clear();
  char buffer[4096];
  while (gzgets(file, buffer, sizeof buffer) != nullptr) {
    line += buffer;
    if (line.back() == '\n') return true;
  }
  return !line.empty();
}

}  // namespace

CarvSequence read_carv(const std::string& path, const CarvReadOptions& options) {
  CarvSequence sequence;
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (!file) {
    sequence.error = path + ": cannot be opened";
    return sequence;
  }
  Parser parser(options, sequence);
  std::string line;
  for (int number = 1; read_line(file.get(), line); ++number) {
    if (parser.parse(line)) continue;
    sequence.error = path + ":" + std::to_string(number) + ": not a carvseq record";
    return sequence;
  }
  if (sequence.events.empty()) sequence.error = path + ": no events";
  return sequence;
}

MapDelta final_map(const CarvSequence& sequence) {
  std::map<KeyframeId, MapKeyframe> keyframes;
  std::map<PointId, MapPoint> points;
  std::set<MapObservation> observations;
  for (const CarvEvent& event : sequence.events) {
    for (const PointId id : event.delta.points_removed) points.erase(id);
    for (const auto& keyframe : event.delta.keyframes_set) keyframes[keyframe.id] = keyframe;
    for (const auto& point : event.delta.points_set) points[point.id] = point;
    for (const auto& seen : event.delta.observations_added) observations.insert(seen);
  }
  MapDelta map;
  for (const auto& [id, keyframe] : keyframes) map.keyframes_set.push_back(keyframe);
  for (const auto& [id, point] : points) map.points_set.push_back(point);
  for (const auto& seen : observations) {
    if (points.contains(seen.point_id)) map.observations_added.push_back(seen);
  }
  return map;
}

}  // namespace foresight
