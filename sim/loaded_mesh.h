// Triangles on their way from a scene file into a Scene.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/scene.h"

namespace foresight::sim {

struct LoadedTriangle {
  std::array<Eigen::Vector3f, 3> points;
  std::array<Eigen::Vector2f, 3> uvs;  // (0, 0) is the texture's upper left corner
  Eigen::Vector3f normal() const {
    return (points[1] - points[0]).cross(points[2] - points[0]).normalized();
  }
  float area_m2() const { return (points[1] - points[0]).cross(points[2] - points[0]).norm() / 2; }
};

/// Triangles with one texture.
struct LoadedMesh {
  std::string name;
  int texture = 0;
  std::vector<LoadedTriangle> triangles;
};

/// Adds the mesh in flat pieces that hang together, one surface each, so that each can have a light
/// map and its border can be antialiased. A piece lies within 1 mm of its plane.
void add_loaded_mesh(Scene& scene, const LoadedMesh& mesh, float light_step_m);

}  // namespace foresight::sim
