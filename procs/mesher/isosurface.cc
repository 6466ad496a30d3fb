#include "procs/mesher/isosurface.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "common/check.h"
#include "procs/mesher/confidence.h"

namespace foresight {
namespace {

/// Of the mesh that is made.
using MeshVertex = Id<struct MeshVertexTag>;
using Triangle = Id<struct MeshTriangleTag>;
/// Number 3t + j is the side of triangle t from its corner j to corner j + 1; the same number names
/// that corner. Triangles are facets of carved cells, seen from inside the cell.
using HalfEdge = Id<struct HalfEdgeTag>;

constexpr HalfEdge half_edge_of(Triangle t, int32_t j) { return HalfEdge(3 * t.value() + j); }
constexpr Triangle triangle_of(HalfEdge h) { return Triangle(h.value() / 3); }
constexpr int32_t place_of(HalfEdge h) { return h.value() % 3; }
/// The next side of the same triangle.
constexpr HalfEdge next(HalfEdge h) { return HalfEdge(h.value() + (place_of(h) == 2 ? -2 : 1)); }

class Extractor {
 public:
  Extractor(const CellComplex& complex, const IdVector<CellId, uint8_t>& carved)
      : complex_(complex), carved_(carved) {}

  Isosurface run(ManifoldRepair repair) {
    FORESIGHT_CHECK(carved_.limit() == complex_.cell_limit());
    collect_facets();
    mesh_vertices_.resize(3 * facets_.size());
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
  IdRange<HalfEdge> half_edges() const { return mesh_vertices_.ids(); }
  bool carved(Slot slot) const { return slot.is_valid() && carved_[cell_of(slot)] != 0; }

  /// The slot, in the triangle's cell, of the corner that half-edge h starts from.
  Slot corner_slot(HalfEdge h) const {
    const Slot facet = facets_[triangle_of(h)];
    const auto& outward = kFacetCorners[corner_of(facet)];
    return slot_of(cell_of(facet), outward[2 - place_of(h)]);
  }
  VertexIndex point(HalfEdge h) const { return complex_.vertex(corner_slot(h)); }
  MeshVertex mesh_vertex(HalfEdge h) const { return mesh_vertices_[h]; }

  void collect_facets();
  void find_mates();
  HalfEdge find_mate(HalfEdge h) const;
  void number_points();
  void number_fans();
  void number_fan(HalfEdge first);
  MeshVertex add_vertex(VertexIndex point);
  MeshVertex push_vertex(const Eigen::Vector3f& position, VertexId id, float confidence);
  void split_doubled_edges();
  void split_edge(HalfEdge h);
  void write_triangles();
  void write_triangle(MeshVertex a, MeshVertex b, MeshVertex c);
  void write_split_triangle(Triangle t);

  const CellComplex& complex_;
  const IdVector<CellId, uint8_t>& carved_;
  IdVector<Triangle, Slot> facets_;  // in the complex
  IdVector<Slot, Triangle> triangle_by_slot_;
  IdVector<HalfEdge, HalfEdge> mates_;                  // the same edge in the next triangle
  IdVector<HalfEdge, MeshVertex> mesh_vertices_;        // at its start
  IdVector<HalfEdge, MeshVertex> midpoints_;            // of some; empty if of none
  IdVector<VertexIndex, MeshVertex> fan_seen_;          // the last fan that met it …
  IdVector<VertexIndex, HalfEdge> fan_seen_half_edge_;  // … and through which half-edge
  std::vector<HalfEdge> doubled_;                       // whose end their fan meets repeatedly
  Isosurface result_;
};

void Extractor::collect_facets() {
  for (const Slot slot : complex_.slots()) {
    if (carved(slot) && !carved(complex_.twin(slot))) facets_.push_back(slot);
  }
}

MeshVertex Extractor::push_vertex(const Eigen::Vector3f& position, VertexId id, float confidence) {
  Mesh& mesh = result_.mesh;
  mesh.vertices_in_map.push_back(position);
  mesh.vertex_ids.push_back(id);
  mesh.confidences.push_back(confidence);
  return MeshVertex::at(mesh.vertex_ids.size() - 1);
}

MeshVertex Extractor::add_vertex(VertexIndex point) {
  const VertexId id = complex_.vertex_id(point);
  const float confidence = id.is_point() ? confidence_of(complex_.evidence(point)) : 0.0f;
  return push_vertex(complex_.position_in_map(point), id, confidence);
}

void Extractor::number_points() {
  IdVector<VertexIndex, MeshVertex> by_point(complex_.vertex_limit().index());
  for (const HalfEdge h : half_edges()) {
    MeshVertex& vertex = by_point[point(h)];
    if (!vertex.is_valid()) vertex = add_vertex(point(h));
    mesh_vertices_[h] = vertex;
  }
}

// ---- Mates: which triangle continues the surface beyond an edge ---------------------------------

void Extractor::find_mates() {
  triangle_by_slot_.resize(4 * carved_.size());
  for (const Triangle t : facets_.ids()) triangle_by_slot_[facets_[t]] = t;
  mates_.resize(3 * facets_.size());
  for (const HalfEdge h : half_edges()) {
    if (mates_[h].is_valid()) continue;
    const HalfEdge mate = find_mate(h);
    mates_[h] = mate;
    mates_[mate] = h;
  }
}

/// Turns about the edge through carved cells until the next surface facet. Where several sheets
/// share an edge this pairs those that bound the same carved wedge.
HalfEdge Extractor::find_mate(HalfEdge h) const {
  Slot facet = facets_[triangle_of(h)];
  Slot side = corner_slot(next(next(h)));  // the corner off the edge: we leave opposite to it
  const VertexIndex end = point(next(h));
  while (carved(complex_.twin(side))) {
    // The old facet's opposite corner is, seen from the next cell, the one off the edge.
    const VertexIndex pivot = complex_.vertex(facet);
    facet = complex_.twin(side);
    side = slot_of(cell_of(facet), 0);
    while (complex_.vertex(side) != pivot) side = side.next();
  }
  HalfEdge mate = half_edge_of(triangle_by_slot_[side], 0);
  while (point(mate) != end) mate = mate.next();
  return mate;
}

// ---- Fans: one mesh vertex for every closed ring of triangles around a point --------------------

void Extractor::number_fans() {
  fan_seen_.resize(complex_.vertex_limit().index());
  fan_seen_half_edge_.resize(complex_.vertex_limit().index());
  IdVector<VertexIndex, uint8_t> used(complex_.vertex_limit().index(), 0);
  for (const HalfEdge h : half_edges()) {
    if (mesh_vertex(h).is_valid()) continue;
    if (used[point(h)]++ != 0) {
      ++result_.split_vertices;
      used[point(h)] = 1;
    }
    number_fan(h);
  }
}

void Extractor::number_fan(HalfEdge first) {
  const MeshVertex fan = add_vertex(point(first));
  HalfEdge h = first;
  do {
    mesh_vertices_[h] = fan;
    const VertexIndex end = point(next(h));
    if (fan_seen_[end] == fan) {
      doubled_.push_back(fan_seen_half_edge_[end]);
      doubled_.push_back(h);
    }
    fan_seen_[end] = fan;
    fan_seen_half_edge_[end] = h;
    h = next(mates_[h]);
  } while (h != first);
}

// ---- Edges that one pair of fans shares more than once ------------------------------------------

/// Both ends' fans pass such an edge twice, so splitting vertices cannot take its sheets apart. All
/// pairs of triangles but the first get a vertex of their own in the middle of the edge.
void Extractor::split_doubled_edges() {
  const auto ends = [&](HalfEdge h) { return std::pair(mesh_vertex(h), mesh_vertex(next(h))); };
  std::erase_if(doubled_, [&](HalfEdge h) { return ends(h).first > ends(h).second; });
  std::sort(doubled_.begin(), doubled_.end(),
            [&](HalfEdge a, HalfEdge b) { return std::pair(ends(a), a) < std::pair(ends(b), b); });
  doubled_.erase(std::unique(doubled_.begin(), doubled_.end()), doubled_.end());
  for (size_t i = 1; i < doubled_.size(); ++i) {
    if (ends(doubled_[i - 1]) == ends(doubled_[i])) split_edge(doubled_[i]);
  }
}

void Extractor::split_edge(HalfEdge h) {
  if (midpoints_.empty()) midpoints_.resize(mesh_vertices_.size());
  const Mesh& mesh = result_.mesh;
  const size_t a = mesh_vertex(h).index(), b = mesh_vertex(next(h)).index();
  midpoints_[h] = midpoints_[mates_[h]] =
      push_vertex((mesh.vertices_in_map[a] + mesh.vertices_in_map[b]) / 2,
                  std::min(mesh.vertex_ids[a], mesh.vertex_ids[b]),
                  std::min(mesh.confidences[a], mesh.confidences[b]));
  ++result_.split_edges;
}

void Extractor::write_triangles() {
  result_.mesh.triangles.reserve(facets_.size() + 2 * result_.split_edges);
  for (const Triangle t : facets_.ids()) {
    if (!midpoints_.empty()) {
      write_split_triangle(t);
    } else {
      write_triangle(mesh_vertex(half_edge_of(t, 0)), mesh_vertex(half_edge_of(t, 1)),
                     mesh_vertex(half_edge_of(t, 2)));
    }
  }
}

void Extractor::write_triangle(MeshVertex a, MeshVertex b, MeshVertex c) {
  result_.mesh.triangles.push_back({a.value(), b.value(), c.value()});
}

/// Fans the polygon of corners and midpoints out from a midpoint, if there is one: then each inner
/// edge ends in a vertex that only this triangle and its mate know.
void Extractor::write_split_triangle(Triangle t) {
  std::array<MeshVertex, 6> polygon{};
  size_t size = 0, apex = 0;
  for (int32_t j = 0; j < 3; ++j) {
    const HalfEdge h = half_edge_of(t, j);
    polygon[size++] = mesh_vertex(h);
    const MeshVertex midpoint = midpoints_[h];
    if (!midpoint.is_valid()) continue;
    apex = size;
    polygon[size++] = midpoint;
  }
  for (size_t i = 1; i + 1 < size; ++i) {
    write_triangle(polygon[apex], polygon[(apex + i) % size], polygon[(apex + i + 1) % size]);
  }
}

}  // namespace

Isosurface extract_isosurface(const CellComplex& complex, const IdVector<CellId, uint8_t>& carved,
                              ManifoldRepair repair) {
  return Extractor(complex, carved).run(repair);
}

}  // namespace foresight
