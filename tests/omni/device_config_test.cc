#include "procs/omni/device_config.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/node.h"
#include "foresight/device_state_t.hpp"
#include "procs/omni/omni_model.h"
#include "tests/common/files.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

class MappingFileTest : public testing::Test {
 protected:
  std::string refusal(const std::string& text) {
    const std::string path = folder_.write("mapping.yaml", text);
    return error_of<ConfigError>([&] { load_mapping_file(path, wam4()); });
  }
  TemporaryFolder folder_;
};

TEST_F(MappingFileTest, TheFileInDeployIsTheDefault) {
  const ArmModel arm = wam4();
  const JointMapping file = load_mapping_file(deploy_file("mappings/omni_wam.yaml"), arm);
  for (const double j2_rad : {0.0, 0.7, 1.7}) {
    const std::vector<double> axes{0.3, j2_rad, -0.5};
    EXPECT_LT((map_positions(file, arm, axes) - map_positions(paper_mapping(), arm, axes)).norm(),
              1e-12);
  }
}

TEST_F(MappingFileTest, EveryFileInDeployFitsItsArm) {
  const JointMapping wrist = load_mapping_file(deploy_file("mappings/omni_wam7.yaml"), wam7());
  EXPECT_EQ(wrist.axes_needed(), 6);
  const JointVector arm_rad =
      map_positions(wrist, wam7(), std::vector<double>{0, 0.7, 0, 0.5, 1.2, -0.3});
  EXPECT_LT((arm_rad.tail(3) - Eigen::Vector3d(0.5, 0, -0.3)).norm(), 1e-12);
  const JointMapping direct = load_mapping_file(deploy_file("mappings/direct.yaml"), wam4());
  const std::vector<double> axes{0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(map_positions(direct, wam4(), axes), Eigen::Vector4d(axes.data()));
}

TEST_F(MappingFileTest, RefusesWhatItDoesNotUnderstand) {
  EXPECT_NE(refusal("joints: []\n").find("joints"), std::string::npos);
  EXPECT_NE(refusal("joints: [{axis: 1.5}]\n").find("whole number"), std::string::npos);
  EXPECT_NE(refusal("joints: [{axis: 17}]\n").find("[1, 16]"), std::string::npos);
  EXPECT_NE(refusal("joints: [{axis: 1, scale: 0}]\n").find("must not be 0"), std::string::npos);
  EXPECT_NE(refusal("joints: [{axsi: 1}]\n").find("axsi"), std::string::npos);
  EXPECT_NE(refusal("joints: [{axis: 1, hold_rad: 1}]\n").find("hold_rad"), std::string::npos);
  EXPECT_NE(refusal("axes: [{sign: 0.5}]\njoints: [{axis: 1}]\n").find("1 or -1"),
            std::string::npos);
  EXPECT_NE(refusal("joints: [{}, {}, {}, {}, {}]\n").find("1 to 4"), std::string::npos);
  EXPECT_NE(refusal("joints: [{}]\nmore: 1\n").find("more"), std::string::npos);
}

TEST(DeviceConfig, EachDeviceHasItsMappingAndAFileReplacesIt) {
  OmniParams params;
  const ArmModel arm = wam4();
  EXPECT_EQ(choose_mapping(params, arm).axes_needed(), 3);
  params.device = DeviceKind::kGamepad;
  EXPECT_EQ(choose_mapping(params, arm).axes_needed(), 5);
  params.device = DeviceKind::kKeyboard;
  EXPECT_EQ(choose_mapping(params, arm).axes_needed(), 4) << "cut to the arm's joints";
  EXPECT_EQ(choose_mapping(params, wam7()).axes_needed(), 7);
  params.device = DeviceKind::kSpaceMouse;
  EXPECT_EQ(choose_mapping(params, arm).axes_needed(), 5);
  params.mapping_file = deploy_file("mappings/omni_wam.yaml");
  EXPECT_EQ(choose_mapping(params, arm).axes_needed(), 3);
}

TEST(DeviceConfig, ARecordingHasTheMappingOfItsDevice) {
  const TemporaryFolder folder;
  OmniParams params;
  params.device = DeviceKind::kRecorded;
  params.device_path = folder.path() + "/sticks.lcmlog";
  device_state_t state{};
  state.device = "gamepad";
  state.n_deflections = 5;
  state.deflections.assign(5, 0.0);
  LogWriter log(params.device_path);
  log.write({1}, "DEVICE_STATE", encode(state));
  log.close();
  EXPECT_EQ(choose_mapping(params, wam4()).axes_needed(), 5);
  params.mapping_file = deploy_file("mappings/omni_wam.yaml");
  EXPECT_EQ(choose_mapping(params, wam4()).axes_needed(), 3);
}

TEST(DeviceConfig, MakesEveryDevice) {
  OmniParams params;
  const ArmModel arm = wam4();
  for (const auto& device : names_of(DeviceKind{})) {
    params.device = device.value;
    EXPECT_NE(make_device(params, arm, choose_mapping(params, arm)), nullptr) << device.name;
  }
}

TEST(DeviceConfig, AMissingGamepadOrTerminalIsUnavailable) {
  OmniParams params;
  const ArmModel arm = wam4();
  params.device_path = "/dev/input/there_is_no_such_gamepad";
  for (const DeviceKind device : {DeviceKind::kGamepad, DeviceKind::kKeyboard}) {
    params.device = device;
    const auto made = make_device(params, arm, choose_mapping(params, arm));
    const std::string line = error_of<UnavailableError>([&] { made->open(); });
    EXPECT_NE(line.find(params.device_path), std::string::npos) << line;
  }
}

TEST(DeviceConfig, TheScriptHasSixAxes) {
  OmniParams params;
  const JointMapping mapping{.axis_signs = {}, .joints = {{.axis = 7}}};
  EXPECT_NE(error_of<ConfigError>([&] { make_device(params, wam4(), mapping); }).find("6 axes"),
            std::string::npos);
}

}  // namespace
}  // namespace foresight
