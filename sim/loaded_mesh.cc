#include "sim/loaded_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace foresight::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kFlatness_m = 1e-3f;
constexpr float kFlatCosine = 0.99f;  // 8°

// The triangles at each triangle's three edges; points that agree to the bit are the same.
class Neighbours {
 public:
  explicit Neighbours(const std::vector<LoadedTriangle>& triangles) : edges_(triangles.size()) {
    std::map<std::array<float, 3>, int> ids;
    std::map<std::pair<int, int>, std::vector<int>> at_edge;
    for (size_t t = 0; t < triangles.size(); ++t) {
      std::array<int, 3> corner;
      for (size_t i = 0; i < 3; ++i) {
        const Vector3f& p = triangles[t].points[i];
        corner[i] =
            ids.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(ids.size())).first->second;
      }
      for (size_t i = 0; i < 3; ++i) {
        const auto [a, b] = std::minmax(corner[i], corner[(i + 1) % 3]);
        edges_[t][i] = &at_edge[{a, b}];
        at_edge[{a, b}].push_back(static_cast<int>(t));
      }
    }
    resolve();
    edges_.clear();
  }
  const std::vector<int>& of(int triangle) const { return neighbours_[triangle]; }

 private:
  void resolve() {
    neighbours_.resize(edges_.size());
    for (size_t t = 0; t < edges_.size(); ++t) {
      for (const std::vector<int>* edge : edges_[t]) {
        if (edge->size() > 8) continue;  // a fan, not a surface
        for (const int other : *edge) {
          if (other != static_cast<int>(t)) neighbours_[t].push_back(other);
        }
      }
    }
  }
  std::vector<std::array<const std::vector<int>*, 3>> edges_;  // while it is built
  std::vector<std::vector<int>> neighbours_;
};

bool lies_in(const LoadedTriangle& triangle, const Vector3f& normal, float offset) {
  if (triangle.normal().dot(normal) < kFlatCosine) return false;
  return std::all_of(triangle.points.begin(), triangle.points.end(), [&](const Vector3f& p) {
    return std::abs(normal.dot(p) - offset) < kFlatness_m;
  });
}

