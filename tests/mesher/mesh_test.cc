#include "common/mesh.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/common/plain_ids.h"

namespace foresight {
namespace {

Mesh tetrahedron() {
  Mesh mesh;
  mesh.vertices_in_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.vertex_ids = ids<VertexId>({7, -3, 1234567, 0});
  mesh.confidences = {0.5f, 0, 1, 0.25f};
  mesh.triangles = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  return mesh;
}

TEST(Mesh, ClosedMeshHasNoDefects) {
  const MeshDefects defects = find_defects(tetrahedron());
  EXPECT_TRUE(defects.closed_and_oriented());
  EXPECT_EQ(defects.non_manifold_edges, 0);
  EXPECT_TRUE(find_defects(Mesh{}).closed_and_oriented());
}

TEST(Mesh, FindsHoles) {
  Mesh mesh = tetrahedron();
  mesh.triangles.pop_back();
  const MeshDefects defects = find_defects(mesh);
  EXPECT_EQ(defects.boundary_edges, 3);
  EXPECT_EQ(defects.misoriented_edges, 0);
  EXPECT_FALSE(defects.closed_and_oriented());
}

TEST(Mesh, FindsTurnedTriangles) {
  Mesh mesh = tetrahedron();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  const MeshDefects defects = find_defects(mesh);
  EXPECT_EQ(defects.misoriented_edges, 3);
  EXPECT_FALSE(defects.closed_and_oriented());
}

TEST(Mesh, FindsNonManifoldEdges) {
  Mesh mesh = tetrahedron();
  mesh.vertices_in_map.insert(mesh.vertices_in_map.end(), {{-1, 0, 0}, {0, -1, 0}});
  mesh.vertex_ids.insert(mesh.vertex_ids.end(), {VertexId(4), VertexId(5)});
  // A second tetrahedron on the edge from 0 to 3.
  for (const auto& t : tetrahedron().triangles) {
    std::array<int32_t, 3> other{};
    for (size_t j = 0; j < 3; ++j) other[j] = t[j] == 1 ? 4 : t[j] == 2 ? 5 : t[j];
    mesh.triangles.push_back(other);
  }
  const MeshDefects defects = find_defects(mesh);
  EXPECT_EQ(defects.non_manifold_edges, 1);
  EXPECT_TRUE(defects.closed_and_oriented());
}

TEST(Mesh, FindsBadIndices) {
  for (const std::array<int32_t, 3> bad :
       {std::array<int32_t, 3>{0, 1, 4}, {0, -1, 2}, {0, 1, 1}, {2147483647, 0, 1}}) {
    Mesh mesh = tetrahedron();
    mesh.triangles.push_back(bad);
    EXPECT_EQ(find_defects(mesh).bad_indices, 1);
    EXPECT_FALSE(find_defects(mesh).closed_and_oriented());
  }
}

/// Reads just what write_ply promises to write.
Mesh read_ply(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Mesh mesh;
  std::string line, header;
  size_t vertices = 0, faces = 0;
  while (std::getline(file, line) && line != "end_header") {
    std::sscanf(line.c_str(), "element vertex %zu", &vertices);
    std::sscanf(line.c_str(), "element face %zu", &faces);
    header += line + "\n";
  }
  EXPECT_EQ(header.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0u);
  const auto read = [&](auto& value) { file.read(reinterpret_cast<char*>(&value), sizeof value); };
  for (size_t i = 0; i < vertices && file; ++i) {
    Eigen::Vector3f p;
    int32_t id = 0;
    float confidence = 0;
    read(p.x()), read(p.y()), read(p.z()), read(id), read(confidence);
    mesh.confidences.push_back(confidence);
    mesh.vertices_in_map.push_back(p);
    mesh.vertex_ids.emplace_back(id);
  }
  for (size_t i = 0; i < faces && file; ++i) {
    uint8_t corners = 0;
    std::array<int32_t, 3> triangle{};
    read(corners), read(triangle);
    EXPECT_EQ(corners, 3);
    mesh.triangles.push_back(triangle);
  }
  EXPECT_TRUE(file.good());
  EXPECT_EQ(file.peek(), std::ifstream::traits_type::eof());
  return mesh;
}

TEST(Mesh, PlyRoundTrip) {
  const auto path = std::filesystem::path(testing::TempDir()) / "foresight_mesh_test.ply";
  for (const Mesh& mesh : {tetrahedron(), Mesh{}}) {
    const auto error = write_ply(mesh, path.string());
    ASSERT_FALSE(error) << *error;
    const Mesh read = read_ply(path.string());
    EXPECT_TRUE(read.vertices_in_map == mesh.vertices_in_map);
    EXPECT_EQ(read.vertex_ids, mesh.vertex_ids);
    EXPECT_EQ(read.confidences, mesh.confidences);
    EXPECT_EQ(read.triangles, mesh.triangles);
  }
  std::filesystem::remove(path);
}

TEST(Mesh, PlyFailuresNameTheFile) {
  const std::string path = testing::TempDir() + "/no/such/folder/mesh.ply";
  const auto error = write_ply(tetrahedron(), path);
  ASSERT_TRUE(error);
  EXPECT_NE(error->find(path), std::string::npos);
  Mesh inconsistent = tetrahedron();
  inconsistent.vertex_ids.pop_back();
  EXPECT_TRUE(write_ply(inconsistent, testing::TempDir() + "/never_written.ply"));
  inconsistent = tetrahedron();
  inconsistent.confidences.pop_back();
  EXPECT_TRUE(write_ply(inconsistent, testing::TempDir() + "/never_written.ply"));
  EXPECT_FALSE(std::filesystem::exists(testing::TempDir() + "/never_written.ply"));
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_TRUE(write_ply(tetrahedron(), "/dev/full"));
  }
}

}  // namespace
}  // namespace foresight
