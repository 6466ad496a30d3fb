#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "common/camera_model.h"
#include "common/errors.h"

namespace foresight {
namespace {

// OpenCV writes "%YAML:1.0", which is not YAML; the line is dropped.
YAML::Node load_yaml(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw ConfigError(path +
                      ": camera file cannot be read (model, width, height, fx, fy, cx, cy, "
                      "k1, k2, p1, p2, k3 as YAML)");
  }
  std::stringstream text;
  std::string line;
  while (std::getline(file, line)) {
    if (!line.starts_with("%YAML")) text << line << "\n";
  }
  try {
    return YAML::Load(text.str());
  } catch (const YAML::Exception& e) {
    throw ConfigError(path + ": not YAML: " + e.what());
  }
}

std::string text(const YAML::Node& node, const std::string& path, const std::string& key) {
  if (!node[key]) throw ConfigError(path + ": " + key + ": missing");
  if (!node[key].IsScalar()) throw ConfigError(path + ": " + key + ": must be one word");
  return node[key].Scalar();
}

double number(const YAML::Node& node, const std::string& path, const std::string& key, double min,
              double max) {
  if (!node[key]) throw ConfigError(path + ": " + key + ": missing");
  double value = 0;
  try {
    value = node[key].as<double>();
  } catch (const YAML::Exception&) {
    throw ConfigError(path + ": " + key + ": not a number");
  }
  if (!(value >= min && value <= max)) {
    std::ostringstream line;
    line << path << ": " << key << ": " << value << " is outside [" << min << ", " << max << "]";
    throw ConfigError(line.str());
  }
  return value;
}

int whole_number(const YAML::Node& node, const std::string& path, const std::string& key, int min,
                 int max) {
  const double value = number(node, path, key, min, max);
  if (value != std::floor(value)) throw ConfigError(path + ": " + key + ": not a whole number");
  return static_cast<int>(value);
}

}  // namespace

CameraModel load_camera_file(const std::string& path) {
  const YAML::Node node = load_yaml(path);
  if (!node.IsMap()) throw ConfigError(path + ": must be a map of 'key: value' lines");
  CameraModel camera;
  const std::string model = text(node, path, "model");
  if (model == "pinhole_radtan") {
    camera.lens = LensModel::kRadtan;
  } else if (model == "equidistant") {
    camera.lens = LensModel::kEquidistant;
  } else {
    throw ConfigError(path + ": model: '" + model + "' is not one of pinhole_radtan, equidistant");
  }
  camera.width_px = whole_number(node, path, "width", 16, 8192);
  camera.height_px = whole_number(node, path, "height", 16, 8192);
  camera.fx_px = number(node, path, "fx", 1, 1e5);
  camera.fy_px = number(node, path, "fy", 1, 1e5);
  camera.cx_px = number(node, path, "cx", -8192, 16384);
  camera.cy_px = number(node, path, "cy", -8192, 16384);
  const bool radtan = camera.lens == LensModel::kRadtan;
  const std::array<const char*, 5> keys =
      radtan ? std::array{"k1", "k2", "p1", "p2", "k3"} : std::array{"k1", "k2", "k3", "k4", ""};
  for (size_t i = 0; i < (radtan ? 5u : 4u); ++i) {
    camera.distortion[i] = number(node, path, keys[i], -100, 100);
  }
  camera.prepare();
  return camera;
}

}  // namespace foresight
