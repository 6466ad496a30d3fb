// What the simulated robot costs in CPU time: µs per tick of 2 ms of the arm, ms per frame of its
// camera. With --pictures it also writes what the camera sees at home and with each joint turned by
// 0.4 rad.
//
//   scripts/run sim-bench --arm deploy/arms/wam7.yaml --pictures out/pictures
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <vector>

#include "common/errors.h"
#include "common/tool_main.h"
#include "sim/robot/camera_rig.h"
#include "sim/robot/robot.h"
#include "sim/sequence.h"

namespace foresight::sim {
namespace {

double cpu_seconds_since(std::clock_t begin) {
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

void time_ticks(const ArmModel& arm) {
  constexpr int kCount = 50'000;
  Robot robot(arm, {}, Time{0});
  std::vector<int32_t> counts(static_cast<size_t>(arm.size()));
  JointVector torque_nm = JointVector::Constant(arm.size(), 0.01);
  const auto begin = std::clock();
  for (int i = 0; i < kCount; ++i) {
    robot.tick();
    robot.read_encoders(counts);
    torque_nm = -torque_nm;
    (void)robot.take_torques(robot.now(), torque_nm);
  }
  std::printf("%s: %.1f us per tick (2 ms, 4 substeps)\n", arm.name.c_str(),
              1e6 * cpu_seconds_since(begin) / kCount);
}

void time_frames(const ArmModel& arm, int width_px, Antialiasing antialiasing, const char* name) {
  constexpr int kCount = 20;
  CameraRig rig(open_scene(SimParams{}), {.camera = {.model = sequence_camera(width_px, false),
                                                     .noise_levels = 1.5,
                                                     .antialiasing = antialiasing}});
  const Robot robot(arm, {}, Time{0});
  const std::vector<Pose<World, Cam>> poses{robot.truth_at(Time{0}).world_from_cam};
  const auto begin = std::clock();
  for (int i = 0; i < kCount; ++i) rig.take(poses, i);
  std::printf("%d x %d, antialiasing %s: %.1f ms per frame, JPEG included\n", width_px,
              width_px * 3 / 4, name, 1e3 * cpu_seconds_since(begin) / kCount);
}

void write_pictures(const ArmModel& arm, const std::string& folder) {
  constexpr double kTurn_rad = 0.4;
  std::filesystem::create_directories(folder);
  CameraRig rig(open_scene(SimParams{}), {.camera = {.model = sequence_camera(640, false)}});
  const auto write = [&](const JointVector& position_rad, const std::string& name) {
    const Pose<World, Base> world_from_base;
    const std::vector<Pose<World, Cam>> poses{world_from_base * arm.base_from_cam(position_rad)};
    const image_t image = rig.take(poses, 0);
    std::ofstream file(folder + "/" + name + ".jpg", std::ios::binary);
    file.write(reinterpret_cast<const char*>(image.data.data()), image.n_data);
  };
  write(arm.home(), arm.name + "_home");
  for (int joint = 0; joint < arm.size(); ++joint) {
    for (const double turn_rad : {-kTurn_rad, kTurn_rad}) {
      JointVector position_rad = arm.home();
      position_rad[joint] += turn_rad;
      write(position_rad,
            arm.name + "_joint" + std::to_string(joint + 1) + (turn_rad < 0 ? "_minus" : "_plus"));
    }
  }
}

int run(const std::string& arm_file, const std::string& pictures) {
  const ArmModel arm = load_arm_file(arm_file);
  time_ticks(arm);
  for (const int width_px : {320, 640}) {
    time_frames(arm, width_px, Antialiasing::kNone, "none");
    time_frames(arm, width_px, Antialiasing::kEdges, "edges");
  }
  if (!pictures.empty()) write_pictures(arm, pictures);
  return kExitDone;
}

}  // namespace
}  // namespace foresight::sim

int main(int argc, char** argv) {
  std::string arm_file = "deploy/arms/wam4.yaml", pictures;
  CLI::App app("Times the simulated arm and camera, one thread each.", "sim-bench");
  app.add_option("--arm", arm_file, "description of the arm")->capture_default_str();
  app.add_option("--pictures", pictures, "folder for pictures of home and each joint turned");
  return foresight::tool_main(app, argc, argv,
                              [&] { return foresight::sim::run(arm_file, pictures); });
}
