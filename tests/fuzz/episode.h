// One map's life: random and hostile events through the cores of carver and mesher, with every
// result compared with the truth after every event.
//
//   Episode episode(seed);
//   while (!episode.is_over()) if (std::string fault = episode.step(); !fault.empty()) …
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "procs/carver/carver.h"
#include "procs/mesher/mesher.h"
#include "tests/carver/map_model.h"
#include "tests/carver/receiver.h"

namespace foresight::fuzz {

/// What happened so far: a fuzzer that does not get anywhere shows here.
struct Tally {
  int64_t ignored_entries = 0;  // of map deltas
  int64_t thinned_constraints = 0;
  int64_t rebuilds = 0;
  int64_t refused_deltas = 0;  // by a mesher
  int64_t taken_corrupted = 0;
  int64_t cells = 0;  // compared
  int64_t split_vertices = 0, split_edges = 0;
};

class Episode {
 public:
  /// The seed decides everything: layout, scale, options, events.
  explicit Episode(uint64_t seed);

  bool is_over() const { return steps_left_ == 0; }
  /// The next event. Returns the first fault, or "".
  std::string step();

  /// Layout and options, and the last event, in words.
  std::string description() const;
  const Tally& tally() const { return tally_; }

 private:
  struct Setup {
    carver_test::Layout layout;
    double scale, offset;
    uint32_t generator_seed;
    CarverOptions carver;
    MesherOptions mesher;
  };
  static Setup choose(std::mt19937& random);

  MapDelta next_event();
  void tally_carver();
  std::string pass_on(const CarvingDelta& delta);
  std::string attack_mesher(const CarvingDelta& delta);
  std::string resynchronise();
  std::string check_carving();
  std::string check_mesher();
  std::string compare(const Mesh& mesh, const CarvingDelta& snapshot) const;
  std::string check_references(const Mesh& mesh) const;

  std::mt19937 random_;
  Setup setup_;
  int steps_left_;
  carver_test::MapGenerator generator_;
  Carver carver_;
  carver_test::Receiver receiver_;
  Mesher mesher_;
  const char* event_ = "";
  Tally tally_;
};

}  // namespace foresight::fuzz
