#include "common/mesh.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <type_traits>

namespace foresight {
namespace {

bool has_bad_index(const std::array<int32_t, 3>& triangle, size_t vertex_count) {
  for (const int32_t v : triangle) {
    if (v < 0 || static_cast<size_t>(v) >= vertex_count) return true;
  }
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

/// Every side of every triangle: its two vertices in ascending order, then 1 if it runs downwards.
std::vector<std::array<int32_t, 3>> sorted_sides(const Mesh& mesh, int64_t* bad_indices) {
  std::vector<std::array<int32_t, 3>> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    if (has_bad_index(triangle, mesh.vertices_in_map.size())) {
      ++*bad_indices;
      continue;
    }
    for (size_t j = 0; j < 3; ++j) {
      const int32_t a = triangle[j], b = triangle[(j + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), a > b ? 1 : 0});
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

template <typename T>
void append(T value, std::vector<char>* bytes) {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(std::endian::native == std::endian::little);
  const size_t end = bytes->size();
  bytes->resize(end + sizeof value);
  std::memcpy(bytes->data() + end, &value, sizeof value);
}

std::string ply_header(const Mesh& mesh) {
  return "ply\nformat binary_little_endian 1.0\nelement vertex " +
         std::to_string(mesh.vertices_in_map.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty int id\nproperty float "
         "confidence\nelement face " +
         std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::vector<char> to_ply(const Mesh& mesh) {
  const std::string header = ply_header(mesh);
  std::vector<char> bytes(header.begin(), header.end());
  bytes.reserve(header.size() + 20 * mesh.vertices_in_map.size() + 13 * mesh.triangles.size());
  for (size_t i = 0; i < mesh.vertices_in_map.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(mesh.vertices_in_map[i][k], &bytes);
    append(mesh.vertex_ids[i].value(), &bytes);
    append(mesh.confidences[i], &bytes);
  }
  for (const auto& triangle : mesh.triangles) {
    append(uint8_t{3}, &bytes);
    for (const int32_t v : triangle) append(v, &bytes);
  }
  return bytes;
}

}  // namespace

MeshDefects find_defects(const Mesh& mesh) {
  MeshDefects defects;
  const auto sides = sorted_sides(mesh, &defects.bad_indices);
  for (size_t i = 0; i < sides.size();) {
    std::array<int64_t, 2> count{};
    const size_t first = i;
    for (; i < sides.size() && sides[i][0] == sides[first][0] && sides[i][1] == sides[first][1];
         ++i) {
      ++count[static_cast<size_t>(sides[i][2])];
    }
    const auto [less, more] = std::minmax(count[0], count[1]);
    if (less == 0) ++defects.boundary_edges;
    if (less + more > 2) ++defects.non_manifold_edges;
    if (more > std::max<int64_t>(less, 1)) ++defects.misoriented_edges;
  }
  return defects;
}

std::optional<std::string> write_ply(const Mesh& mesh, const std::string& path) {
  if (mesh.vertex_ids.size() != mesh.vertices_in_map.size()) {
    return path + ": not written: " + std::to_string(mesh.vertices_in_map.size()) +
           " vertices but " + std::to_string(mesh.vertex_ids.size()) + " vertex ids";
  }
  if (mesh.confidences.size() != mesh.vertices_in_map.size()) {
    return path + ": not written: " + std::to_string(mesh.vertices_in_map.size()) +
           " vertices but " + std::to_string(mesh.confidences.size()) + " confidences";
  }
  const auto failure = [&](const char* what) {
    return path + ": " + what + ": " + std::generic_category().message(errno);
  };
  const std::vector<char> bytes = to_ply(mesh);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return failure("cannot open for writing");
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const int write_error = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = write_error;
  if (!written || !closed) return failure("cannot write");
  return std::nullopt;
}

}  // namespace foresight
