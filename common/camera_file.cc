#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string_view>
#include <vector>

#include "common/camera_model.h"
#include "common/errors.h"

namespace foresight {
namespace {

constexpr int kMinSide_px = 16, kMaxSide_px = 8192;
// Focal lengths in shares of the longer side: 220° wide to 6° narrow.
constexpr double kMinFocal = 0.1, kMaxFocal = 10;
constexpr double kMaxFocalRatio = 2.5;  // fx to fy; pixels of half-pictures have 2
constexpr double kMaxCoefficient = 100;
constexpr const char* kConvert =
    "; write model, width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3 (scripts/calibrate_camera "
    "makes such a file)";

using Keys = std::initializer_list<const char*>;

// OpenCV writes "%YAML:1.0", which is not YAML; the line is dropped, as is a byte-order mark.
std::string read_text(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw ConfigError(path +
                      ": camera file cannot be read (model, width, height, fx, fy, cx, cy, "
                      "k1, k2, p1, p2, k3 as YAML)");
  }
  std::string text;
  for (std::string line; std::getline(file, line);) {
    if (text.empty() && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (line.starts_with("<?xml")) {
      throw ConfigError(path + ": is XML: save it as YAML (cv::FileStorage with a name that ends " +
                        "with .yaml)");
    }
    if (!line.starts_with("%YAML")) text += line + "\n";
  }
  return text;
}

// A camera file's map and what is said about it.
class File {
 public:
  File(const std::string& path, YAML::Node node) : path_(path), node_(std::move(node)) {}

  static File load(const std::string& path) {
    try {
      File file(path, YAML::Load(read_text(path)));
      if (!file.node_.IsMap()) throw ConfigError(path + ": must be a map of 'key: value' lines");
      return file;
    } catch (const YAML::Exception& e) {
      throw ConfigError(path + ": not YAML: " + e.what());
    }
  }

  [[noreturn]] void refuse(const std::string& key, const std::string& what) const {
    throw ConfigError(path_ + ": " + key + ": " + what);
  }
  bool has(const std::string& key) const { return node_[key].IsDefined(); }
  /// The first of these keys that is there; empty if none.
  std::string first_of(Keys keys) const {
    for (const char* key : keys) {
      if (has(key)) return key;
    }
    return "";
  }
  File inside(const std::string& key) const { return {path_ + ": " + key, node_[key]}; }
  bool is_map(const std::string& key) const { return has(key) && node_[key].IsMap(); }

  std::string text(const std::string& key) const {
    if (!has(key)) refuse(key, "missing");
    if (!node_[key].IsScalar()) refuse(key, "must be one word");
    return node_[key].Scalar();
  }
  double number(const std::string& key, double min, double max) const {
    if (!has(key)) refuse(key, "missing");
    return check(key, parse(key, node_[key]), min, max);
  }
  int whole_number(const std::string& key, int min, int max) const {
    const double value = number(key, min, max);
    if (value != std::floor(value)) refuse(key, "not a whole number");
    return static_cast<int>(value);
  }
  /// All numbers of a list, of a list of lists, or of a matrix with rows, cols and data.
  std::vector<double> numbers(const std::string& key) const {
    std::vector<double> values;
    const YAML::Node value = node_[key];
    collect(key, value.IsMap() ? value["data"] : value, &values);
    return values;
  }
  double check(const std::string& key, double value, double min, double max,
               const std::string& hint = "") const {
    if (value >= min && value <= max) return value;
    std::ostringstream line;
    line << value << " is outside [" << min << ", " << max << "]" << hint;
    refuse(key, line.str());
  }

 private:
  double parse(const std::string& key, const YAML::Node& value) const {
    try {
      return value.as<double>();
    } catch (const YAML::Exception&) {
      refuse(key, "not a number");
    }
  }
  void collect(const std::string& key, const YAML::Node& value, std::vector<double>* out) const {
    if (value.IsDefined() && value.IsSequence()) {
      for (const YAML::Node& entry : value) collect(key, entry, out);
    } else if (value.IsDefined() && !value.IsNull()) {
      out->push_back(parse(key, value));
    }
  }

