// The process on a simulated bus: when a mesh comes, and what is said of a delta that does not fit.
#include <gtest/gtest.h>

#include "common/messages.h"
#include "common/simulation.h"
#include "procs/mesher/process.h"
#include "tests/mesher/delaunay_carving.h"

namespace foresight {
namespace {

CarvingDelta lattice(int size) {
  return make_lattice(size, 1, [] { return 1; });
}

class MesherProcessTest : public testing::Test {
 protected:
  MesherProcessTest() {
    world_.listen(Domain::kRobot, "SNAPSHOT_REQUEST", [this](auto) { ++asked_; });
    world_.listen(Domain::kRobot, "MESH", [this](auto) { ++meshes_; });
    node_ = nullptr;
    world_.add("mesher", {Domain::kRobot}, [this](Node& node) {
      node_ = &node;
      return std::make_unique<MesherProcess>(node, MesherParams());
    });
    wait(milliseconds(1));
  }
  void wait(Duration d) { world_.run_until(world_.now() + d); }
  // seq 0 is a snapshot.
  void send(int64_t epoch, int32_t seq, const CarvingDelta& delta) {
    for (carving_delta_t& m : split(delta, kMaxDeltaBytes)) {
      m.utime = world_.now().us;
      m.header.epoch = m.header.session = epoch;
      m.header.seq = seq;
      m.header.is_snapshot = seq == 0 ? 1 : 0;
      world_.inject(world_.now(), Domain::kRobot, "CARVING_DELTA", encode(m));
    }
    wait(milliseconds(10));
  }
  Simulation world_{Time{10'000'000}};
  Node* node_;
  int asked_ = 0, meshes_ = 0;
};

TEST_F(MesherProcessTest, TheFirstMeshDoesNotWaitForTheBeat) {
  EXPECT_EQ(asked_, 1) << "for the carving, at once";
  send(1, 0, lattice(3));
  EXPECT_EQ(meshes_, 1);
  send(1, 1, {});
  EXPECT_EQ(meshes_, 1) << "the next ones keep to the rate";
  wait(seconds(1));
  EXPECT_EQ(meshes_, 2);
}

// Of the 2 s after which all is to be as before an attack, the beat would take half.
TEST_F(MesherProcessTest, NorDoesThatOfAnotherMap) {
  send(1, 0, lattice(3));
  wait(seconds(2));
  ASSERT_EQ(meshes_, 1);
  wait(milliseconds(300));  // somewhere between two beats
  send(2, 0, lattice(4));
  wait(milliseconds(230));
  ASSERT_EQ(meshes_, 1) << "while it is in doubt";
  wait(milliseconds(20));
  EXPECT_EQ(meshes_, 2);
}

TEST_F(MesherProcessTest, SaysWhyADeltaDoesNotFit) {
  send(1, 0, lattice(3));
  CarvingDelta unknown;
  unknown.cells_removed.push_back(CellId(4711));
  send(1, 1, unknown);
  std::string said;
  for (const PortRecord& port : node_->ports()) {
    if (port.rejected == 1 && port.spec.channel == "CARVING_DELTA") said = port.last_rejection;
  }
  EXPECT_NE(said.find(to_string(ApplyResult::kUnknownCell)), std::string::npos) << said;
}

}  // namespace
}  // namespace foresight
