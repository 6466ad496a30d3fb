#include "procs/slam/map_folder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "common/errors.h"
#include "procs/slam/file_writer.h"
#include "procs/slam/folder_swap.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExtraHeader = "foresight_map 1";
constexpr int kMaxSide_px = 8192;
constexpr Time kLatest{int64_t{1} << 53};  // the year 2255
constexpr int32_t kMaxId = 1 << 24, kMaxCount = 1 << 30;

std::string image_name(KeyframeId keyframe_id) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.png", keyframe_id.value());
  return name;
}

void write_cameras(const CameraModel& c, const fs::path& path) {
  FileWriter file(path);
  file.line("# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
  const std::array<double, 5>& k = c.distortion;
  // The centre of the first pixel is (0.5, 0.5) there.
  const double cx = c.cx_px + 0.5, cy = c.cy_px + 0.5;
  if (c.lens == LensModel::kEquidistant) {
    file.line(1, "OPENCV_FISHEYE", c.width_px, c.height_px, c.fx_px, c.fy_px, cx, cy, k[0], k[1],
              k[2], k[3]);
  } else {
    file.line(1, "FULL_OPENCV", c.width_px, c.height_px, c.fx_px, c.fy_px, cx, cy, k[0], k[1], k[2],
              k[3], k[4], 0, 0, 0);
  }
  file.close();
}

template <class Tag>
std::istream& read_id(std::istream& words, Id<Tag>* id) {
  typename Id<Tag>::Value value = id->value();
  words >> value;
  *id = Id<Tag>(value);
  return words;
}

struct Place {
  PointId point_id;
  Eigen::Vector2d pixel;
};
using PlacesPerKeyframe = std::map<KeyframeId, std::vector<Place>>;

PlacesPerKeyframe places_of(const StoredMap& map) {
  PlacesPerKeyframe places;
  for (const StoredMap::Point& p : map.points) {
    for (const StoredMap::Observation& o : p.observations) {
      places[o.keyframe_id].push_back({p.id, o.pixel});
    }
  }
  return places;
}

void write_image_table(const StoredMap& map, const PlacesPerKeyframe& places,
                       const fs::path& path) {
  FileWriter file(path);
  file.line("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  file.line("# POINTS2D[] as (X, Y, POINT3D_ID)");
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const Pose<Cam, Map> p = k.map_from_cam.inverse();
    const Eigen::Quaterniond& q = p.rotation();
    const Eigen::Vector3d& t = p.translation();
    file.line(k.id.next(), q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), 1, image_name(k.id));
    const auto it = places.find(k.id);
    if (it != places.end()) {
      const char* gap = "";
      for (const Place& place : it->second) {
        file << gap << place.pixel.x() + 0.5 << " " << place.pixel.y() + 0.5 << " "
             << place.point_id.next();
        gap = " ";
      }
    }
    file << "\n";
  }
  file.close();
}

int gray_at(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, image.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, image.rows - 1);
  return image.at<uint8_t>(y, x);
}

double mean_error_px(const StoredMap& map, const StoredMap::Point& point,
                     const std::map<KeyframeId, const StoredMap::Keyframe*>& keyframes) {
  double sum = 0;
  for (const StoredMap::Observation& o : point.observations) {
    const Eigen::Vector3d p =
        keyframes.at(o.keyframe_id)->map_from_cam.inverse() * point.position_in_map;
    sum += p.z() > 0 ? (map.camera.project(p) - o.pixel).norm() : 0;
  }
  return sum / static_cast<double>(std::max<size_t>(1, point.observations.size()));
}

