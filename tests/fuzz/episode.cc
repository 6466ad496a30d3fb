#include "tests/fuzz/episode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "tests/carver/brute_force.h"
#include "tests/carver/random_numbers.h"
#include "tests/fuzz/hostile_carving.h"
#include "tests/mesher/mesher_checks.h"

namespace foresight::fuzz {
namespace {

using carver_test::below;
using carver_test::one_of;
using carver_test::real;

std::mt19937 seeded(uint64_t seed) {
  std::seed_seq words{static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32)};
  return std::mt19937(words);
}

// Maps of some dozen points take up to a quarter of a megabyte; a kilobyte can never be met.
constexpr std::array<int64_t, 8> kMemoryLimits{0, 0, 0, 0, 0, 1000, 80'000, 160'000};

// A new option of the carver gets its choices here; those that make it forget constraints are named
// in is_lossless(), too.
CarverOptions random_carver_options(std::mt19937& random, double scale) {
  CarverOptions options;
  options.rebuild_cost_ratio = one_of(std::array{0.0, 1.0, 1e9, 1e9}, random);
  options.max_constraints_per_cell = one_of(std::array{0, 0, 0, 0, 1, 2, 5}, random);
  options.hull_half_size_mu = one_of(std::array{0.0, 0.0, 20 * scale}, random);
  options.hull_extent_factor = one_of(std::array{64.0, 64.0, 8.0, 1.5}, random);
  options.hull_use_limit = one_of(std::array{0.25, 0.25, 0.9}, random);
  options.memory_limit_bytes = one_of(kMemoryLimits, random);
  return options;
}

bool is_lossless(const CarverOptions& options) {
  return options.max_constraints_per_cell == 0 && options.memory_limit_bytes == 0;
}

MesherOptions random_mesher_options(std::mt19937& random) {
  MesherOptions options;
  options.energy = one_of(std::array{Energy::kVisibility, Energy::kVolume}, random);
  if (below(random, 2) == 0) {
    options.visibility.surface = one_of(std::array{0.0, 0.3, 2.0}, random);
    options.visibility.shape = one_of(std::array{0.0, 0.1, 3.0}, random);
    options.visibility.pocket = one_of(std::array{0.0, 0.7, 5.0}, random);
  }
  options.lambda = one_of(std::array{0.0, 0.002, 0.1, 1.0}, random);
  options.lambda_unit = one_of(std::array{LambdaUnit::kMapUnit, LambdaUnit::kRelative}, random);
  options.min_constraints = 1 + below(random, 3);
  options.smoothing_passes = one_of(std::array{0, 0, 1, 4}, random);
  return options;
}

bool is_near(double a, double b) {
  return std::abs(a - b) <= 1e-9 * std::max(std::abs(a), std::abs(b));
}

// Of a carving that forgets constraints: what no truth explains, or "".
std::string beyond(const carver_test::Carving& actual, const carver_test::Carving& truth) {
  if (actual.size() != truth.size()) return "wrong number of cells";
  for (const auto& [key, cell] : actual) {
    const auto at = truth.find(key);
    if (at == truth.end()) return "a cell that is not there";
    bool is_within = cell.constraints <= at->second.constraints &&
                     cell.votes.started <= at->second.votes.started &&
                     cell.votes.ended <= at->second.votes.ended;
    for (size_t k = 0; k < 4; ++k) {
      is_within = is_within && cell.votes.entered[k] <= at->second.votes.entered[k];
    }
    if (!is_within) return carver_test::differences({{key, cell}}, {{key, at->second}});
  }
  return "";
}

}  // namespace

Episode::Setup Episode::choose(std::mt19937& random) {
  Setup setup;
  setup.layout = one_of(carver_test::kAllLayouts, random);
  setup.scale = below(random, 2) == 0 ? std::ldexp(1.0, below(random, 21) - 10)
                                      : std::pow(10.0, real(random, -3, 3));
  setup.offset = one_of(std::array{0.0, 0.0, 0.0, 100.0, 1e5}, random);
  setup.generator_seed = static_cast<uint32_t>(random());
  setup.carver = random_carver_options(random, setup.scale);
  setup.mesher = random_mesher_options(random);
  return setup;
}

Episode::Episode(uint64_t seed)
    : random_(seeded(seed)),
      setup_(choose(random_)),
      steps_left_(10 + below(random_, 50)),
      generator_(setup_.layout, setup_.generator_seed, setup_.scale, setup_.offset),
      carver_(setup_.carver),
      mesher_(setup_.mesher) {}

