#include "procs/mesher/isosurface.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "common/check.h"
#include "procs/mesher/confidence.h"

namespace foresight {
namespace {

/// Half-edge 3t + j is the side of triangle t from its corner j to corner j + 1; the same number
/// names that corner. Triangles are facets of carved cells, seen from inside the cell.
class Extractor {
 public:
  Extractor(const CellComplex& complex, const std::vector<uint8_t>& carved)
      : complex_(complex), carved_(carved) {}

  Isosurface run(ManifoldRepair repair) {
    FORESIGHT_CHECK(carved_.size() == static_cast<size_t>(complex_.cell_limit()));
    collect_facets();
    mesh_vertices_.assign(3 * facets_.size(), -1);
    if (repair == ManifoldRepair::kSplit) {
      find_mates();
      number_fans();
      split_doubled_edges();
    } else {
      number_points();
    }
    write_triangles();
    return std::move(result_);
  }

 private:
  static size_t index(int32_t i) { return static_cast<size_t>(i); }
  static int32_t next(int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  int32_t half_edge_count() const { return static_cast<int32_t>(3 * facets_.size()); }
  bool carved(int32_t slot) const { return slot >= 0 && carved_[index(slot / 4)] != 0; }

  /// The slot, in the triangle's cell, of the corner that half-edge h starts from.
  int32_t corner_slot(int32_t h) const {
    const int32_t facet = facets_[index(h / 3)];
    const auto& outward = kFacetCorners[index(facet % 4)];
    return facet - facet % 4 + outward[index(2 - h % 3)];
  }
  int32_t point(int32_t h) const { return complex_.vertex(corner_slot(h)); }
  int32_t mesh_vertex(int32_t h) const { return mesh_vertices_[index(h)]; }

  void collect_facets();
  void find_mates();
  int32_t find_mate(int32_t h) const;
  void number_points();
  void number_fans();
  void number_fan(int32_t first);
  int32_t add_vertex(int32_t point);
  void split_doubled_edges();
  void split_edge(int32_t h);
  void write_triangles();
  void write_split_triangle(int32_t t);

  const CellComplex& complex_;
  const std::vector<uint8_t>& carved_;
  std::vector<int32_t> facets_;              // by triangle: its slot in the complex
  std::vector<int32_t> triangle_by_slot_;    // of the complex
  std::vector<int32_t> mates_;               // by half-edge: the same edge in the next triangle
  std::vector<int32_t> mesh_vertices_;       // by half-edge: the mesh vertex at its start
  std::vector<int32_t> midpoints_;           // by half-edge: a mesh vertex, or −1; empty if none
  std::vector<int32_t> fan_seen_;            // by point: the last fan that met it …
  std::vector<int32_t> fan_seen_half_edge_;  // … and through which half-edge
  std::vector<int32_t> doubled_;             // half-edges whose end their fan meets repeatedly
  Isosurface result_;
};

void Extractor::collect_facets() {
  const int32_t slots = 4 * complex_.cell_limit();
  for (int32_t slot = 0; slot < slots; ++slot) {
    if (carved(slot) && !carved(complex_.twin(slot))) facets_.push_back(slot);
  }
}

int32_t Extractor::add_vertex(int32_t point) {
  Mesh& mesh = result_.mesh;
  mesh.vertices_in_map.push_back(complex_.position_in_map(point));
  mesh.vertex_ids.push_back(complex_.vertex_id(point));
  mesh.confidences.push_back(
      complex_.vertex_id(point).is_point() ? confidence_of(complex_.evidence(point)) : 0.0f);
  return static_cast<int32_t>(mesh.vertex_ids.size()) - 1;
}

void Extractor::number_points() {
  std::vector<int32_t> by_point(index(complex_.vertex_limit()), -1);
  for (int32_t h = 0; h < half_edge_count(); ++h) {
    int32_t& vertex = by_point[index(point(h))];
    if (vertex < 0) vertex = add_vertex(point(h));
    mesh_vertices_[index(h)] = vertex;
  }
}

// ---- Mates: which triangle continues the surface beyond an edge ---------------------------------

void Extractor::find_mates() {
  triangle_by_slot_.assign(4 * carved_.size(), -1);
  for (size_t t = 0; t < facets_.size(); ++t) {
    triangle_by_slot_[index(facets_[t])] = static_cast<int32_t>(t);
  }
  mates_.assign(3 * facets_.size(), -1);
  for (int32_t h = 0; h < half_edge_count(); ++h) {
    if (mates_[index(h)] >= 0) continue;
    const int32_t mate = find_mate(h);
    mates_[index(h)] = mate;
    mates_[index(mate)] = h;
  }
}

/// Turns about the edge through carved cells until the next surface facet. Where several sheets
/// share an edge this pairs those that bound the same carved wedge.
int32_t Extractor::find_mate(int32_t h) const {
  int32_t facet = facets_[index(h / 3)];
  int32_t side = corner_slot(next(next(h)));  // the corner off the edge: we leave opposite to it
  const int32_t end = point(next(h));
  while (carved(complex_.twin(side))) {
    // The old facet's opposite corner is, seen from the next cell, the one off the edge.
    const int32_t pivot = complex_.vertex(facet);
    facet = complex_.twin(side);
    side = facet - facet % 4;
    while (complex_.vertex(side) != pivot) ++side;
  }
  int32_t mate = 3 * triangle_by_slot_[index(side)];
  while (point(mate) != end) ++mate;
  return mate;
}

// ---- Fans: one mesh vertex for every closed ring of triangles around a point --------------------

void Extractor::number_fans() {
  fan_seen_.assign(index(complex_.vertex_limit()), -1);
  fan_seen_half_edge_.assign(index(complex_.vertex_limit()), -1);
  std::vector<uint8_t> used(index(complex_.vertex_limit()), 0);
  for (int32_t h = 0; h < half_edge_count(); ++h) {
    if (mesh_vertex(h) >= 0) continue;
    if (used[index(point(h))]++ != 0) {
      ++result_.split_vertices;
      used[index(point(h))] = 1;
    }
    number_fan(h);
  }
}

void Extractor::number_fan(int32_t first) {
  const int32_t fan = add_vertex(point(first));
  int32_t h = first;
  do {
    mesh_vertices_[index(h)] = fan;
    const size_t end = index(point(next(h)));
    if (fan_seen_[end] == fan) {
      doubled_.push_back(fan_seen_half_edge_[end]);
      doubled_.push_back(h);
    }
    fan_seen_[end] = fan;
    fan_seen_half_edge_[end] = h;
    h = next(mates_[index(h)]);
  } while (h != first);
}

// ---- Edges that one pair of fans shares more than once ------------------------------------------

/// Both ends' fans pass such an edge twice, so splitting vertices cannot take its sheets apart. All
/// pairs of triangles but the first get a vertex of their own in the middle of the edge.
void Extractor::split_doubled_edges() {
  const auto ends = [&](int32_t h) { return std::pair(mesh_vertex(h), mesh_vertex(next(h))); };
  std::erase_if(doubled_, [&](int32_t h) { return ends(h).first > ends(h).second; });
  std::sort(doubled_.begin(), doubled_.end(),
            [&](int32_t a, int32_t b) { return std::pair(ends(a), a) < std::pair(ends(b), b); });
  doubled_.erase(std::unique(doubled_.begin(), doubled_.end()), doubled_.end());
  for (size_t i = 1; i < doubled_.size(); ++i) {
    if (ends(doubled_[i - 1]) == ends(doubled_[i])) split_edge(doubled_[i]);
  }
}

void Extractor::split_edge(int32_t h) {
  if (midpoints_.empty()) midpoints_.assign(index(half_edge_count()), -1);
  Mesh& mesh = result_.mesh;
  const size_t a = index(mesh_vertex(h)), b = index(mesh_vertex(next(h)));
  midpoints_[index(h)] = midpoints_[index(mates_[index(h)])] =
      static_cast<int32_t>(mesh.vertex_ids.size());
  mesh.vertices_in_map.push_back((mesh.vertices_in_map[a] + mesh.vertices_in_map[b]) / 2);
  mesh.vertex_ids.push_back(std::min(mesh.vertex_ids[a], mesh.vertex_ids[b]));
  mesh.confidences.push_back(std::min(mesh.confidences[a], mesh.confidences[b]));
  ++result_.split_edges;
}

void Extractor::write_triangles() {
  result_.mesh.triangles.reserve(facets_.size() + 2 * static_cast<size_t>(result_.split_edges));
  for (int32_t h = 0; h < half_edge_count(); h += 3) {
    if (!midpoints_.empty()) {
      write_split_triangle(h);
    } else {
      result_.mesh.triangles.push_back({mesh_vertex(h), mesh_vertex(h + 1), mesh_vertex(h + 2)});
    }
  }
}

/// Fans the polygon of corners and midpoints out from a midpoint, if there is one: then each inner
/// edge ends in a vertex that only this triangle and its mate know.
void Extractor::write_split_triangle(int32_t h) {
  std::array<int32_t, 6> polygon{};
  size_t size = 0, apex = 0;
  for (int32_t j = 0; j < 3; ++j) {
    polygon[size++] = mesh_vertex(h + j);
    const int32_t midpoint = midpoints_[index(h + j)];
    if (midpoint < 0) continue;
    apex = size;
    polygon[size++] = midpoint;
  }
  for (size_t i = 1; i + 1 < size; ++i) {
    result_.mesh.triangles.push_back(
        {polygon[apex], polygon[(apex + i) % size], polygon[(apex + i + 1) % size]});
  }
}

}  // namespace

Isosurface extract_isosurface(const CellComplex& complex, const std::vector<uint8_t>& carved,
                              ManifoldRepair repair) {
  return Extractor(complex, carved).run(repair);
}

}  // namespace foresight
