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

}  // namespace

struct Delaunay::Cgal {
  Triangulation triangulation;
  std::vector<CellHandle> cells;       // by cell id
  std::vector<VertexHandle> vertices;  // by vertex
  std::vector<CellHandle> outside;     // the infinite cells
  std::vector<CellHandle> queue;
  CellHandle hint;
  VertexRemoval removal;

  void number_new_cell(CellHandle cell, Delaunay& owner);
};

Delaunay::Delaunay() : cgal_(std::make_unique<Cgal>()) {}
Delaunay::~Delaunay() = default;

void Delaunay::clear() {
  cgal_ = std::make_unique<Cgal>();
  complex_ = CellComplex{};
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
  size_t vertices = kHullCorners;
  for (const VertexSite& site : sites) {
    vertices = std::max(vertices, static_cast<size_t>(site.vertex) + 1);
  }
  cgal.vertices.resize(vertices);
  complex_.positions.resize(vertices);
  const auto add = [&](size_t vertex, const Point3& position) {
    const VertexHandle handle = cgal.triangulation.insert(to_cgal(position), cgal.hint);
    handle->info() = static_cast<int32_t>(vertex);
    cgal.vertices[vertex] = handle;
    complex_.positions[vertex] = position;
    cgal.hint = handle->cell();
  };
  for (size_t n = 0; n < corners.size(); ++n) add(n, corners[n]);
  for (const size_t n : spatial_order(sites)) {
    add(static_cast<size_t>(sites[n].vertex), sites[n].position);
  }
  FORESIGHT_CHECK(cgal.triangulation.number_of_vertices() == sites.size() + corners.size());
  cgal.triangulation.incident_cells(cgal.triangulation.infinite_vertex(),
                                    std::back_inserter(cgal.outside));
  for (const CellHandle cell : cgal.outside) cell->info().id = kOutside;
  built_ = true;
  seed_new_cells();
  fill_created();
}

int32_t Delaunay::insert(const VertexSite& site) {
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
    if (conflict->info().id >= 0) change_.destroyed.push_back(conflict->info().id);
  }
  const VertexHandle handle =
      t.insert_in_hole(point, conflicts.begin(), conflicts.end(), border.first, border.second);
  handle->info() = site.vertex;
  const auto vertex = static_cast<size_t>(site.vertex);
  if (vertex >= cgal.vertices.size()) cgal.vertices.resize(vertex + 1);
  if (vertex >= complex_.positions.size()) complex_.positions.resize(vertex + 1);
  cgal.vertices[vertex] = handle;
  complex_.positions[vertex] = site.position;
  cgal.hint = handle->cell();
  return -1;
}

void Delaunay::remove(int32_t vertex) {
  Cgal& cgal = *cgal_;
  const VertexHandle handle = cgal.vertices[static_cast<size_t>(vertex)];
  std::vector<CellHandle> star;
  cgal.triangulation.incident_cells(handle, std::back_inserter(star));
  for (const CellHandle cell : star) {
    if (cell->info().id >= 0) change_.destroyed.push_back(cell->info().id);
  }
  if (!cgal.removal.remove(cgal.triangulation, handle, star)) cgal.triangulation.remove(handle);
  cgal.vertices[static_cast<size_t>(vertex)] = VertexHandle();
  cgal.hint = cgal.outside.front();
}

const TriangulationChange& Delaunay::commit() {
  for (const int32_t id : change_.destroyed) {
    complex_.states[static_cast<size_t>(id)] = CellState::kDestroyed;
  }
  seed_new_cells();
  fill_created();
  find_entries();
  return change_;
}

// Numbers a cell that has no number yet and queues it.
void Delaunay::Cgal::number_new_cell(CellHandle cell, Delaunay& owner) {
  if (cell->info().id != kUnnumbered) return;
  int32_t id = static_cast<int32_t>(owner.complex_.cells.size());
  if (owner.free_cells_.empty()) {
    add_one(owner.complex_.cells);
    add_one(owner.complex_.states);
    add_one(cells);
  } else {
    id = owner.free_cells_.back();
    owner.free_cells_.pop_back();
  }
  cell->info().id = id;
  owner.complex_.states[static_cast<size_t>(id)] = CellState::kNew;
  cells[static_cast<size_t>(id)] = cell;
  owner.change_.created.push_back(id);
  queue.push_back(cell);
}

