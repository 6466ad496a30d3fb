// The process on a simulated bus: when a mesh comes.
#include <gtest/gtest.h>

#include "common/messages.h"
#include "common/simulation.h"
#include "procs/mesher/process.h"
#include "tests/mesher/delaunay_carving.h"

namespace foresight {
namespace {

TEST(MesherProcess, TheFirstMeshDoesNotWaitForTheBeat) {
  Simulation world(Time{10'000'000});
  int asked = 0, meshes = 0;
  world.listen(Domain::kRobot, "SNAPSHOT_REQUEST", [&](auto) { ++asked; });
  world.listen(Domain::kRobot, "MESH", [&](auto) { ++meshes; });
  world.add("mesher", {Domain::kRobot},
            [](Node& node) { return std::make_unique<MesherProcess>(node, MesherParams()); });
  world.run_until(world.now() + milliseconds(1));
  EXPECT_EQ(asked, 1) << "for the carving, at once";

  const auto send = [&](int32_t seq, const CarvingDelta& delta) {
    for (carving_delta_t& m : split(delta, kMaxDeltaBytes)) {
      m.utime = world.now().us;
      m.header.epoch = m.header.session = 1;
      m.header.seq = seq;
      m.header.is_snapshot = seq == 0 ? 1 : 0;
      world.inject(world.now(), Domain::kRobot, "CARVING_DELTA", encode(m));
    }
    world.run_until(world.now() + milliseconds(10));
  };
  send(0, make_lattice(3, 1, [] { return 1; }));
  EXPECT_EQ(meshes, 1);
  send(1, {});
  EXPECT_EQ(meshes, 1) << "the next ones keep to the rate";
  world.run_until(world.now() + seconds(1));
  EXPECT_EQ(meshes, 2);
}

}  // namespace
}  // namespace foresight