// Grows pieces from their first triangle's plane.
std::vector<std::vector<int>> flat_pieces(const std::vector<LoadedTriangle>& triangles) {
  const Neighbours neighbours(triangles);
  std::vector<char> taken(triangles.size());
  std::vector<std::vector<int>> pieces;
  for (size_t first = 0; first < triangles.size(); ++first) {
    if (taken[first]) continue;
    const Vector3f normal = triangles[first].normal();
    const float offset = normal.dot(triangles[first].points[0]);
    std::vector<int> piece = {static_cast<int>(first)};
    taken[first] = 1;
    for (size_t i = 0; i < piece.size(); ++i) {
      for (const int next : neighbours.of(piece[i])) {
        if (taken[next] || !lies_in(triangles[next], normal, offset)) continue;
        taken[next] = 1;
        piece.push_back(next);
      }
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

// The direction of the piece's longest side. Sides at right angles win over diagonals: a rectangle
// is spanned by its legs.
Vector3f main_direction(const std::vector<LoadedTriangle>& triangles, const std::vector<int>& piece,
                        const Vector3f& normal) {
  Vector3f best = Vector3f::Zero();
  float best_score = -1;
  for (const int t : piece) {
    for (size_t i = 0; i < 3; ++i) {
      const auto& p = triangles[t].points;
      const Vector3f side = p[(i + 1) % 3] - p[i], next = p[(i + 2) % 3] - p[(i + 1) % 3];
      const float lengths = side.norm() * next.norm();
      const bool right_angle = std::abs(side.dot(next)) < 0.02f * lengths;
      const float score = side.norm() * (right_angle ? 3.0f : 1.0f);
      if (score > best_score) best_score = score, best = side;
    }
  }
  return (best - normal.dot(best) * normal).normalized();
}

// The plane's bounding rectangle, as the surface's corners; `right` and `down` with the normal
// towards the viewer.
struct Rectangle {
  Vector3f corner, right, down;  // right and down are its sides
  Vector2f light_uv(const Vector3f& point) const {
    const auto part = [&](const Vector3f& side) {
      const float squared = side.squaredNorm();
      return squared > 0 ? std::clamp((point - corner).dot(side) / squared, 0.0f, 1.0f) : 0.0f;
    };
    return {part(right), part(down)};
  }
};

Rectangle rectangle_of(const std::vector<LoadedTriangle>& triangles,
                       const std::vector<int>& piece) {
  const Vector3f normal = triangles[piece[0]].normal();
  const Vector3f right = main_direction(triangles, piece, normal);
  const Vector3f down = right.cross(normal);
  const Vector3f& origin = triangles[piece[0]].points[0];
  Vector2f low(0, 0), high(0, 0);
  for (const int t : piece) {
    for (const Vector3f& p : triangles[t].points) {
      const Vector2f at((p - origin).dot(right), (p - origin).dot(down));
      low = low.cwiseMin(at), high = high.cwiseMax(at);
    }
  }
  return {origin + low.x() * right + low.y() * down, (high.x() - low.x()) * right,
          (high.y() - low.y()) * down};
}

// Texture coordinates near zero, so that they fit the camera's fixed-point arithmetic; a triangle
// with more repeats than that shows one colour.
std::array<Vector2f, 3> tame(const std::array<Vector2f, 3>& uvs, bool tiled) {
  constexpr float kMost = 1000;
  std::array<Vector2f, 3> out{Vector2f::Zero(), Vector2f::Zero(), Vector2f::Zero()};
  const bool finite = uvs[0].allFinite() && uvs[1].allFinite() && uvs[2].allFinite();
  if (!finite) return out;
  const Vector2f low = uvs[0].cwiseMin(uvs[1]).cwiseMin(uvs[2]);
  const Vector2f high = uvs[0].cwiseMax(uvs[1]).cwiseMax(uvs[2]);
  if ((high - low).maxCoeff() > kMost || low.cwiseAbs().maxCoeff() > 1e6f) return out;
  if (!tiled && low.cwiseAbs().maxCoeff() < kMost) return uvs;
  const Vector2f whole(std::floor(low.x()), std::floor(low.y()));
  for (size_t i = 0; i < 3; ++i) out[i] = uvs[i] - whole;
  return out;
}

}  // namespace

void add_loaded_mesh(Scene& scene, const LoadedMesh& mesh, float light_step_m) {
  const TextureLevel white{
      1, 1, {pack_texel(255 / kLightMapRange, 255 / kLightMapRange, 255 / kLightMapRange)}};
  for (const std::vector<int>& piece : flat_pieces(mesh.triangles)) {
    const Rectangle r = rectangle_of(mesh.triangles, piece);
    const Vector3f normal = mesh.triangles[piece[0]].normal();
    const int surface = static_cast<int>(scene.surfaces.size());
    scene.surfaces.push_back(
        {mesh.name,
         {.texture = mesh.texture, .light_step_m = light_step_m},
         {r.corner, r.corner + r.right, r.corner + r.right + r.down, r.corner + r.down},
         normal,
         normal,
         white});
    for (const int t : piece) {
      const LoadedTriangle& triangle = mesh.triangles[t];
      const auto uvs = tame(triangle.uvs, scene.textures[mesh.texture].tiled);
      const int first = static_cast<int>(scene.vertices.size());
      for (size_t i = 0; i < 3; ++i) {
        scene.vertices.push_back({triangle.points[i], uvs[i], r.light_uv(triangle.points[i])});
      }
      scene.triangles.push_back({{first, first + 1, first + 2}, surface});
    }
  }
}

}  // namespace foresight::sim