std::string Episode::description() const {
  std::ostringstream text;
  text << "layout " << static_cast<int>(setup_.layout) << ", scale " << setup_.scale << ", offset "
       << setup_.offset << "; carver: at most " << setup_.carver.max_constraints_per_cell
       << " constraints per cell, " << setup_.carver.memory_limit_bytes << " bytes, rebuild ratio "
       << setup_.carver.rebuild_cost_ratio << ", hull " << setup_.carver.hull_half_size_mu << " × "
       << setup_.carver.hull_extent_factor << " × " << setup_.carver.hull_use_limit
       << "; mesher: " << (setup_.mesher.energy == Energy::kVolume ? "volume" : "visibility")
       << ", lambda " << setup_.mesher.lambda
       << (setup_.mesher.lambda_unit == LambdaUnit::kRelative ? "" : " mu") << ", from "
       << setup_.mesher.min_constraints << " constraints, smoothed "
       << setup_.mesher.smoothing_passes << " times; event: " << event_;
  return text.str();
}

MapDelta Episode::next_event() {
  const auto named = [&](const char* name, MapDelta delta) {
    event_ = name;
    return delta;
  };
  const int choice = below(random_, 100);
  if (choice < 50) return named("small change", generator_.next());
  if (choice < 70) return named("hostile entries", generator_.next_hostile());
  if (choice < 77) return named("closed loop", generator_.close_loop());
  if (choice < 85) return named("great growth", generator_.grow_much());
  if (choice < 88) return named("removal of all", generator_.remove_all());
  if (choice < 93) return named("the last delta again", generator_.repeat_last());
  if (choice < 97) return named("empty delta", {});
  generator_.start_over();
  tally_carver();
  carver_.reset();
  receiver_ = {};
  mesher_.reset();
  return named("new epoch", generator_.next());
}

void Episode::tally_carver() {
  const CarverStatistics s = carver_.statistics();
  tally_.ignored_entries += s.ignored_inputs;
  tally_.thinned_constraints += s.thinned_constraints;
  tally_.rebuilds += s.rebuilds;
}

std::string Episode::step() {
  --steps_left_;
  const MapDelta map_delta = next_event();
  const std::string fault = pass_on(carver_.apply(map_delta));
  if (!fault.empty()) return fault;
  if (std::string wrong = check_carving(); !wrong.empty()) return "carver: " + wrong;
  if (is_over()) tally_carver();
  // A busy mesher takes in several deltas before it solves.
  if (below(random_, 8) == 0) return "";
  if (std::string wrong = check_mesher(); !wrong.empty()) return "mesher: " + wrong;
  return "";
}

// From the carver to receiver and mesher, by way of messages. One delta in thirty is lost.
std::string Episode::pass_on(const CarvingDelta& delta) {
  CarvingDelta received;
  std::string fault = through_messages(delta, random_, &received);
  if (!fault.empty()) return "messages: " + fault;
  fault = attack_mesher(received);
  if (!fault.empty()) return "mesher: " + fault;
  fault = receiver_.apply(delta);
  if (!fault.empty()) return "carver: the delta " + fault;
  if (below(random_, 30) == 0) return resynchronise();
  const ApplyResult result = mesher_.apply(received);
  if (result == ApplyResult::kOk) return "";
  return "mesher: refuses a delta of the carver: " + std::string(to_string(result));
}

// Deltas that cannot be are refused as a whole; others are taken whole, or not at all.
std::string Episode::attack_mesher(const CarvingDelta& delta) {
  if (below(random_, 3) == 0) return "";
  const bool looks_closely = below(random_, 4) == 0;
  const ComplexContent before = looks_closely ? content(mesher_.complex()) : ComplexContent{};
  if (mesher_.apply(made_impossible(delta, receiver_, random_)) == ApplyResult::kOk) {
    return "takes a delta that cannot be";
  }
  ++tally_.refused_deltas;
  if (looks_closely && content(mesher_.complex()) != before) return "keeps part of a refused delta";
  if (below(random_, 4) > 0) return "";
  Mesher other = mesher_;
  const bool is_taken = other.apply(corrupted(delta, random_)) == ApplyResult::kOk;
  ++(is_taken ? tally_.taken_corrupted : tally_.refused_deltas);
  if (const auto broken = other.complex().find_broken_invariant()) {
    return "after a corrupted delta: " + std::string(*broken);
  }
  if (!is_taken && looks_closely && content(other.complex()) != before) {
    return "keeps part of a corrupted delta";
  }
  return find_problem(other.update());
}

// The delta got lost: what the carver sends on request.
std::string Episode::resynchronise() {
  mesher_.reset();
  const ApplyResult result = mesher_.apply(carver_.snapshot());
  if (result == ApplyResult::kOk) return "";
  return "mesher: refuses a snapshot: " + std::string(to_string(result));
}

