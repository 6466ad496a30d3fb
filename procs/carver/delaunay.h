// The Delaunay triangulation (CGAL, exact predicates), mirrored into a Tetrahedra.
//
// Vertices are numbered by the caller; 0…7 are the hull's corners, all others lie strictly inside.
// Several insertions and removals make one change: `commit` then says which cells are gone, which
// are new, and what lies behind each facet of a destroyed cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "procs/carver/tetrahedra.h"

namespace foresight::carving {

/// Where a constraint that entered a destroyed cell through a facet is taken up again: the new cell
/// behind the same facet, or none if the cell before it is destroyed too.
struct RegionEntry {
  CellId cell;
  int facet = 0;
};

struct TriangulationChange {
  std::vector<CellId> destroyed;
  std::vector<std::array<RegionEntry, 4>> entries;  // parallel to `destroyed`, by facet
  std::vector<CellId> created;
};

struct VertexSite {
  VertexIndex vertex;
  Point3 position{};
};

class Delaunay {
 public:
  Delaunay();
  ~Delaunay();
  Delaunay(const Delaunay&) = delete;
  Delaunay& operator=(const Delaunay&) = delete;

  const Tetrahedra& tetrahedra() const { return tetrahedra_; }
  bool built() const { return built_; }
  void clear();
  /// From scratch: the hull's corners first, then distinct sites strictly inside it. All cells are
  /// kNew afterwards.
  void build(const std::array<Point3, 8>& corners, std::span<const VertexSite> sites);
  /// Returns none, or the vertex that already is at this very position (then nothing changes).
  VertexIndex insert(const VertexSite& site);
  void remove(VertexIndex vertex);
  /// Brings the tetrahedra up to date; destroyed cells keep their vertices until `finish`.
  const TriangulationChange& commit();
  /// The change is dealt with: destroyed cell ids may be reused, new cells are kept ones.
  void finish();

  /// An order in which insertion is fast (neighbours in space follow each other).
  static std::vector<size_t> spatial_order(std::span<const VertexSite> sites);
  /// Empty, or what is wrong (slow).
  std::string validate() const;
  size_t memory_bytes() const;

 private:
  struct Cgal;
  void seed_new_cells();
  void fill_created();
  void find_entries();

  std::unique_ptr<Cgal> cgal_;
  Tetrahedra tetrahedra_;
  TriangulationChange change_;
  std::vector<CellId> free_cells_;
  bool built_ = false;
};

}  // namespace foresight::carving
