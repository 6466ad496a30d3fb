#include "sim/scene_loader.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/errors.h"
#include "sim/arm_spot.h"
#include "sim/file_materials.h"
#include "sim/lab.h"
#include "sim/lighting.h"
#include "sim/loaded_mesh.h"

namespace foresight::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3f;

constexpr int kMaxTriangles = 1'000'000;
constexpr uintmax_t kMaxFile_bytes = 1'000'000'000;
constexpr float kMaxCoordinate = 1e6f;
constexpr double kLightSamples = 150'000;  // about 4 s

std::string extension_of(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

void check(const std::string& path, const LoadOptions& options) {
  const std::string extension = extension_of(path);
  if (extension != ".obj" && extension != ".gltf" && extension != ".glb") {
    throw ConfigError(path + ": a scene must be an .obj, .gltf or .glb file");
  }
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw UnavailableError(path + ": there is no such file");
  const uintmax_t size_bytes = fs::file_size(path, error);
  if (error) throw UnavailableError(path + ": cannot be read");
  if (size_bytes > kMaxFile_bytes) throw ConfigError(path + ": is larger than 1 GB");
  if (!(options.scale > 1e-6 && options.scale < 1e6)) {
    throw ConfigError(path + ": scale must be between 1e-6 and 1e6 metres per unit");
  }
  if (options.max_texture_px < 16 || options.max_texture_px > 8192) {
    throw ConfigError(path + ": max_texture_px must be between 16 and 8192");
  }
  if (options.world_from_file && !options.world_from_file->is_finite()) {
    throw ConfigError(path + ": world_from_file is not finite");
  }
}

// Collects the triangles of all nodes, in the file's axes and units.
class Collector {
 public:
  Collector(const std::string& path, const aiScene& file, const FileMaterials& materials)
      : path_(path), file_(file), materials_(materials) {}

  void collect() {
    std::vector<std::pair<const aiNode*, aiMatrix4x4>> left = {{file_.mRootNode, aiMatrix4x4()}};
    while (!left.empty()) {
      const auto [node, parent] = left.back();
      left.pop_back();
      const aiMatrix4x4 pose = parent * node->mTransformation;
      for (unsigned i = 0; i < node->mNumMeshes; ++i) add(*node, node->mMeshes[i], pose);
      for (unsigned i = node->mNumChildren; i-- > 0;) left.emplace_back(node->mChildren[i], pose);
    }
    if (triangles == 0) throw ConfigError(path_ + ": has no triangles");
  }

  std::vector<LoadedMesh> meshes;
  int triangles = 0;
  int left_out = 0;

 private:
  void add(const aiNode& node, unsigned index, const aiMatrix4x4& pose) {
    const aiMesh& mesh = *file_.mMeshes[index];
    if (mesh.mMaterialIndex >= materials_.materials.size()) {
      throw ConfigError(path_ + ": mesh '" + mesh.mName.C_Str() + "' has an unknown material");
    }
    const FileMaterial& material = materials_.materials[mesh.mMaterialIndex];
    LoadedMesh loaded{node.mName.C_Str(), material.texture, {}};
    if (mesh.mName.length > 0) loaded.name = mesh.mName.C_Str();
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      if (material.glass || !add(mesh, face, pose, loaded)) {
        ++left_out;
      } else if (++triangles > kMaxTriangles) {
        throw ConfigError(path_ + ": has more than " + std::to_string(kMaxTriangles) +
                          " triangles; simplify it");
      }
    }
    if (!loaded.triangles.empty()) meshes.push_back(std::move(loaded));
  }

  // False for triangles that cannot be drawn.
  bool add(const aiMesh& mesh, const aiFace& face, const aiMatrix4x4& pose, LoadedMesh& loaded) {
    LoadedTriangle triangle;
    for (size_t i = 0; i < 3; ++i) {
      const unsigned v = face.mIndices[i];
      if (v >= mesh.mNumVertices) {
        throw ConfigError(path_ + ": a face of '" + loaded.name + "' names vertex " +
                          std::to_string(v) + " of " + std::to_string(mesh.mNumVertices));
      }
      const aiVector3D p = pose * mesh.mVertices[v];
      triangle.points[i] = {p.x, p.y, p.z};
      triangle.uvs[i] = Eigen::Vector2f::Zero();
      if (mesh.HasTextureCoords(0)) {
        triangle.uvs[i] = {mesh.mTextureCoords[0][v].x, mesh.mTextureCoords[0][v].y};
      }
      if (!(triangle.points[i].cwiseAbs().maxCoeff() < kMaxCoordinate)) return false;
    }
    if (!(triangle.area_m2() > 0) || !triangle.normal().allFinite()) return false;
    loaded.triangles.push_back(triangle);
    return true;
  }

  const std::string& path_;
  const aiScene& file_;
  const FileMaterials& materials_;
};

