#include "tests/fuzz/hostile_carving.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <vector>

#include "common/messages.h"
#include "procs/mesher/cell_complex.h"
#include "tests/carver/random_numbers.h"

namespace foresight::fuzz {
namespace {

using carver_test::below;
using carver_test::one_of;
using carver_test::Receiver;

constexpr int32_t kLeast = std::numeric_limits<int32_t>::min();
constexpr int32_t kMost = std::numeric_limits<int32_t>::max();

struct Target {
  CarvingDelta& delta;
  const Receiver& before;
  std::mt19937& random;
  std::vector<CarvingCell> survivors;  // cells that the delta does not remove
  CellId free_id{0};

  const CarvingCell& survivor() const {
    return survivors[static_cast<size_t>(below(random, static_cast<int>(survivors.size())))];
  }
};

template <class Entries, class Entry>
void insert_anywhere(Entries& entries, const Entry& entry, std::mt19937& random) {
  const int at = below(random, static_cast<int>(entries.size()) + 1);
  entries.insert(entries.begin() + at, entry);
}

CellId unknown_cell(const Target& t) {
  const int32_t free = t.free_id.value();
  const std::array odd{-1, kLeast, kMost, free, free + 100'000};
  return CellId(one_of(odd, t.random));
}

// Of neither map nor delta: ids of map points are small, or one of a few odd ones.
constexpr VertexId kUnknownVertex(123'456'789);

// Three corners of the hull, and another vertex.
std::array<VertexId, 4> corners(int32_t a, int32_t b, int32_t c, VertexId d) {
  return {VertexId::hull_corner(a), VertexId::hull_corner(b), VertexId::hull_corner(c), d};
}

// Each returns false where it has nothing to work on.
using Writer = bool (*)(Target& t);

bool remove_unknown_cell(Target& t) {
  insert_anywhere(t.delta.cells_removed, unknown_cell(t), t.random);
  return true;
}

bool remove_cell_twice(Target& t) {
  auto& removed = t.delta.cells_removed;
  if (removed.empty()) return false;
  const int at = below(t.random, static_cast<int>(removed.size()));
  insert_anywhere(removed, CellId(removed[static_cast<size_t>(at)]), t.random);
  return true;
}

bool remove_unknown_vertex(Target& t) {
  insert_anywhere(t.delta.vertices_removed, kUnknownVertex, t.random);
  return true;
}

bool remove_used_vertex(Target& t) {
  if (t.survivors.empty()) return false;
  insert_anywhere(t.delta.vertices_removed, one_of(t.survivor().vertices, t.random), t.random);
  return true;
}

bool set_bad_position(Target& t) {
  const std::array bad{std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  CarvingVertex vertex{kUnknownVertex, {0, 0, 0}};
  auto& set = t.delta.vertices_set;
  if (!set.empty() && below(t.random, 2) == 0) vertex = set.back();
  vertex.position_in_map[below(t.random, 3)] = one_of(bad, t.random);
  insert_anywhere(set, vertex, t.random);
  return true;
}

bool set_vertex_below_the_corners(Target& t) {
  const std::array low{-9, -1000, kLeast};
  const VertexId id(one_of(low, t.random));
  insert_anywhere(t.delta.vertices_set, CarvingVertex{id, {1, 2, 3}}, t.random);
  return true;
}

bool move_used_vertex(Target& t) {
  if (t.survivors.empty()) return false;
  const VertexId id = one_of(t.survivor().vertices, t.random);
  Eigen::Vector3f p = t.before.vertices().at(id);
  p.y() = std::nextafter(p.y(), std::numeric_limits<float>::max());
  insert_anywhere(t.delta.vertices_set, CarvingVertex{id, p}, t.random);
  return true;
}

bool add_existing_cell(Target& t) {
  if (t.survivors.empty()) return false;
  CarvingCell cell = t.survivor();
  if (below(t.random, 2) == 0) cell.id = t.free_id;  // the same place once more
  insert_anywhere(t.delta.cells_added, cell, t.random);
  return true;
}

bool add_cell_of_bad_id(Target& t) {
  const std::array bad{-1, kLeast, kMost, kMost / 4};
  CarvingCell cell{CellId(one_of(bad, t.random)), corners(0, 1, 2, VertexId::hull_corner(4))};
  insert_anywhere(t.delta.cells_added, cell, t.random);
  return true;
}

bool add_cell_of_bad_vertices(Target& t) {
  CarvingCell cell{t.free_id, corners(0, 1, 2, kUnknownVertex)};
  if (!t.survivors.empty()) cell.vertices = t.survivor().vertices;
  const auto at = static_cast<size_t>(below(t.random, 4));
  const VertexId repeated = cell.vertices[(at + 1) % 4];
  cell.vertices[at] = below(t.random, 2) == 0 ? kUnknownVertex : repeated;
  insert_anywhere(t.delta.cells_added, cell, t.random);
  return true;
}

bool update_unknown_cell(Target& t) {
  insert_anywhere(t.delta.cells_updated, CarvingCellUpdate{unknown_cell(t), 1, {}}, t.random);
  return true;
}

bool update_to_impossible_votes(Target& t) {
  if (t.survivors.empty()) return false;
  const std::array<CarvingCellUpdate, 7> bad{{{{}, -1, {}},
                                              {{}, kLeast, {}},
                                              {{}, CellComplex::kMaxVotes + 1, {}},
                                              {{}, 3, {{1, 1, 1, 1}, 0, 0}},
                                              {{}, 0, {{0, 0, 0, 0}, 1, 0}},
                                              {{}, 9, {{kMost, kMost, 2, 0}, 0, 0}},
                                              {{}, 9, {{0, -1, 0, 0}, 0, -1}}}};
  CarvingCellUpdate update = one_of(bad, t.random);
  update.id = t.survivor().id;
  insert_anywhere(t.delta.cells_updated, update, t.random);
  return true;
}

bool update_to_bad_evidence(Target& t) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const VertexId corner = VertexId::hull_corner(0);
  const std::array<CarvingVertexUpdate, 5> bad{{{kUnknownVertex, {1, 0}},
                                                {corner, {-1, 0}},
                                                {corner, {2, nan}},
                                                {corner, {2, -0.1F}},
                                                {corner, {2, 3.2F}}}};
  insert_anywhere(t.delta.vertices_updated, one_of(bad, t.random), t.random);
  return true;
}

bool add_impossible_votes(Target& t) {
  if (t.delta.cells_added.empty()) return false;
  CarvingCell& cell = t.delta.cells_added.back();
  cell.votes.entered[static_cast<size_t>(below(t.random, 4))] += cell.constraints + 1;
  return true;
}

bool lose_new_vertex(Target& t) {
  auto& set = t.delta.vertices_set;
  for (auto vertex = set.begin(); vertex != set.end(); ++vertex) {
    const bool is_used = std::any_of(
        t.delta.cells_added.begin(), t.delta.cells_added.end(), [&](const CarvingCell& cell) {
          return std::count(cell.vertices.begin(), cell.vertices.end(), vertex->id) > 0;
        });
    if (!is_used || t.before.vertices().contains(vertex->id)) continue;
    set.erase(vertex);
    return true;
  }
  return false;
}

template <class T>
void corrupt(std::vector<T>& items, std::mt19937& random, auto&& change) {
  if (!items.empty() && below(random, 4) == 0) {
    change(items[static_cast<size_t>(below(random, static_cast<int>(items.size())))]);
  }
  if (!items.empty() && below(random, 12) == 0) items.pop_back();
  if (!items.empty() && below(random, 12) == 0) items.erase(items.begin());
}

// One count of the message is not what the others say.
void spoil_sizes(carving_delta_t& m, std::mt19937& random) {
  const std::array<int32_t*, 4> counts{&m.n_vertex_coordinates, &m.n_cell_vertices, &m.n_cell_votes,
                                       &m.n_updated_cell_votes};
  const std::array changes{-1, 1, 5, kMost / 2};
  *one_of(counts, random) += one_of(changes, random);
}

}  // namespace

CarvingDelta made_impossible(CarvingDelta delta, const Receiver& before, std::mt19937& random) {
  constexpr std::array<Writer, 15> kWriters{
      remove_unknown_cell,      remove_cell_twice,   remove_unknown_vertex,
      remove_used_vertex,       set_bad_position,    set_vertex_below_the_corners,
      move_used_vertex,         add_existing_cell,   add_cell_of_bad_id,
      add_cell_of_bad_vertices, update_unknown_cell, update_to_impossible_votes,
      add_impossible_votes,     lose_new_vertex,     update_to_bad_evidence};
  Target target{delta, before, random, {}, CellId(0)};
  const std::set<CellId> removed(delta.cells_removed.begin(), delta.cells_removed.end());
  for (const auto& [id, cell] : before.cells()) {
    if (!removed.contains(id)) target.survivors.push_back(cell);
    target.free_id = std::max(target.free_id, id.next());
  }
  for (const CarvingCell& cell : delta.cells_added) {
    target.free_id = std::max(target.free_id, cell.id.next());
  }
  while (!one_of(kWriters, random)(target)) {
  }
  return delta;
}

CarvingDelta corrupted(CarvingDelta delta, std::mt19937& random) {
  const auto flip = [&](int32_t& number) {
    number = static_cast<int32_t>(static_cast<uint32_t>(number) ^ 1u << below(random, 32));
  };
  const auto flip_id = [&]<class IdType>(IdType& id) {
    int32_t value = id.value();
    flip(value);
    id = IdType(value);
  };
  const auto flip_votes = [&](CellVotes& votes) {
    const int n = below(random, 6);
    flip(n < 4 ? votes.entered[static_cast<size_t>(n)] : n == 4 ? votes.started : votes.ended);
  };
  corrupt(delta.cells_removed, random, flip_id);
  corrupt(delta.vertices_removed, random, flip_id);
  corrupt(delta.vertices_set, random, [&](CarvingVertex& v) { flip_id(v.id); });
  corrupt(delta.vertices_set, random, [&](CarvingVertex& v) { v.position_in_map *= 1.5F; });
  corrupt(delta.cells_added, random, [&](CarvingCell& c) { flip_id(c.id); });
  corrupt(delta.cells_added, random,
          [&](CarvingCell& c) { c.vertices[0] = VertexId(c.vertices[0].value() ^ 1); });
  corrupt(delta.cells_added, random, [&](CarvingCell& c) { flip_votes(c.votes); });
  corrupt(delta.cells_updated, random, [&](CarvingCellUpdate& u) { flip(u.constraints); });
  corrupt(delta.cells_updated, random, [&](CarvingCellUpdate& u) { flip_votes(u.votes); });
  corrupt(delta.vertices_updated, random, [&](CarvingVertexUpdate& u) { flip_id(u.id); });
  corrupt(delta.vertices_updated, random,
          [&](CarvingVertexUpdate& u) { flip(u.evidence.observations); });
  return delta;
}

std::string through_messages(const CarvingDelta& delta, std::mt19937& random,
                             CarvingDelta* received) {
  const std::array<size_t, 3> sizes{2'000, 20'000, kMaxDeltaBytes};
  *received = {};
  for (const carving_delta_t& part : split(delta, one_of(sizes, random))) {
    carving_delta_t bad = part;
    spoil_sizes(bad, random);
    CarvingDelta untouched;
    if (append(bad, &untouched)) return "a message is read whose arrays do not belong together";
    if (!untouched.empty()) return "a refused message is read in part";
    if (!append(part, received)) return "a message of a carver's delta is refused";
  }
  return "";
}

}  // namespace foresight::fuzz
