// The carving of recorded sequences, to the last cell: three independent implementations agree on
// these numbers (hull ±20 m, earlier observations of new points not carved).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "bench/carve_bench/carv_reader.h"
#include "procs/carver/carver.h"
#include "tests/carver/receiver.h"

namespace foresight::carver_test {
namespace {

struct Expected {
  const char* name;
  int64_t cells, carved, pairs;
};

void PrintTo(const Expected& e, std::ostream* out) { *out << e.name; }

class Recorded : public testing::TestWithParam<Expected> {};

TEST_P(Recorded, CarvingIsExact) {
  const char* data = std::getenv("FORESIGHT_DATA");
  const std::filesystem::path folder = data != nullptr ? data : FORESIGHT_DATA_DEFAULT;
  const std::string file = folder / "carving" / (std::string(GetParam().name) + ".carv.gz");
  if (!std::filesystem::exists(file)) {
    GTEST_SKIP() << file << " is missing: set FORESIGHT_DATA to the folder that has carving/";
  }
  constexpr double kMuPerM = 1e5;  // positions have 5 decimals: exact as floats
  const CarvSequence sequence = read_carv(file, {false, kMuPerM});
  ASSERT_EQ(sequence.error, "");
  CarverOptions options;
  options.hull_half_size_mu = 20.0 * kMuPerM;
  Carver carver(options);
  IdVector<CellId, CarvingCell> cells;
  for (const CarvEvent& event : sequence.events) {
    const CarvingDelta delta = carver.apply(event.delta);
    for (const CellId id : delta.cells_removed) cells[id].id = CellId();
    for (const CarvingCell& cell : delta.cells_added) {
      cells.grow_to(cell.id);
      cells[cell.id] = cell;
    }
    for (const auto& update : delta.cells_updated) {
      cells[update.id].constraints = update.constraints;
    }
  }
  const CarverStatistics s = carver.statistics();
  EXPECT_EQ(s.cells, GetParam().cells);
  EXPECT_EQ(s.carved_cells, GetParam().carved);
  EXPECT_EQ(s.constraint_cell_pairs, GetParam().pairs);
  int64_t received = 0, carved = 0, pairs = 0;
  for (const CarvingCell& cell : cells) {
    received += cell.id.is_valid();
    carved += cell.id.is_valid() && cell.carved();
    pairs += cell.id.is_valid() ? cell.constraints : 0;
  }
  EXPECT_EQ(received, s.cells);
  EXPECT_EQ(carved, s.carved_cells);
  EXPECT_EQ(pairs, s.constraint_cell_pairs);
}

INSTANTIATE_TEST_SUITE_P(Sequences, Recorded,
                         testing::Values(Expected{"s1k", 5995, 2373, 58444},
                                         Expected{"s3k", 18055, 7491, 397055},
                                         Expected{"s10k", 60641, 26745, 1794163},
                                         Expected{"s3k_ev", 17893, 7253, 397185},
                                         Expected{"s10k_ev", 59208, 23743, 1959156}));

}  // namespace
}  // namespace foresight::carver_test