void write_points(const StoredMap& map, const fs::path& path) {
  std::map<KeyframeId, const StoredMap::Keyframe*> keyframes;
  for (const StoredMap::Keyframe& k : map.keyframes) keyframes[k.id] = &k;
  std::map<KeyframeId, int> next_index;  // into each image's POINTS2D
  FileWriter file(path);
  file.line("# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)");
  for (const StoredMap::Point& p : map.points) {
    int gray = 0;
    for (const StoredMap::Observation& o : p.observations) {
      if (o.keyframe_id == p.source_keyframe_id) {
        gray = gray_at(keyframes.at(o.keyframe_id)->image, o.pixel);
      }
    }
    const Eigen::Vector3d& x = p.position_in_map;
    file << p.id.next() << " " << x.x() << " " << x.y() << " " << x.z() << " " << gray << " "
         << gray << " " << gray << " " << mean_error_px(map, p, keyframes);
    for (const StoredMap::Observation& o : p.observations) {
      file << " " << o.keyframe_id.next() << " " << next_index[o.keyframe_id]++;
    }
    file << "\n";
  }
  file.close();
}

void write_trajectory(const StoredMap& map, const fs::path& path) {
  FileWriter file(path);
  file.line("# time tx ty tz qx qy qz qw");
  for (const StoredMap::Keyframe& k : map.keyframes) {
    char time[40];
    std::snprintf(time, sizeof time, "%lld.%06lld", static_cast<long long>(k.time.us / 1'000'000),
                  static_cast<long long>(k.time.us % 1'000'000));
    const Eigen::Quaterniond& q = k.map_from_cam.rotation();
    const Eigen::Vector3d& t = k.map_from_cam.translation();
    file.line(time, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  file.close();
}

// COLMAP's text has the inverse poses; ours go here, so that they come back bit by bit.
void write_extra(const StoredMap& map, const fs::path& path) {
  FileWriter file(path);
  file.line(kExtraHeader);
  const CameraModel& c = map.camera;
  file.line("camera", c.lens == LensModel::kEquidistant ? 1 : 0, c.width_px, c.height_px, c.fx_px,
            c.fy_px, c.cx_px, c.cy_px, c.distortion[0], c.distortion[1], c.distortion[2],
            c.distortion[3], c.distortion[4]);
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const Eigen::Quaterniond& q = k.map_from_cam.rotation();
    const Eigen::Vector3d& t = k.map_from_cam.translation();
    file.line("keyframe", k.id, k.time.us, k.median_depth, q.w(), q.x(), q.y(), q.z(), t.x(), t.y(),
              t.z());
  }
  for (const StoredMap::Point& p : map.points) {
    const Eigen::Vector3d& x = p.position_in_map;
    file << "point " << p.id << " " << x.x() << " " << x.y() << " " << x.z() << " "
         << p.source_keyframe_id << " " << p.confirmed << " " << p.predicted_count << " "
         << p.found_count << " " << p.outlier_count << " " << p.born_keyframe_id << " "
         << p.observations.size();
    for (const StoredMap::Observation& o : p.observations) {
      file << " " << o.keyframe_id << " " << o.level << " " << o.pixel.x() << " " << o.pixel.y();
    }
    file << "\n";
  }
  file.close();
}

// Encoded in memory, so that a disk that fills up is noticed.
void write_image(const cv::Mat& image, const fs::path& path) {
  std::vector<uint8_t> bytes;
  try {
    cv::imencode(".png", image, bytes);
  } catch (const cv::Exception&) {  // the library's way to say that it cannot
  }
  if (bytes.empty()) throw UnavailableError(path.string() + ": cannot be encoded");
  FileWriter file(path);
  file << std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  file.close();
}

void write_images(const StoredMap& map, const fs::path& part, const WrittenImages& earlier) {
  std::error_code error;
  fs::create_directory(part / "images", error);
  if (error) throw UnavailableError(part.string() + ": " + error.message());
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const fs::path path = part / "images" / image_name(k.id);
    const auto it = earlier.times.find(k.id);
    if (it != earlier.times.end() && it->second == k.time) {
      fs::create_hard_link(fs::path(earlier.folder) / "images" / path.filename(), path, error);
      if (!error) continue;  // a file system without links: as if it were new
    }
    write_image(k.image, path);
  }
}