// Z up, in metres.
void make_upright(std::vector<LoadedMesh>& meshes, const LoadOptions& options, bool is_gltf) {
  bool turn = options.up == LoadOptions::Up::kY;
  if (options.up == LoadOptions::Up::kAuto) turn = is_gltf || y_is_up(meshes);
  Eigen::Affine3f upright = Eigen::Affine3f::Identity();
  if (turn) upright.rotate(Eigen::AngleAxisf(std::numbers::pi_v<float> / 2, Vector3f::UnitX()));
  upright.scale(static_cast<float>(options.scale));
  for (LoadedMesh& mesh : meshes) {
    for (LoadedTriangle& triangle : mesh.triangles) {
      for (Vector3f& point : triangle.points) point = upright * point;
    }
  }
}

Pose<World, SceneFile> choose_pose(const Scene& scene, float floor_m) {
  const Frame file_from_world = find_arm_spot(scene, floor_m, -kFloor_m);
  return Pose<SceneFile, World>(Eigen::Matrix3d(file_from_world.linear().cast<double>()),
                                file_from_world.translation().cast<double>())
      .inverse();
}

void move(Scene& scene, const Pose<World, SceneFile>& world_from_file) {
  const Eigen::Affine3f pose(world_from_file.matrix().cast<float>());
  for (Vertex& vertex : scene.vertices) vertex.point_in_world = pose * vertex.point_in_world;
  for (Surface& surface : scene.surfaces) {
    for (Vector3f& corner : surface.corners) corner = pose * corner;
    surface.normal_left = pose.linear() * surface.normal_left;
    surface.normal_right = pose.linear() * surface.normal_right;
  }
}

// A step between light samples that keeps their number within bounds.
float light_step_m(const std::vector<LoadedMesh>& meshes) {
  float step_m = 0.05f;
  for (;; step_m *= 1.25f) {
    double samples = 0;
    for (const LoadedMesh& mesh : meshes) {
      for (const LoadedTriangle& t : mesh.triangles) {
        const double side = std::sqrt(t.area_m2()) / step_m;
        samples += side < 0.35 ? 0.5 : (side + 1) * (side + 1);
      }
    }
    if (samples < kLightSamples || step_m > 10) return step_m;
  }
}

// Lets the importer split, check and name; it throws nothing.
const aiScene& parse(const std::string& path, Assimp::Importer& importer) {
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* file =
      importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_FlipUVs |
                                  aiProcess_ValidateDataStructure);
  if (file == nullptr) {
    std::string reason = importer.GetErrorString();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw ConfigError(path + ": is not a scene that can be read: " + reason);
  }
  if ((file->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0 || file->mRootNode == nullptr ||
      file->mNumMeshes == 0) {
    throw ConfigError(path + ": has no triangles");
  }
  return *file;
}

}  // namespace

Scene load_scene(const std::string& path, const LoadOptions& options, LoadReport* report) {
  check(path, options);
  const bool is_gltf = extension_of(path) != ".obj";
  Assimp::Importer importer;
  const aiScene& file = parse(path, importer);
  Scene scene;
  const FileMaterials materials = read_materials(file,
                                                 {.folder = fs::path(path).parent_path().string(),
                                                  .max_texture_px = options.max_texture_px,
                                                  .linear_colours = is_gltf},
                                                 scene);
  Collector collector(path, file, materials);
  collector.collect();
  std::vector<LoadedMesh>& meshes = collector.meshes;
  importer.FreeScene();
  make_upright(meshes, options, is_gltf);
  const float step_m = light_step_m(meshes);
  for (const LoadedMesh& mesh : meshes) add_loaded_mesh(scene, mesh, step_m);
  const auto world_from_file = options.world_from_file ? *options.world_from_file
                                                       : choose_pose(scene, floor_height_m(meshes));
  move(scene, world_from_file);
  add_lamp_and_backdrop(scene);
  if (options.bake) {
    constexpr LightingParams kLighting{.ambient = 0.32f, .ambient_reach_m = 0.8f};
    turn_to_light(scene, kLighting);
    bake_lighting(scene, kLighting);
  }
  if (report != nullptr) {
    *report = {collector.triangles,        collector.left_out, materials.textures_read,
               materials.textures_missing, world_from_file,    materials.warnings};
  }
  return scene;
}

}  // namespace foresight::sim
