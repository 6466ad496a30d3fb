// The PHANTOM Omni (Touch) through the vendor's device library, which is loaded at run time. The
// declarations below are our own, from the facts of its API: names, signatures, constants.
//
// Joints: three of the arm, three of the gimbal, as the library reads them (rad). Clutch: a button
// on the stylus. No force is commanded.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <string>

#include "procs/omni/device_library.h"
#include "procs/omni/input_device.h"

namespace foresight {

/// The functions of libHD that we call.
struct HdApi {
  using Handle = unsigned int;
  using Enum = unsigned int;
  using Callback = unsigned int(void* user);
  struct Error {
    unsigned int code;
    int internal_code;
    Handle device;
  };

  explicit HdApi(const std::string& file);

  DeviceLibrary library;
  Handle (*init_device)(const char* name) = nullptr;
  void (*disable_device)(Handle) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  unsigned long (*schedule_asynchronous)(Callback*, void* user, unsigned short priority) = nullptr;
  void (*unschedule)(unsigned long) = nullptr;
  void (*begin_frame)(Handle) = nullptr;
  void (*end_frame)(Handle) = nullptr;
  void (*get_doubles)(Enum, double*) = nullptr;
  void (*get_integers)(Enum, int*) = nullptr;
  Error (*get_error)() = nullptr;
  const char* (*get_error_string)(unsigned int code) = nullptr;
  Enum (*check_calibration)() = nullptr;
  void (*update_calibration)(Enum style) = nullptr;
};

struct OpenHapticsOptions {
  std::string library = "libHD.so";
  std::string device_name = {};  // as in the vendor's set-up; empty: the default device
  int clutch_button = 1;         // counted from 1
};

class OpenHapticsDevice : public InputDevice {
 public:
  explicit OpenHapticsDevice(OpenHapticsOptions options) : options_(std::move(options)) {}
  ~OpenHapticsDevice() override;
  void open() override;
  DeviceReading read(Time now) override;

 private:
  // What the servo thread (1 kHz) last read.
  struct Snapshot {
    int64_t count = 0;
    std::array<double, 6> position_rad{};
    int buttons = 0;
    unsigned int error = 0, calibration = 0;
  };
  bool try_connect();
  void disconnect();
  static unsigned int on_servo(void* self);
  void take_snapshot();
  std::string find_problem(Time now, const Snapshot& snapshot);

  OpenHapticsOptions options_;
  std::unique_ptr<HdApi> api_;
  bool connected_ = false;
  HdApi::Handle device_ = 0;
  unsigned long task_ = 0;
  std::mutex mutex_;  // of servo_
  Snapshot servo_;
  Snapshot last_;  // main thread only
  Time advanced_;  // when the servo thread was last seen to go on
  bool has_advanced_ = false;
  RetryTimer retry_;
  std::string problem_;
};

}  // namespace foresight
