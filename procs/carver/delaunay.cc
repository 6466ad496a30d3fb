#include "procs/carver/delaunay.h"

#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <numeric>
#include <string>

#include "common/check.h"
#include "procs/carver/cgal_delaunay.h"
#include "procs/carver/grow.h"
#include "procs/carver/vertex_removal.h"

namespace foresight::carving {
namespace {

Kernel::Point_3 to_cgal(const Point3& p) { return {p[0], p[1], p[2]}; }

CellId finite_or_none(CellHandle cell) {
  const CellId id = cell->info().id;
  return id == kOutside ? CellId() : id;
}

}  // namespace

struct Delaunay::Cgal {
  Triangulation triangulation;
  IdVector<CellId, CellHandle> cells;
  IdVector<VertexIndex, VertexHandle> vertices;
  std::vector<CellHandle> outside;  // the infinite cells
  std::vector<CellHandle> queue;
  CellHandle hint;
  VertexRemoval removal;

  void number_new_cell(CellHandle cell, Delaunay& owner);
};

Delaunay::Delaunay() : cgal_(std::make_unique<Cgal>()) {}
Delaunay::~Delaunay() = default;

void Delaunay::clear() {
  cgal_ = std::make_unique<Cgal>();
  tetrahedra_ = Tetrahedra{};
  change_ = TriangulationChange{};
  free_cells_.clear();
  built_ = false;
}

std::vector<size_t> Delaunay::spatial_order(std::span<const VertexSite> sites) {
  if (sites.empty()) return {};  // CGAL takes the address of the first
  std::vector<Kernel::Point_3> points;
  points.reserve(sites.size());
  for (const VertexSite& site : sites) points.push_back(to_cgal(site.position));
  std::vector<size_t> order(sites.size());
  std::iota(order.begin(), order.end(), size_t{0});
  using Map = CGAL::Pointer_property_map<Kernel::Point_3>::const_type;
  const Map map = CGAL::make_property_map(std::as_const(points));
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_3<Kernel, Map>(map));
  return order;
}

void Delaunay::build(const std::array<Point3, 8>& corners, std::span<const VertexSite> sites) {
  clear();
  Cgal& cgal = *cgal_;
  VertexIndex limit = kFirstPoint;
  for (const VertexSite& site : sites) limit = std::max(limit, site.vertex.next());
  cgal.vertices.resize(limit.index());
  tetrahedra_.positions.resize(limit.index());
  const auto add = [&](VertexIndex vertex, const Point3& position) {
    const VertexHandle handle = cgal.triangulation.insert(to_cgal(position), cgal.hint);
    handle->info() = vertex;
    cgal.vertices[vertex] = handle;
    tetrahedra_.positions[vertex] = position;
    cgal.hint = handle->cell();
  };
  for (size_t n = 0; n < corners.size(); ++n) add(VertexIndex::at(n), corners[n]);
  for (const size_t n : spatial_order(sites)) add(sites[n].vertex, sites[n].position);
  FORESIGHT_CHECK(cgal.triangulation.number_of_vertices() == sites.size() + corners.size());
  cgal.triangulation.incident_cells(cgal.triangulation.infinite_vertex(),
                                    std::back_inserter(cgal.outside));
  for (const CellHandle cell : cgal.outside) cell->info().id = kOutside;
  built_ = true;
  seed_new_cells();
  fill_created();
}

VertexIndex Delaunay::insert(const VertexSite& site) {
  Cgal& cgal = *cgal_;
  Triangulation& t = cgal.triangulation;
  const Kernel::Point_3 point = to_cgal(site.position);
  Triangulation::Locate_type type;
  int i = 0, j = 0;
  const CellHandle cell = t.locate(point, type, i, j, cgal.hint);
  if (type == Triangulation::VERTEX) return cell->vertex(i)->info();
  FORESIGHT_CHECK(type != Triangulation::OUTSIDE_CONVEX_HULL);
  std::vector<CellHandle> conflicts;
  Triangulation::Facet border;
  t.find_conflicts(point, cell, CGAL::Oneset_iterator<Triangulation::Facet>(border),
                   std::back_inserter(conflicts));
  for (const CellHandle conflict : conflicts) {
    if (conflict->info().id.is_valid()) change_.destroyed.push_back(conflict->info().id);
  }
  const VertexHandle handle =
      t.insert_in_hole(point, conflicts.begin(), conflicts.end(), border.first, border.second);
  handle->info() = site.vertex;
  cgal.vertices.grow_to(site.vertex);
  tetrahedra_.positions.grow_to(site.vertex);
  cgal.vertices[site.vertex] = handle;
  tetrahedra_.positions[site.vertex] = site.position;
  cgal.hint = handle->cell();
  return {};
}

void Delaunay::remove(VertexIndex vertex) {
  Cgal& cgal = *cgal_;
  const VertexHandle handle = cgal.vertices[vertex];
  std::vector<CellHandle> star;
  cgal.triangulation.incident_cells(handle, std::back_inserter(star));
  for (const CellHandle cell : star) {
    if (cell->info().id.is_valid()) change_.destroyed.push_back(cell->info().id);
  }
  if (!cgal.removal.remove(cgal.triangulation, handle, star)) cgal.triangulation.remove(handle);
  cgal.vertices[vertex] = VertexHandle();
  cgal.hint = cgal.outside.front();
}

