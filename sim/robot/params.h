#pragma once

#include <string>
#include <vector>

#include "common/params.h"
#include "sim/base/base_script.h"
#include "sim/ray_camera.h"

namespace foresight::sim {

constexpr auto names_of(BaseScript::Kind) {
  using enum BaseScript::Kind;
  return std::array{EnumName{kStill, "still"}, EnumName{kPush, "push"}, EnumName{kRamp, "ramp"},
                    EnumName{kWaves, "waves"}, EnumName{kRandomWalk, "random_walk"}};
}
constexpr auto names_of(Antialiasing) {
  using enum Antialiasing;
  return std::array{EnumName{kNone, "none"}, EnumName{kEdges, "edges"}, EnumName{kFull, "full"}};
}
enum class WorldClock { kHost, kOwn };
constexpr auto names_of(WorldClock) {
  return std::array{EnumName{WorldClock::kHost, "host"}, EnumName{WorldClock::kOwn, "own"}};
}

struct SimParams {
  std::string arm_file = "deploy/arms/wam4.yaml";
  bool start_active = true;
  double heartbeat_s = 0.1;
  double friction = 1;

  BaseScript::Kind base_motion = BaseScript::Kind::kStill;
  double base_start_s = 5;
  double base_duration_s = 1;
  double base_amplitude_m = 0.1;
  double base_amplitude_deg = 5;
  double base_direction_deg = 90;
  double base_speed_m_per_s = 0.05;
  double base_period_s = 6;

  std::string scene = "lab";
  std::string letters = "DABCEF";
  std::vector<int> panel_places = {0, 3};
  std::vector<std::string> lit_leds = {"111101111", "111111111"};
  double camera_rate_hz = 30;
  int camera_width_px = 640;
  double camera_latency_s = 0.03;
  double camera_shutter_s = 0;
  double camera_exposure = 1;
  double camera_noise_levels = 1.5;
  bool camera_distorted = false;
  Antialiasing camera_antialiasing = Antialiasing::kNone;
  int jpeg_quality = 85;

  double truth_rate_hz = 100;
  WorldClock clock = WorldClock::kHost;
  double speed = 1;
  int seed = 1;

  template <class V>
  void visit(V& v) {
    visit_arm(v);
    visit_base(v);
    visit_camera(v);
    v("truth_rate_hz", truth_rate_hz,
      {.unit = "Hz", .min = 0, .max = 500, .doc = "of TRUTH_STATE; 0: none"});
    v("clock", clock,
      {.doc = "host: the world lives by this process's clock; own: it runs at its own pace, waits "
              "for the controller and for its own pictures, and publishes CLOCK"});
    v("speed", speed,
      {.unit = "1",
       .min = 0.01,
       .max = 100,
       .doc = "with clock=own: at most this many times as fast as the wall clock"});
    v("seed", seed, {.unit = "1", .min = 0, .max = 2e9, .doc = "of the lab, and of random_walk"});
  }

 private:
  template <class V>
  void visit_arm(V& v) {
    v("arm_file", arm_file, {.doc = "description of the arm (deploy/arms/)"});
    v("start_active", start_active,
      {.doc = "begin with the safety board ACTIVE; else IDLE, until someone presses ACTIVATE"});
    v("heartbeat_s", heartbeat_s,
      {.unit = "s",
       .min = 0.004,
       .max = 10,
       .doc = "longest time without torques before the safety board cuts the motors"});
    v("friction", friction,
      {.unit = "1",
       .min = 0,
       .max = 10,
       .doc = "factor on the joints' friction (4 % of the torque limit Coulomb, 2 % per rad/s)"});
  }
  template <class V>
  void visit_base(V& v) {
    v("base_motion", base_motion,
      {.doc = "how the base is moved about; nothing but the truth tells"});
    v("base_start_s", base_start_s,
      {.unit = "s", .min = 0, .max = 1e6, .doc = "after the start, when that begins"});
    v("base_duration_s", base_duration_s,
      {.unit = "s", .min = 0.05, .max = 1e4, .doc = "of a push or ramp"});
    v("base_amplitude_m", base_amplitude_m,
      {.unit = "m", .min = 0, .max = 2, .doc = "displacement of push, waves and random_walk"});
    v("base_amplitude_deg", base_amplitude_deg,
      {.unit = "deg", .min = -90, .max = 90, .doc = "turn of push, waves and random_walk"});
    v("base_direction_deg", base_direction_deg,
      {.unit = "deg",
       .min = -180,
       .max = 180,
       .doc = "of push and ramp: 0 forwards, to the desk; 90 to the left"});
    v("base_speed_m_per_s", base_speed_m_per_s,
      {.unit = "m/s", .min = 0, .max = 2, .doc = "of a ramp"});
    v("base_period_s", base_period_s,
      {.unit = "s", .min = 0.5, .max = 100, .doc = "of the fastest heave of waves"});
  }
  template <class V>
  void visit_camera(V& v) {
    v("scene", scene, {.doc = "what there is to see: lab, or a scene file (OBJ, glTF, GLB)"});
    v("letters", letters,
      {.doc = "of the lab: the card at each of its six places, A to F; a space leaves one empty"});
    v("panel_places", panel_places,
      {.doc = "of the lab: where its two LED panels stand, of the places 0 to 4"});
    v("lit_leds", lit_leds,
      {.doc = "of the lab: 1 for each LED that is lit, by rows from the upper left, per panel"});
    v("camera_rate_hz", camera_rate_hz,
      {.unit = "Hz", .min = 0, .max = 200, .doc = "frames; 0: no camera"});
    v("camera_width_px", camera_width_px,
      {.unit = "px", .min = 64, .max = 4096, .doc = "the height is 3/4 of it"});
    v("camera_latency_s", camera_latency_s,
      {.unit = "s",
       .min = 0,
       .max = 1,
       .doc = "from the middle of the exposure to publication, at least"});
    v("camera_shutter_s", camera_shutter_s,
      {.unit = "s", .min = 0, .max = 0.1, .doc = "exposure time: blurs what moves; 0: sharp"});
    v("camera_exposure", camera_exposure,
      {.unit = "1", .min = 0.01, .max = 100, .doc = "factor on the light"});
    v("camera_noise_levels", camera_noise_levels,
      {.unit = "1", .min = 0, .max = 64, .doc = "standard deviation, in 8-bit levels"});
    v("camera_distorted", camera_distorted, {.doc = "a lens with barrel distortion"});
    v("camera_antialiasing", camera_antialiasing,
      {.doc = "which pixels get four rays instead of one"});
    v("jpeg_quality", jpeg_quality, {.unit = "1", .min = 1, .max = 100, .doc = "of IMAGE"});
  }
};

}  // namespace foresight::sim
