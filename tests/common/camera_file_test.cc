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

TEST_F(CameraFile, WithoutK3HasNone) {
  EXPECT_EQ(load(replaced(kGood, "k3: 1.163314\n", "")).distortion[4], 0);
  EXPECT_NE(refusal(replaced(kGood, "p2: 0.002628\n", "")).find("p2: missing"), std::string::npos);
}

// They bend the picture: to leave them out silently is to have another lens.
TEST_F(CameraFile, RefusesCoefficientsOfOtherModelsByName) {
  const std::string line = refusal(kGood + "k4: 0.3\nk5: 0.1\nk6: 0.02\n");
  for (const char* part : {"k4", "0.3", "pinhole_radtan", "rational"}) {
    EXPECT_NE(line.find(part), std::string::npos) << line;
  }
  EXPECT_EQ(load(kGood + "k4: 0\nk5: 0\nk6: 0\n"), load(kGood));
}

TEST_F(CameraFile, RefusesWhatNoImageOfItsSizeHas) {
  const auto expect = [&](const std::string& from, const std::string& to,
                          const std::vector<std::string>& parts) {
    const std::string line = refusal(replaced(kGood, from, to));
    for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << line;
  };
  expect("fx: 517.3", "fx: 1.2", {"fx: 1.2 is outside [64, 6400]", "640 px wide"});
  expect("fy: 516.5", "fy: 99000", {"fy: 99000 is outside [64, 6400]"});
  expect("fy: 516.5", "fy: 100", {"fx / fy", "0.4, 2.5"});
  expect("cx: 318.6", "cx: 900", {"cx: 900 is outside [0, 640]"});
  expect("cx: 318.6", "cx: -900", {"cx: -900 is outside"});
  expect("cy: 255.3", "cy: 481", {"cy: 481 is outside [0, 480]"});
  expect("fx: 517.3", "fx: -517.3", {"fx: -517.3"});
}

const std::string kSize = "image_width: 320\nimage_height: 240\n";
const std::string kMatrix = "[262.5, 0, 154.0, 0, 262.1, 118.0, 0, 0, 1]";

TEST_F(CameraFile, OfRosIsRead) {
  const std::string ros = kSize + "camera_name: narrow\ncamera_matrix:\n  rows: 3\n  cols: 3\n" +
                          "  data: " + kMatrix + "\ndistortion_model: plumb_bob\n" +
                          "distortion_coefficients:\n  rows: 1\n  cols: 5\n" +
                          "  data: [0.11, -0.2, 0.01, 0.02, 0.03]\n";
  const CameraModel camera = load(ros);
  EXPECT_EQ(camera.width_px, 320);
  EXPECT_EQ(camera.fx_px, 262.5);
  EXPECT_EQ(camera.cy_px, 118);
  EXPECT_EQ(camera.distortion, (std::array{0.11, -0.2, 0.01, 0.02, 0.03}));
  const std::string rational =
      replaced(replaced(ros, "plumb_bob", "rational_polynomial"), "0.03]", "0.03, 0.3, 0.1, 0.2]");
  EXPECT_NE(refusal(rational).find("distortion_coefficients: 0.3"), std::string::npos);
  EXPECT_EQ(load(replaced(rational, "0.3, 0.1, 0.2]", "0, 0, 0]")), camera);
  const std::string fisheye = replaced(replaced(ros, "plumb_bob", "equidistant"), ", 0.03]", "]");
  EXPECT_EQ(load(fisheye).lens, LensModel::kEquidistant);
  EXPECT_NE(refusal(replaced(ros, "plumb_bob", "double_sphere")).find("'double_sphere'"),
            std::string::npos);
  EXPECT_NE(refusal(replaced(ros, "154.0", "900")).find("camera_matrix: cx: 900"),
            std::string::npos);
  // rostopic echo /camera_info
  EXPECT_EQ(load("height: 240\nwidth: 320\ndistortion_model: plumb_bob\n" +
                 std::string("D: [0.11, -0.2, 0.01, 0.02, 0.03]\nK: ") + kMatrix + "\n"),
            camera);
}

TEST_F(CameraFile, OfOpenCvIsRead) {
  const std::string opencv =
      "%YAML:1.0\n---\n" + kSize + "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n" +
      "   dt: d\n   data: [ 262.5, 0., 154., 0., 262.1, 118., 0., 0., 1. ]\n" +
      "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n" +
      "   data: [ 1.1e-01, -2.0e-01, 0., 0., 0. ]\n";
  EXPECT_EQ(load(opencv).cx_px, 154);
  EXPECT_EQ(load(opencv).distortion[1], -0.2);
  EXPECT_NE(refusal(replaced(opencv, "image_width: 320\n", "")).find("image_width: missing"),
            std::string::npos);
  EXPECT_NE(refusal("<?xml version=\"1.0\"?>\n<opencv_storage/>\n").find("is XML"),
            std::string::npos);
}

TEST_F(CameraFile, OfKalibrAndEurocIsRead) {
  const std::string kalibr =
      "cam0:\n  camera_model: pinhole\n  intrinsics: [262.5, 262.1, 154, 118]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [0.11, -0.2, 0.01, 0.02]\n"
      "  resolution: [320, 240]\n";
  EXPECT_EQ(load(kalibr).fy_px, 262.1);
  EXPECT_EQ(load(kalibr).distortion, (std::array{0.11, -0.2, 0.01, 0.02, 0.0}));
  EXPECT_NE(refusal(replaced(kalibr, "pinhole", "omni")).find("scripts/calibrate_camera"),
            std::string::npos);
}

TEST_F(CameraFile, OfAnotherKindSaysHowToConvert) {
  for (const char* other : {"Camera.fx: 500\nCamera.fy: 500\n", "focal: 500\n"}) {
    const std::string line = refusal(other);
    EXPECT_NE(line.find("write model, width, height, fx"), std::string::npos) << line;
  }
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
