#include "sim/file_materials.h"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace foresight::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kTexelBudget = 64.0 * 1024 * 1024;  // of 5.3 bytes each, with the smaller levels
constexpr int kMaxSide_px = 1 << 15;
constexpr float kGlassOpacity = 0.3f;

class Reader {
 public:
  Reader(const aiScene& file, const MaterialOptions& options, Scene& scene)
      : file_(file), options_(options), scene_(scene) {}

  FileMaterial read(const aiMaterial& material) {
    FileMaterial look;
    float opacity = 1;
    material.Get(AI_MATKEY_OPACITY, opacity);
    look.glass = opacity < kGlassOpacity;
    aiString name;
    std::array<aiTextureMapMode, 2> mode = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
    for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
      if (material.GetTexture(type, 0, &name, nullptr, nullptr, nullptr, nullptr, mode.data()) !=
          aiReturn_SUCCESS) {
        continue;
      }
      const auto texture = picture(name.C_Str(), mode[0] != aiTextureMapMode_Clamp);
      if (!texture) break;
      look.texture = *texture;
      return look;
    }
    look.texture = plain(material);
    return look;
  }

  FileMaterials result;

 private:
  // Reads each picture once; nothing when it cannot be read.
  std::optional<int> picture(const std::string& name, bool tiled) {
    const auto [known, is_new] = known_.try_emplace({name, tiled});
    if (!is_new) return known->second;
    const cv::Mat rgb = shrunk(load(name));
    if (rgb.empty()) {
      ++result.textures_missing;
      return std::nullopt;
    }
    ++result.textures_read;
    known->second = scene_.add_texture(make_texture(rgb, tiled));
    const TextureLevel& level = scene_.textures.back().levels[0];
    texels_ += static_cast<double>(level.width) * level.height;
    return known->second;
  }

  cv::Mat load(const std::string& name) {
    cv::Mat bgr, rgb;
    try {
      if (const aiTexture* inside = file_.GetEmbeddedTexture(name.c_str())) {
        bgr = embedded(*inside);
      } else {
        std::string relative = name;  // some programs write Windows' separators
        std::replace(relative.begin(), relative.end(), '\\', '/');
        const fs::path path = fs::path(options_.folder) / relative;
        std::error_code error;  // OpenCV has its own words for a file that is not there
        if (fs::is_regular_file(path, error)) bgr = cv::imread(path.string(), cv::IMREAD_COLOR);
      }
    } catch (const cv::Exception&) {
      bgr.release();
    }
    if (bgr.empty() || bgr.cols > kMaxSide_px || bgr.rows > kMaxSide_px) {
      result.warnings.push_back("texture '" + name + "' cannot be read: plain colour instead");
      return {};
    }
    cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
    return rgb;
  }

  static cv::Mat embedded(const aiTexture& texture) {
    if (texture.mHeight == 0) {  // a PNG or JPEG of mWidth bytes
      const cv::Mat bytes(1, static_cast<int>(texture.mWidth), CV_8UC1, texture.pcData);
      return cv::imdecode(bytes, cv::IMREAD_COLOR);
    }
    cv::Mat bgr;
    const cv::Mat bgra(static_cast<int>(texture.mHeight), static_cast<int>(texture.mWidth), CV_8UC4,
                       texture.pcData);
    cv::cvtColor(bgra, bgr, cv::COLOR_BGRA2BGR);
    return bgr;
  }

  // To sides that the options and what is left of the budget allow.
  cv::Mat shrunk(const cv::Mat& rgb) const {
    if (rgb.empty()) return rgb;
    int side = options_.max_texture_px;
    while (side > 32 && texels_ + static_cast<double>(side) * side > kTexelBudget) side /= 2;
    if (rgb.cols <= side && rgb.rows <= side) return rgb;
    cv::Mat small;
    cv::resize(rgb, small, {std::min(rgb.cols, side), std::min(rgb.rows, side)}, 0, 0,
               cv::INTER_AREA);
    return small;
  }

  int plain(const aiMaterial& material) {
    aiColor4D colour(0.6f, 0.6f, 0.6f, 1);
    if (material.Get(AI_MATKEY_BASE_COLOR, colour) != aiReturn_SUCCESS) {
      material.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
    }
    const auto level = [this](float x) {
      const float bounded = x > 0 ? std::min(x, 1.0f) : 0.0f;  // NaN is 0
      return static_cast<double>(255 *
                                 (options_.linear_colours ? std::pow(bounded, 1 / 2.2f) : bounded));
    };
    const cv::Scalar rgb(level(colour.r), level(colour.g), level(colour.b));
    return scene_.add_texture(make_texture(cv::Mat(2, 2, CV_8UC3, rgb), true));
  }

  const aiScene& file_;
  const MaterialOptions& options_;
  Scene& scene_;
  std::map<std::pair<std::string, bool>, std::optional<int>> known_;
  double texels_ = 0;
};

}  // namespace

FileMaterials read_materials(const aiScene& file, const MaterialOptions& options, Scene& scene) {
  Reader reader(file, options, scene);
  for (unsigned i = 0; i < file.mNumMaterials; ++i) {
    reader.result.materials.push_back(reader.read(*file.mMaterials[i]));
  }
  return std::move(reader.result);
}

}  // namespace foresight::sim
