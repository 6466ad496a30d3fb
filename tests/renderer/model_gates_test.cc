#include "procs/renderer/model_gates.h"

#include <gtest/gtest.h>

#include <limits>

namespace foresight {
namespace {

constexpr Time kStart{1'000'000'000'000};
constexpr int64_t kEpoch = kStart.us, kAbsurd = 9'000'000'000'000'000'000;

Pose<Map, Cam> at(double x, double turn_rad = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())), {x, 0, 0}};
}

Time frame(int i) { return kStart + milliseconds(66) * i; }

TEST(ViewGate, OneForgedViewBendsNothing) {
  ViewGate gate;
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(is_taken(gate.admit(frame(i), frame(i))));
    EXPECT_TRUE(gate.may_paint(frame(i), kEpoch, at(0.01 * i), 1)) << i;
    if (i != 10) continue;
    EXPECT_FALSE(gate.may_paint(frame(i), kAbsurd, at(0), 1)) << "another map";
    EXPECT_FALSE(gate.may_paint(frame(i), kEpoch, at(1e6), 1)) << "far away";
    EXPECT_FALSE(gate.may_paint(frame(i), kEpoch, at(0, 2), 1)) << "turned";
    for (const int64_t us : {std::numeric_limits<int64_t>::max(), int64_t{0}, kAbsurd,
                             (frame(i) + seconds(100)).us, (frame(i) - seconds(100)).us}) {
      EXPECT_FALSE(is_taken(gate.admit(frame(i), {us}))) << us;
    }
    EXPECT_EQ(gate.epoch(), kEpoch);
  }
}

TEST(ViewGate, ANewMapAndANewPlaceAreFollowedOnceTheyPersist) {
  ViewGate gate;
  EXPECT_TRUE(gate.may_paint(frame(0), kEpoch, at(0), 1));
  EXPECT_FALSE(gate.may_paint(frame(1), kEpoch, at(5), 1));
  EXPECT_TRUE(gate.may_paint(frame(2), kEpoch, at(5.1), 1)) << "found again elsewhere";
  EXPECT_FALSE(gate.may_paint(frame(3), kEpoch + 1, at(0), 1));
  EXPECT_FALSE(gate.may_paint(frame(4), kEpoch + 1, at(0), 1));
  EXPECT_TRUE(gate.may_paint(frame(5), kEpoch + 1, at(0), 1));
  EXPECT_EQ(gate.epoch(), kEpoch + 1);
  EXPECT_TRUE(gate.may_paint(frame(20), kEpoch + 1, at(9), 1)) << "a second later";
}

// A mesher and a gate that asks it.
class Mesher {
 public:
  Mesher() { EXPECT_TRUE(publish()) << "the first is always taken"; }
  bool publish() {
    now_ = now_ + seconds(1);
    mesh_ = {kEpoch, mesh_.version + 1, now_ - milliseconds(300)};
    return gate_.admit(now_, mesh_, kEpoch);
  }
  bool forge(const MeshName& mesh) {
    if (gate_.admit(now_, mesh, kEpoch)) return true;
    gate_.ask();
    return false;
  }
  bool answer() {
    now_ = now_ + milliseconds(300);
    return gate_.admit(now_, mesh_, kEpoch);
  }
  Time now_ = kStart;
  MeshName mesh_{kEpoch, 0, {}};
  MeshGate gate_;
};

TEST(MeshGate, TakesMeshesInOrder) {
  Mesher mesher;
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(mesher.publish());
  EXPECT_TRUE(mesher.answer()) << "repeated for somebody else";
}

TEST(MeshGate, AForgedMeshThatDoesNotFollowIsNotShownAndTheMesherIsAsked) {
  const MeshName forged[] = {{kAbsurd, 6, kStart + seconds(6)},
                             {kEpoch, std::numeric_limits<int32_t>::max(), kStart + seconds(6)},
                             {kEpoch, -7, kStart + seconds(6)},
                             {kEpoch, 6, {kAbsurd}},
                             {kEpoch, 6, kStart - seconds(100)},
                             {kEpoch, 6, kStart + seconds(3600)}};
  for (const MeshName& mesh : forged) {
    Mesher mesher;
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(mesher.publish());
    EXPECT_FALSE(mesher.forge(mesh)) << mesh.version << " " << mesh.time.us;
    EXPECT_EQ(mesher.gate_.shown(), mesher.mesh_);
    EXPECT_TRUE(mesher.answer());
    EXPECT_TRUE(mesher.publish());
  }
}