// Floods the changed regions from the facets they share with what stayed.
void Delaunay::seed_new_cells() {
  for (const CellHandle cell : cgal_->outside) {
    const int facet = cell->index(cgal_->triangulation.infinite_vertex());
    cgal_->number_new_cell(cell->neighbor(facet), *this);
  }
  for (const int32_t id : change_.destroyed) {
    const Cell cell = complex_.cells[static_cast<size_t>(id)];  // a copy: the vector may grow
    for (const int32_t neighbor : cell.neighbors) {
      if (neighbor < 0) continue;
      if (complex_.states[static_cast<size_t>(neighbor)] != CellState::kKept) continue;
      const int facet = index_of(complex_.cells[static_cast<size_t>(neighbor)].neighbors, id);
      const CellHandle inner = cgal_->cells[static_cast<size_t>(neighbor)]->neighbor(facet);
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
  for (const int32_t id : change_.created) {
    const CellHandle handle = cgal_->cells[static_cast<size_t>(id)];
    Cell& cell = complex_.cells[static_cast<size_t>(id)];
    for (int i = 0; i < 4; ++i) {
      cell.vertices[static_cast<size_t>(i)] = handle->vertex(i)->info();
      cell.neighbors[static_cast<size_t>(i)] = std::max(-1, handle->neighbor(i)->info().id);
    }
  }
}

void Delaunay::find_entries() {
  change_.entries.assign(change_.destroyed.size(), {});
  for (size_t n = 0; n < change_.destroyed.size(); ++n) {
    const int32_t id = change_.destroyed[n];
    for (size_t facet = 0; facet < 4; ++facet) {
      const int32_t kept = complex_.cells[static_cast<size_t>(id)].neighbors[facet];
      if (kept < 0 || complex_.states[static_cast<size_t>(kept)] != CellState::kKept) continue;
      Cell& outer = complex_.cells[static_cast<size_t>(kept)];
      const int mirror = index_of(outer.neighbors, id);
      const CellHandle handle = cgal_->cells[static_cast<size_t>(kept)];
      const CellHandle inner = handle->neighbor(mirror);
      change_.entries[n][facet] = {inner->info().id, inner->index(handle)};
      outer.neighbors[static_cast<size_t>(mirror)] = inner->info().id;
    }
  }
}

void Delaunay::finish() {
  for (const int32_t id : change_.created) {
    complex_.states[static_cast<size_t>(id)] = CellState::kKept;
  }
  for (const int32_t id : change_.destroyed) {
    complex_.states[static_cast<size_t>(id)] = CellState::kFree;
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
  size_t finite = 0;
  for (const CellHandle cell : t.finite_cell_handles()) {
    ++finite;
    const int32_t id = cell->info().id;
    const std::string name = "cell " + std::to_string(id);
    if (id < 0 || static_cast<size_t>(id) >= complex_.cells.size()) return name + ": bad id";
    if (complex_.states[static_cast<size_t>(id)] != CellState::kKept) return name + ": not kept";
    const Cell& mine = complex_.cells[static_cast<size_t>(id)];
    for (int i = 0; i < 4; ++i) {
      const int32_t vertex = mine.vertices[static_cast<size_t>(i)];
      if (vertex != cell->vertex(i)->info()) return name + ": wrong vertex";
      if (to_cgal(complex_.positions[static_cast<size_t>(vertex)]) != cell->vertex(i)->point()) {
        return name + ": wrong position";
      }
      if (mine.neighbors[static_cast<size_t>(i)] != std::max(-1, cell->neighbor(i)->info().id)) {
        return name + ": wrong neighbour";
      }
    }
  }
  const auto kept = std::count(complex_.states.begin(), complex_.states.end(), CellState::kKept);
  return static_cast<size_t>(kept) == finite ? "" : "stale cells in the complex";
}

size_t Delaunay::memory_bytes() const {
  const Triangulation& t = cgal_->triangulation;
  return t.number_of_vertices() * sizeof(Triangulation::Vertex) +
         t.tds().number_of_cells() * sizeof(Triangulation::Cell) +
         complex_.cells.capacity() * (sizeof(Cell) + sizeof(CellState) + sizeof(CellHandle)) +
         complex_.positions.capacity() * (sizeof(Point3) + sizeof(VertexHandle));
}

}  // namespace foresight::carving
