// A stand-in for the vendor's libHD.so: its symbols, and fake_hd_* by which a test moves the
// device. It has no thread: fake_hd_tick() is one turn of the servo loop.
#include <cstring>

namespace {

struct ErrorInfo {
  unsigned int code;
  int internal_code;
  unsigned int device;
};
using Callback = unsigned int(void*);

struct State {
  bool is_plugged = true;
  bool is_running = false;
  Callback* callback = nullptr;
  void* user = nullptr;
  double joints[3] = {0, 0, 0}, gimbal[3] = {0, 0, 0};
  int buttons = 0;
  unsigned int error = 0, calibration = 0x5000;
  int initialised = 0, disabled = 0, frames = 0, updates = 0;
  char name[64] = "";
} g;

}  // namespace

extern "C" {

unsigned int hdInitDevice(const char* name) {
  std::strncpy(g.name, name != nullptr ? name : "(default)", sizeof g.name - 1);
  if (!g.is_plugged) {
    g.error = 0x0300;
    return 0xFFFFFFFF;
  }
  ++g.initialised;
  return 7;
}
void hdDisableDevice(unsigned int) { ++g.disabled; }
void hdStartScheduler() { g.is_running = true; }
void hdStopScheduler() { g.is_running = false; }
unsigned long hdScheduleAsynchronous(Callback* callback, void* user, unsigned short) {
  g.callback = callback;
  g.user = user;
  return 3;
}
void hdUnschedule(unsigned long) { g.callback = nullptr; }
void hdBeginFrame(unsigned int device) { g.frames += device == 7 ? 1 : 1000; }
void hdEndFrame(unsigned int) {}
void hdGetDoublev(unsigned int what, double* values) {
  if (what == 0x2100) std::memcpy(values, g.joints, sizeof g.joints);
  if (what == 0x2150) std::memcpy(values, g.gimbal, sizeof g.gimbal);
}
void hdGetIntegerv(unsigned int what, int* value) {
  if (what == 0x2000) *value = g.buttons;
  if (what == 0x2555) *value = 4;  // inkwell
}
ErrorInfo hdGetError() {
  const ErrorInfo error{g.error, 0, 7};
  g.error = 0;  // reading takes it off the stack
  return error;
}
const char* hdGetErrorString(unsigned int code) {
  return code == 0x0300 ? "Device fault" : "Communication error";
}
unsigned int hdCheckCalibration() { return g.calibration; }
void hdUpdateCalibration(unsigned int style) {
  ++g.updates;
  if (style == 4) g.calibration = 0x5000;
}

void fake_hd_reset() { g = State(); }
void fake_hd_plug(int plugged) { g.is_plugged = plugged != 0; }
void fake_hd_move(const double* six_rad, int buttons) {
  std::memcpy(g.joints, six_rad, sizeof g.joints);
  std::memcpy(g.gimbal, six_rad + 3, sizeof g.gimbal);
  g.buttons = buttons;
}
void fake_hd_fail(unsigned int error) { g.error = error; }
void fake_hd_calibration(unsigned int status) { g.calibration = status; }
void fake_hd_tick() {
  if (g.is_running && g.callback != nullptr) g.callback(g.user);
}
int fake_hd_initialised() { return g.initialised; }
int fake_hd_disabled() { return g.disabled; }
int fake_hd_updates() { return g.updates; }
int fake_hd_is_running() { return g.is_running ? 1 : 0; }
const char* fake_hd_name() { return g.name; }

}  // extern "C"