TEST(MeshGate, AForgedMeshThatFollowsGoesThoughTheSceneStandsStill) {
  Mesher mesher;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(mesher.publish());
  const MeshName forged{kEpoch, mesher.mesh_.version + 500, mesher.now_};
  EXPECT_TRUE(mesher.forge(forged));
  mesher.now_ = mesher.now_ + seconds(1.6);
  EXPECT_TRUE(mesher.gate_.is_unconfirmed(mesher.now_, kEpoch));
  mesher.gate_.ask();
  EXPECT_TRUE(mesher.answer());
  EXPECT_EQ(mesher.gate_.shown(), mesher.mesh_);
  mesher.now_ = mesher.now_ + seconds(1.6);
  EXPECT_TRUE(mesher.gate_.is_unconfirmed(mesher.now_, kEpoch)) << "said once";
  mesher.gate_.ask();
  EXPECT_TRUE(mesher.answer());
  mesher.now_ = mesher.now_ + seconds(100);
  EXPECT_FALSE(mesher.gate_.is_unconfirmed(mesher.now_, kEpoch)) << "said twice";
  EXPECT_TRUE(mesher.publish());
}

// It took the place of the answer, passed for confirmed, and stayed until the scene changed: a mesh
// without triangles left the operator without a view.
TEST(MeshGate, AForgedAnswerGoesThoughTheSceneStandsStill) {
  Mesher mesher;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(mesher.publish());
  mesher.gate_.ask();
  MeshName forged = mesher.mesh_;
  forged.digest = 1;  // other triangles under the same name
  EXPECT_TRUE(mesher.forge(forged));
  mesher.now_ = mesher.now_ + seconds(1.6);
  ASSERT_TRUE(mesher.gate_.is_unconfirmed(mesher.now_, kEpoch));
  mesher.gate_.ask();
  EXPECT_TRUE(mesher.answer());
  EXPECT_EQ(mesher.gate_.shown(), mesher.mesh_);
}

TEST(MeshGate, OneForgedBeforeTheFirstIsAskedForAgain) {
  MeshGate gate;
  EXPECT_TRUE(gate.admit(kStart, {kAbsurd, 7, kStart}, kAbsurd)) << "with a forged image";
  EXPECT_TRUE(gate.is_unconfirmed(kStart + seconds(2), kEpoch));
  for (const int at_s : {2, 4}) {
    gate.ask();
    EXPECT_TRUE(gate.admit(kStart + seconds(at_s), {kEpoch, 3, kStart}, kEpoch));
  }
  EXPECT_FALSE(gate.is_unconfirmed(kStart + seconds(9), kEpoch));
}

TEST(MeshGate, ARestartedMesherIsFollowed) {
  Mesher mesher;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(mesher.publish());
  mesher.mesh_.version = 0;
  EXPECT_FALSE(mesher.publish());
  mesher.gate_.ask();
  EXPECT_TRUE(mesher.answer());
  EXPECT_TRUE(mesher.publish());
}

TEST(CameraGate, NobodyBuildsSuchALens) {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = 320;
  camera.cy_px = 240;
  camera.prepare();
  EXPECT_TRUE(is_possible(camera));
  for (const auto& bend :
       {+[](CameraModel& c) { c.fx_px = 1e300; }, +[](CameraModel& c) { c.fy_px = 1e-3; },
        +[](CameraModel& c) { c.cx_px = -1e9; }, +[](CameraModel& c) { c.width_px = 32'000; },
        +[](CameraModel& c) { c.height_px = 2; }, +[](CameraModel& c) { c.distortion[1] = 1e200; },
        +[](CameraModel& c) { c.distortion[0] = std::nan(""); }}) {
    CameraModel bent = camera;
    bend(bent);
    EXPECT_FALSE(is_possible(bent));
  }
}

}  // namespace
}  // namespace foresight