constexpr std::array kTextFiles = {"cameras.txt", "images.txt", "points3D.txt", "trajectory.txt",
                                   "foresight.txt"};

bool is_image_name(const std::string& name) {
  return name.size() >= 10 && name.ends_with(".png") &&
         name.find_first_not_of("0123456789") == name.size() - 4;
}

cv::Mat read_gray(const std::string& path) {
  try {
    return cv::imread(path, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {  // a size beyond all limits, say
    return {};
  }
}

// Reads foresight.txt line by line and checks that everything fits together.
class Reader {
 public:
  explicit Reader(const fs::path& folder)
      : folder_(folder), path_((folder / "foresight.txt").string()), file_(path_) {}

  StoredMap read() {
    if (!file_) fail("cannot be read: not a map folder (slam-map save makes one)");
    std::string line;
    if (!next(&line) || line != kExtraHeader) fail(std::string("must begin with ") + kExtraHeader);
    while (next(&line)) {
      std::istringstream words(line);
      std::string kind;
      words >> kind;
      if (kind == "camera") {
        read_camera(words);
      } else if (kind == "keyframe") {
        read_keyframe(words);
      } else if (kind == "point") {
        read_point(words);
      } else {
        fail("'" + kind + "' is no camera, keyframe or point");
      }
      std::string rest;
      if (words.fail() || words >> rest) fail("has too few or too many numbers");
    }
    if (!has_camera_) fail("has no camera");
    if (map_.keyframes.size() < 2) fail("has fewer than two keyframes");
    return std::move(map_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string line = line_number_ > 0 ? ":" + std::to_string(line_number_) : "";
    throw ConfigError(path_ + line + ": " + what);
  }
  bool next(std::string* line) {
    ++line_number_;
    return static_cast<bool>(std::getline(file_, *line));
  }
  void read_camera(std::istringstream& words) {
    CameraModel& c = map_.camera;
    int lens = 0;
    words >> lens >> c.width_px >> c.height_px >> c.fx_px >> c.fy_px >> c.cx_px >> c.cy_px;
    for (double& k : c.distortion) words >> k;
    c.lens = lens == 1 ? LensModel::kEquidistant : LensModel::kRadtan;
    const bool sane = c.width_px > 0 && c.height_px > 0 && c.width_px <= kMaxSide_px &&
                      c.height_px <= kMaxSide_px && c.fx_px > 0 && c.fy_px > 0;
    if (words.fail() || !sane) fail("the camera makes no sense");
    if (has_camera_) fail("a second camera");
    has_camera_ = true;
    c.prepare();
  }
  void read_keyframe(std::istringstream& words) {
    if (!has_camera_) fail("a keyframe before the camera");
    StoredMap::Keyframe k;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    read_id(words, &k.id) >> k.time.us >> k.median_depth >> q.w() >> q.x() >> q.y() >> q.z() >>
        t.x() >> t.y() >> t.z();
    if (words.fail() || !k.id.is_valid() || k.id.value() > kMaxId || k.time < Time{} ||
        k.time > kLatest || !q.coeffs().allFinite() || std::abs(q.norm() - 1) > 1e-6 ||
        !t.allFinite() || !(k.median_depth > 0)) {
      fail("the keyframe makes no sense");
    }
    if (!map_.keyframes.empty() && k.id <= map_.keyframes.back().id) fail("ids must increase");
    k.map_from_cam = {q, t};
    const std::string image = (folder_ / "images" / image_name(k.id)).string();
    k.image = read_gray(image);
    if (k.image.cols != map_.camera.width_px || k.image.rows != map_.camera.height_px) {
      fail(image + " is missing, damaged or not of the camera's size");
    }
    known_.insert(k.id);
    map_.keyframes.push_back(std::move(k));
  }
  void read_point(std::istringstream& words) {
    StoredMap::Point p;
    size_t count = 0;
    Eigen::Vector3d& x = p.position_in_map;
    read_id(words, &p.id) >> x.x() >> x.y() >> x.z();
    read_id(words, &p.source_keyframe_id) >> p.confirmed >> p.predicted_count >> p.found_count >>
        p.outlier_count;
    read_id(words, &p.born_keyframe_id) >> count;
    const bool sane = p.id.is_valid() && p.id.value() <= kMaxId && x.allFinite() &&
                      count <= known_.size() && p.found_count >= 0 &&
                      p.found_count <= p.predicted_count && p.predicted_count <= kMaxCount &&
                      p.outlier_count >= 0 && p.outlier_count <= kMaxCount &&
                      p.born_keyframe_id.is_valid() && p.born_keyframe_id.value() <= kMaxId;
    if (words.fail() || !sane) fail("the point makes no sense");
    if (!map_.points.empty() && p.id <= map_.points.back().id) fail("ids must increase");
    bool has_source = false;
    for (size_t i = 0; i < count; ++i) {
      StoredMap::Observation o;
      read_id(words, &o.keyframe_id) >> o.level >> o.pixel.x() >> o.pixel.y();
      if (words.fail() || !known_.contains(o.keyframe_id) || o.level < 0 || o.level > 3 ||
          !map_.camera.in_image(o.pixel) ||
          (i > 0 && o.keyframe_id <= p.observations.back().keyframe_id)) {
        fail("an observation of the point makes no sense");
      }
      has_source = has_source || o.keyframe_id == p.source_keyframe_id;
      p.observations.push_back(o);
    }
    if (!has_source) fail("the point's source does not see it");
    map_.points.push_back(std::move(p));
  }

  fs::path folder_;
  std::string path_;
  std::ifstream file_;
  int line_number_ = 0;
  StoredMap map_;
  bool has_camera_ = false;
  std::set<KeyframeId> known_;
};

}  // namespace

IsOwn own_map_files(const fs::path& folder) {
  std::ifstream file(folder / "foresight.txt");
  std::string line, kind;
  const bool is_map = std::getline(file, line) && line == kExtraHeader;
  std::set<std::string> images;
  while (is_map && std::getline(file, line)) {
    KeyframeId id;
    std::istringstream words(line);
    if (words >> kind && kind == "keyframe" && read_id(words, &id)) images.insert(image_name(id));
  }
  const bool is_part = folder.filename().string().starts_with(".");
  return [is_map, is_part, images](const fs::path& relative, bool is_folder) {
    const std::string name = relative.filename().string();
    if (is_folder) return relative == "images";
    if (relative.parent_path() == "images") {
      return images.contains(name) || (is_part && is_image_name(name));
    }
    return (is_map || is_part) && relative == name &&
           std::find(kTextFiles.begin(), kTextFiles.end(), name) != kTextFiles.end();
  };
}

WrittenImages written_images(const StoredMap& map, const std::string& folder) {
  WrittenImages written{folder, {}};
  for (const StoredMap::Keyframe& k : map.keyframes) written.times[k.id] = k.time;
  return written;
}

void write_core_files(const StoredMap& map, const fs::path& part, const WrittenImages& earlier) {
  write_images(map, part, earlier);
  write_extra(map, part / "foresight.txt");
}

void write_map_folder(const StoredMap& map, const std::string& folder) {
  if (map.keyframes.size() < 2) throw UnavailableError(folder + ": there is no map to save yet");
  replace_folder(folder, own_map_files, Durability::kSurvivesPowerLoss, [&](const fs::path& part) {
    write_cameras(map.camera, part / "cameras.txt");
    write_image_table(map, places_of(map), part / "images.txt");
    write_points(map, part / "points3D.txt");
    write_trajectory(map, part / "trajectory.txt");
    write_core_files(map, part, {});
  });
}

StoredMap read_map_folder(const std::string& folder) {
  mend_folder(folder);
  return Reader(folder).read();
}

}  // namespace foresight
