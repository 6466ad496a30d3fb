#include <gtest/gtest.h>

#include "common/camera_model.h"
#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

const std::string kGood =
    "model: pinhole_radtan\nwidth: 640\nheight: 480\nfx: 517.3\nfy: 516.5\ncx: 318.6\ncy: 255.3\n"
    "k1: 0.262383\nk2: -0.953104\np1: -0.005358\np2: 0.002628\nk3: 1.163314\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, from.size(), to);
}

class CameraFile : public testing::Test {
 protected:
  CameraModel load(const std::string& text) {
    return load_camera_file(folder_.write("camera.yaml", text));
  }
  std::string refusal(const std::string& text) {
    return error_of<ConfigError>([&] { load(text); });
  }
  TemporaryFolder folder_;
};

TEST_F(CameraFile, IsReadInFull) {
  const CameraModel camera = load(kGood);
  EXPECT_EQ(camera.lens, LensModel::kRadtan);
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_EQ(camera.cy_px, 255.3);
  EXPECT_EQ(camera.distortion, (std::array{0.262383, -0.953104, -0.005358, 0.002628, 1.163314}));
  EXPECT_LT(camera.max_radius, 1e3) << "prepare() was called";
}

TEST_F(CameraFile, MayCarryOpenCvsHeader) { EXPECT_EQ(load("%YAML:1.0\n" + kGood).width_px, 640); }

TEST_F(CameraFile, OfAFisheyeHasFourCoefficients) {
  const std::string text =
      "model: equidistant\nwidth: 640\nheight: 480\nfx: 300\nfy: 300\ncx: 320\ncy: 240\n"
      "k1: 0.1\nk2: 0.2\nk3: 0.3\nk4: 0.4\n";
  EXPECT_EQ(load(text).distortion, (std::array{0.1, 0.2, 0.3, 0.4, 0.0}));
}

TEST_F(CameraFile, RefusalNamesFileKeyAndLimit) {
  const std::string line = refusal(replaced(kGood, "fx: 517.3", "fx: -1"));
  for (const char* part : {"camera.yaml", "fx", "-1", "[1, 100000]"}) {
    EXPECT_NE(line.find(part), std::string::npos) << part << " in " << line;
  }
}

TEST_F(CameraFile, RefusesWhatIsMissingOrNoNumber) {
  EXPECT_NE(refusal(replaced(kGood, "cy: 255.3\n", "")).find("cy: missing"), std::string::npos);
  EXPECT_NE(refusal(replaced(kGood, "k3: 1.16", "k3: x1.16")).find("k3: not a number"),
            std::string::npos);
  refusal(replaced(kGood, "fx: 517.3", "fx: .nan"));
  refusal(replaced(kGood, "fx: 517.3", "fx: .inf"));
  refusal(replaced(kGood, "fx: 517.3", "fx: [1, 2]"));
  refusal(replaced(kGood, "width: 640", "width: 640.5"));
  refusal(replaced(kGood, "width: 640", "width: 1000000"));
}

TEST_F(CameraFile, RefusesAnUnknownModel) {
  EXPECT_NE(refusal(replaced(kGood, "pinhole_radtan", "omni")).find("omni"), std::string::npos);
  refusal(replaced(kGood, "pinhole_radtan", "[a, b]"));
}

// Recordings carry more in their camera files: frame rate, depth scale, hand-eye transforms.
TEST_F(CameraFile, MayCarryMoreThanIntrinsics) {
  EXPECT_EQ(load(kGood + "fps: 30\ndepth_scale: 0.001\n").width_px, 640);
}

TEST_F(CameraFile, RefusesWhatIsNoMap) {
  refusal("");
  refusal("just text");
  refusal("- a\n- b\n");
  refusal("a: [unclosed");
  refusal("\x01\x02\xff");
}

TEST_F(CameraFile, SaysWhatAFileNeedsWhenThereIsNone) {
  const std::string line =
      error_of<ConfigError>([&] { load_camera_file(folder_.path() + "/none.yaml"); });
  EXPECT_NE(line.find("none.yaml"), std::string::npos);
}

}  // namespace
}  // namespace foresight