std::string Episode::check_carving() {
  const carver_test::MapModel& map = generator_.model();
  const CarverStatistics s = carver_.statistics();
  if (s.points != static_cast<int64_t>(map.points.size())) return "wrong number of points";
  if (s.keyframes != static_cast<int64_t>(map.cameras.size())) return "wrong number of keyframes";
  const auto observations = static_cast<int64_t>(map.observations.size());
  const bool may_thin = setup_.carver.memory_limit_bytes > 0;
  if (may_thin ? s.constraints > observations : s.constraints != observations) {
    return "wrong number of constraints";
  }
  if (!may_thin && s.thinned_constraints > 0) return "thinned without a limit";
  if (s.cells != static_cast<int64_t>(receiver_.cells().size())) return "wrong number of cells";
  const int most = setup_.carver.max_constraints_per_cell;
  if (most > 0 && s.max_constraints_in_cell > most) return "a cell with too many constraints";
  carver_test::Receiver late;
  if (std::string breach = late.apply(carver_.snapshot()); !breach.empty()) {
    return "the snapshot " + breach;
  }
  if (late.carving() != receiver_.carving() || late.evidence() != receiver_.evidence()) {
    return "the snapshot differs from the deltas";
  }
  if (receiver_.cells().empty()) return "";
  const auto expected = carver_test::carve_by_brute_force(map, receiver_.vertices());
  if (!may_thin) {
    const std::string wrong = carver_test::differences(receiver_.evidence(), map);
    if (!wrong.empty()) return wrong;
  }
  if (is_lossless(setup_.carver)) {
    return carver_test::differences(receiver_.carving(), expected);
  }
  std::string wrong = beyond(receiver_.carving(), expected);
  if (wrong.empty() && below(random_, 4) == 0) wrong = carver_.validate();  // slow
  return wrong;
}

std::string Episode::check_mesher() {
  if (const auto broken = mesher_.complex().find_broken_invariant()) return std::string(*broken);
  const Mesh mesh = mesher_.update();
  tally_.cells += mesher_.statistics().cells;
  tally_.split_vertices += mesher_.statistics().split_vertices;
  tally_.split_edges += mesher_.statistics().split_edges;
  std::string fault = find_problem(mesh);
  if (fault.empty()) fault = check_references(mesh);
  return fault.empty() ? compare(mesh, carver_.snapshot()) : fault;
}

// With a mesher that gets all of it at once.
std::string Episode::compare(const Mesh& mesh, const CarvingDelta& snapshot) const {
  Mesher fresh(setup_.mesher);
  if (fresh.apply(snapshot) != ApplyResult::kOk) return "refuses a snapshot";
  const Mesh expected = fresh.update();
  const CutStatistics now = mesher_.statistics(), anew = fresh.statistics();
  if (labels(mesher_) != labels(fresh)) {
    return "labels differ from those from scratch: " + std::to_string(now.carved_cells) +
           " cells carved, not " + std::to_string(anew.carved_cells);
  }
  if (!is_near(now.energy_mu3, anew.energy_mu3)) return "energy differs from that from scratch";
  if (!is_near(now.surface_area_mu2, anew.surface_area_mu2)) return "area differs";
  if (mesh.triangles.size() != expected.triangles.size()) return "number of triangles differs";
  return "";
}

// The complex has the receiver's cells and votes, the mesh has vertices of the complex only.
std::string Episode::check_references(const Mesh& mesh) const {
  const CellComplex& complex = mesher_.complex();
  if (complex.cell_count() != static_cast<int32_t>(receiver_.cells().size())) {
    return "has not the carver's cells";
  }
  if (complex.vertex_count() != static_cast<int32_t>(receiver_.vertices().size())) {
    return "has not the carver's vertices";
  }
  for (const auto& [id, cell] : receiver_.cells()) {
    if (id >= complex.cell_limit() || !complex.exists(id)) return "misses a cell";
    if (complex.constraints(id) != cell.constraints || complex.votes(id) != cell.votes) {
      return "has other votes than the carver";
    }
  }
  for (const VertexIndex vertex : complex.vertices()) {
    if (!complex.exists_vertex(vertex)) continue;
    const auto known = receiver_.evidence().find(complex.vertex_id(vertex));
    if (known == receiver_.evidence().end() || complex.evidence(vertex) != known->second) {
      return "has other evidence than the carver";
    }
  }
  for (const float confidence : mesh.confidences) {
    if (!(confidence >= 0 && confidence <= 1)) return "a confidence beyond 0…1";
  }
  for (size_t i = 0; i < mesh.vertex_ids.size(); ++i) {
    if (!receiver_.vertices().contains(mesh.vertex_ids[i])) return "mesh with an unknown vertex";
    if (!mesh.vertices_in_map[i].allFinite()) return "mesh with a vertex nowhere";
  }
  return "";
}

}  // namespace foresight::fuzz