  std::string path_;
  YAML::Node node_;
};

void set_size(const File& file, int width_px, int height_px, const std::string& width_key,
              const std::string& height_key, CameraModel* camera) {
  camera->width_px = static_cast<int>(file.check(width_key, width_px, kMinSide_px, kMaxSide_px));
  camera->height_px = static_cast<int>(file.check(height_key, height_px, kMinSide_px, kMaxSide_px));
}

// Absurd values would be believed to the end: a picture of pixels, not of shares of its size.
void check_matrix(const File& file, const std::string& prefix, const CameraModel& camera) {
  const double side_px = std::max(camera.width_px, camera.height_px);
  const std::string hint =
      ": focal lengths are in pixels of an image " + std::to_string(camera.width_px) + " px wide";
  for (const auto& [key, value_px] : {std::pair{"fx", camera.fx_px}, {"fy", camera.fy_px}}) {
    file.check(prefix + key, value_px, 1, 1e5, hint);
    file.check(prefix + key, value_px, kMinFocal * side_px, kMaxFocal * side_px, hint);
  }
  file.check(prefix + "fx / fy", camera.fx_px / camera.fy_px, 1 / kMaxFocalRatio, kMaxFocalRatio);
  file.check(prefix + "cx", camera.cx_px, 0, camera.width_px, ": the centre is outside the image");
  file.check(prefix + "cy", camera.cy_px, 0, camera.height_px, ": the centre is outside the image");
}

// Coefficients beyond those of the model bend the image too: they are not dropped silently.
void check_unused(const File& file, const std::string& key, double value, const char* model) {
  if (value == 0) return;
  std::ostringstream line;
  line << value << " belongs to another lens model than " << model
       << " (OpenCV's rational or thin-prism model has 8 and more coefficients): calibrate with "
       << (std::string_view(model) == "equidistant" ? "4" : "5 (k1, k2, p1, p2, k3)");
  file.refuse(key, line.str());
}

// Our own format: a key each.
CameraModel from_keys(const File& file) {
  CameraModel camera;
  const std::string model = file.text("model");
  if (model == "pinhole_radtan") {
    camera.lens = LensModel::kRadtan;
  } else if (model == "equidistant") {
    camera.lens = LensModel::kEquidistant;
  } else {
    file.refuse("model", "'" + model + "' is not one of pinhole_radtan, equidistant");
  }
  camera.width_px = file.whole_number("width", kMinSide_px, kMaxSide_px);
  camera.height_px = file.whole_number("height", kMinSide_px, kMaxSide_px);
  constexpr double kAny = std::numeric_limits<double>::max();
  camera.fx_px = file.number("fx", 1, 1e5);
  camera.fy_px = file.number("fy", 1, 1e5);
  camera.cx_px = file.number("cx", -kAny, kAny);
  camera.cy_px = file.number("cy", -kAny, kAny);
  check_matrix(file, "", camera);
  const bool radtan = camera.lens == LensModel::kRadtan;
  const std::array<const char*, 5> keys =
      radtan ? std::array{"k1", "k2", "p1", "p2", "k3"} : std::array{"k1", "k2", "k3", "k4", ""};
  for (size_t i = 0; i < (radtan ? 5u : 4u); ++i) {
    if (radtan && i == 4 && !file.has("k3")) continue;  // many calibrations leave it out: 0
    camera.distortion[i] = file.number(keys[i], -kMaxCoefficient, kMaxCoefficient);
  }
  const std::vector<const char*> beyond =
      radtan ? std::vector{"k4", "k5", "k6", "s1", "s2", "s3", "s4"}
             : std::vector{"p1", "p2", "k5", "k6"};
  for (const char* key : beyond) {
    if (file.has(key)) check_unused(file, key, file.number(key, -kAny, kAny), model.c_str());
  }
  return camera;
}

LensModel lens_named(const File& file, const std::string& key) {
  const std::string name = key.empty() ? "plumb_bob" : file.text(key);
  for (const char* radtan :
       {"plumb_bob", "radtan", "radial-tangential", "rational_polynomial", "none", "pinhole"}) {
    if (name == radtan) return LensModel::kRadtan;
  }
  for (const char* fisheye : {"equidistant", "fisheye", "kannala_brandt"}) {
    if (name == fisheye) return LensModel::kEquidistant;
  }
  file.refuse(key, "'" + name + "' is not read (plumb_bob, radtan, equidistant are)" + kConvert);
}

void set_distortion(const File& file, const std::string& key, CameraModel* camera) {
  const std::vector<double> values = key.empty() ? std::vector<double>{} : file.numbers(key);
  const bool radtan = camera->lens == LensModel::kRadtan;
  const size_t known = radtan ? 5 : 4;
  if (!values.empty() && values.size() < 4) {
    file.refuse(key, "has " + std::to_string(values.size()) + " coefficients, needs " +
                         (radtan ? "4 or 5" : "4"));
  }
  for (size_t i = 0; i < values.size(); ++i) {
    if (i < known) {
      camera->distortion[i] = file.check(key, values[i], -kMaxCoefficient, kMaxCoefficient);
    } else {
      check_unused(file, key, values[i], radtan ? "pinhole_radtan" : "equidistant");
    }
  }
}

// ROS's camera_info and OpenCV's FileStorage: a matrix and a list of coefficients.
CameraModel from_matrix(const File& file, const std::string& matrix_key) {
  CameraModel camera;
  const std::string width = file.first_of({"image_width", "image_Width", "width"});
  const std::string height = file.first_of({"image_height", "image_Height", "height"});
  if (width.empty() || height.empty()) {
    file.refuse(width.empty() ? "image_width" : "image_height",
                "missing: the size of the images that were calibrated with");
  }
  set_size(file, file.whole_number(width, 1, 1 << 20), file.whole_number(height, 1, 1 << 20), width,
           height, &camera);
  const std::vector<double> k = file.numbers(matrix_key);
  if (k.size() != 9) {
    file.refuse(matrix_key, "has " + std::to_string(k.size()) + " numbers, needs 3 x 3");
  }
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    file.refuse(matrix_key, "must be fx 0 cx 0 fy cy 0 0 1 (no skew)");
  }
  camera.fx_px = k[0], camera.cx_px = k[2], camera.fy_px = k[4], camera.cy_px = k[5];
  check_matrix(file, matrix_key + ": ", camera);
  camera.lens = lens_named(file, file.first_of({"distortion_model"}));
  set_distortion(file,
                 file.first_of({"distortion_coefficients", "Distortion_Coefficients", "distCoeffs",
                                "dist_coeffs", "D", "d"}),
                 &camera);
  return camera;
}

// Kalibr's camchain and EuRoC's sensor.yaml: intrinsics [fx, fy, cx, cy].
CameraModel from_intrinsics(const File& file) {
  CameraModel camera;
  const std::vector<double> f = file.numbers("intrinsics");
  if (f.size() != 4 || (file.has("camera_model") && file.text("camera_model") != "pinhole")) {
    file.refuse("intrinsics", std::string("must be fx, fy, cx, cy of a pinhole camera") + kConvert);
  }
  const std::vector<double> size =
      file.has("resolution") ? file.numbers("resolution") : std::vector<double>{};
  if (size.size() != 2) file.refuse("resolution", "must be width, height");
  for (const double side : size) file.check("resolution", side, kMinSide_px, kMaxSide_px);
  set_size(file, static_cast<int>(size[0]), static_cast<int>(size[1]), "resolution", "resolution",
           &camera);
  camera.fx_px = f[0], camera.fy_px = f[1], camera.cx_px = f[2], camera.cy_px = f[3];
  check_matrix(file, "intrinsics: ", camera);
  camera.lens = lens_named(file, file.first_of({"distortion_model"}));
  set_distortion(file, file.first_of({"distortion_coeffs", "distortion_coefficients"}), &camera);
  return camera;
}

CameraModel read_any(const File& file) {
  if (file.has("model") || file.has("fx")) return from_keys(file);
  if (file.is_map("cam0")) return read_any(file.inside("cam0"));
  if (file.has("intrinsics")) return from_intrinsics(file);
  const std::string matrix =
      file.first_of({"camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "k", "M"});
  if (!matrix.empty()) return from_matrix(file, matrix);
  if (file.has("Camera.fx") || file.has("Camera1.fx")) {
    file.refuse("Camera.fx", std::string("ORB-SLAM's settings are not read") + kConvert);
  }
  file.refuse("model", std::string("missing") + kConvert);
}

}  // namespace

CameraModel load_camera_file(const std::string& path) {
  CameraModel camera = read_any(File::load(path));
  camera.prepare();
  return camera;
}

}  // namespace foresight