const TriangulationChange& Delaunay::commit() {
  for (const CellId id : change_.destroyed) {
    tetrahedra_.states[id] = CellState::kDestroyed;
  }
  seed_new_cells();
  fill_created();
  find_entries();
  return change_;
}

// Numbers a cell that has no number yet and queues it.
void Delaunay::Cgal::number_new_cell(CellHandle cell, Delaunay& owner) {
  if (cell->info().id != kUnnumbered) return;
  CellId id;
  if (owner.free_cells_.empty()) {
    id = add_one(owner.tetrahedra_.cells);
    add_one(owner.tetrahedra_.states);
    add_one(cells);
  } else {
    id = owner.free_cells_.back();
    owner.free_cells_.pop_back();
  }
  cell->info().id = id;
  owner.tetrahedra_.states[id] = CellState::kNew;
  cells[id] = cell;
  owner.change_.created.push_back(id);
  queue.push_back(cell);
}

// Floods the changed regions from the facets they share with what stayed.
void Delaunay::seed_new_cells() {
  for (const CellHandle cell : cgal_->outside) {
    const int facet = cell->index(cgal_->triangulation.infinite_vertex());
    cgal_->number_new_cell(cell->neighbor(facet), *this);
  }
  for (const CellId id : change_.destroyed) {
    const Cell cell = tetrahedra_.cells[id];  // a copy: the vector may grow
    for (const CellId neighbor : cell.neighbors) {
      if (!neighbor.is_valid()) continue;
      if (tetrahedra_.states[neighbor] != CellState::kKept) continue;
      const int facet = index_of(tetrahedra_.cells[neighbor].neighbors, id);
      const CellHandle inner = cgal_->cells[neighbor]->neighbor(facet);
      cgal_->number_new_cell(inner, *this);
    }
  }
  for (size_t n = 0; n < cgal_->queue.size(); ++n) {
    const CellHandle cell = cgal_->queue[n];
    for (int i = 0; i < 4; ++i) cgal_->number_new_cell(cell->neighbor(i), *this);
  }
  cgal_->queue.clear();
}

void Delaunay::fill_created() {
  for (const CellId id : change_.created) {
    const CellHandle handle = cgal_->cells[id];
    Cell& cell = tetrahedra_.cells[id];
    for (int i = 0; i < 4; ++i) {
      cell.vertices[i] = handle->vertex(i)->info();
      cell.neighbors[i] = finite_or_none(handle->neighbor(i));
    }
  }
}

void Delaunay::find_entries() {
  change_.entries.assign(change_.destroyed.size(), {});
  for (size_t n = 0; n < change_.destroyed.size(); ++n) {
    const CellId id = change_.destroyed[n];
    for (size_t facet = 0; facet < 4; ++facet) {
      const CellId kept = tetrahedra_.cells[id].neighbors[facet];
      if (!kept.is_valid() || tetrahedra_.states[kept] != CellState::kKept) continue;
      Cell& outer = tetrahedra_.cells[kept];
      const int mirror = index_of(outer.neighbors, id);
      const CellHandle handle = cgal_->cells[kept];
      const CellHandle inner = handle->neighbor(mirror);
      change_.entries[n][facet] = {inner->info().id, inner->index(handle)};
      outer.neighbors[mirror] = inner->info().id;
    }
  }
}

void Delaunay::finish() {
  for (const CellId id : change_.created) {
    tetrahedra_.states[id] = CellState::kKept;
  }
  for (const CellId id : change_.destroyed) {
    tetrahedra_.states[id] = CellState::kFree;
    free_cells_.push_back(id);
  }
  change_.destroyed.clear();
  change_.entries.clear();
  change_.created.clear();
}

std::string Delaunay::validate() const {
  if (!built_) return "";
  const Triangulation& t = cgal_->triangulation;
  if (!t.is_valid()) return "the triangulation is not Delaunay";
  std::ptrdiff_t finite = 0;
  for (const CellHandle cell : t.finite_cell_handles()) {
    ++finite;
    const CellId id = cell->info().id;
    const std::string name = "cell " + std::to_string(id.value());
    if (!tetrahedra_.cells.contains(id)) return name + ": bad id";
    if (tetrahedra_.states[id] != CellState::kKept) return name + ": not kept";
    const Cell& mine = tetrahedra_.cells[id];
    for (int i = 0; i < 4; ++i) {
      const VertexIndex vertex = mine.vertices[i];
      if (vertex != cell->vertex(i)->info()) return name + ": wrong vertex";
      if (to_cgal(tetrahedra_.positions[vertex]) != cell->vertex(i)->point()) {
        return name + ": wrong position";
      }
      if (mine.neighbors[i] != finite_or_none(cell->neighbor(i))) {
        return name + ": wrong neighbour";
      }
    }
  }
  const auto kept =
      std::count(tetrahedra_.states.begin(), tetrahedra_.states.end(), CellState::kKept);
  return kept == finite ? "" : "stale cells";
}

size_t Delaunay::memory_bytes() const {
  const Triangulation& t = cgal_->triangulation;
  return t.number_of_vertices() * sizeof(Triangulation::Vertex) +
         t.tds().number_of_cells() * sizeof(Triangulation::Cell) +
         tetrahedra_.cells.capacity() * (sizeof(Cell) + sizeof(CellState) + sizeof(CellHandle)) +
         tetrahedra_.positions.capacity() * (sizeof(Point3) + sizeof(VertexHandle));
}

}  // namespace foresight::carving
