#include "procs/omni/openhaptics_device.h"

#include "common/errors.h"

namespace foresight {
namespace {

constexpr HdApi::Enum kCurrentButtons = 0x2000;
constexpr HdApi::Enum kCurrentJointAngles = 0x2100;
constexpr HdApi::Enum kCurrentGimbalAngles = 0x2150;
constexpr HdApi::Enum kCalibrationStyle = 0x2555;
constexpr HdApi::Enum kCalibrationNeedsUpdate = 0x5001;
constexpr HdApi::Enum kCalibrationNeedsManualInput = 0x5002;
constexpr HdApi::Handle kInvalidHandle = 0xFFFFFFFF;
constexpr unsigned int kErrorClass = 0xFF00;
constexpr unsigned int kForceErrors = 0x0200;  // warm motors, velocity …: readings are good
constexpr unsigned int kCallbackContinue = 1;
constexpr unsigned short kDefaultPriority = 0x7FFF;
constexpr int kButtons = 4;
constexpr Duration kServoSilence = milliseconds(250);

}  // namespace

HdApi::HdApi(const std::string& file)
    : library(file,
              "OpenHaptics and the driver of the Touch (3D Systems; packages openhaptics and "
              "touch-driver of the vendor), or choose another device") {
  library.find("hdInitDevice", init_device);
  library.find("hdDisableDevice", disable_device);
  library.find("hdStartScheduler", start_scheduler);
  library.find("hdStopScheduler", stop_scheduler);
  library.find("hdScheduleAsynchronous", schedule_asynchronous);
  library.find("hdUnschedule", unschedule);
  library.find("hdBeginFrame", begin_frame);
  library.find("hdEndFrame", end_frame);
  library.find("hdGetDoublev", get_doubles);
  library.find("hdGetIntegerv", get_integers);
  library.find("hdGetError", get_error);
  library.find("hdGetErrorString", get_error_string);
  library.find("hdCheckCalibration", check_calibration);
  library.find("hdUpdateCalibration", update_calibration);
}

OpenHapticsDevice::~OpenHapticsDevice() { disconnect(); }

void OpenHapticsDevice::open() {
  api_ = std::make_unique<HdApi>(options_.library);
  if (!try_connect()) throw UnavailableError("device=openhaptics: " + problem_);
}

bool OpenHapticsDevice::try_connect() {
  const char* name = options_.device_name.empty() ? nullptr : options_.device_name.c_str();
  device_ = api_->init_device(name);
  HdApi::Error error = api_->get_error();
  if (error.code != 0 || device_ == kInvalidHandle) {
    const char* text = api_->get_error_string(error.code);
    problem_ = "the device cannot be initialised: " + std::string(text != nullptr ? text : "?") +
               " (is it plugged in, and set up with the vendor's tool?)";
    return false;
  }
  servo_ = last_ = Snapshot{};
  has_advanced_ = false;
  task_ = api_->schedule_asynchronous(&OpenHapticsDevice::on_servo, this, kDefaultPriority);
  api_->start_scheduler();
  connected_ = true;
  return true;
}

void OpenHapticsDevice::disconnect() {
  if (!connected_) return;
  api_->stop_scheduler();
  api_->unschedule(task_);
  api_->disable_device(device_);
  connected_ = false;
}

unsigned int OpenHapticsDevice::on_servo(void* self) {
  static_cast<OpenHapticsDevice*>(self)->take_snapshot();
  return kCallbackContinue;
}

void OpenHapticsDevice::take_snapshot() {
  Snapshot now;
  now.calibration = api_->check_calibration();
  if (now.calibration == kCalibrationNeedsUpdate) {
    int styles = 0;
    api_->get_integers(kCalibrationStyle, &styles);
    const int lowest = styles & -styles;  // one style of those the device knows
    api_->update_calibration(static_cast<HdApi::Enum>(lowest));
  }
  api_->begin_frame(device_);
  api_->get_doubles(kCurrentJointAngles, now.position_rad.data());
  api_->get_doubles(kCurrentGimbalAngles, now.position_rad.data() + 3);
  api_->get_integers(kCurrentButtons, &now.buttons);
  api_->end_frame(device_);
  now.error = api_->get_error().code;
  const std::lock_guard lock(mutex_);
  now.count = servo_.count + 1;
  servo_ = now;
}

// Empty when the snapshot is good.
std::string OpenHapticsDevice::find_problem(Time now, const Snapshot& snapshot) {
  if (!has_advanced_ || snapshot.count != last_.count) advanced_ = now;
  has_advanced_ = true;
  if (now - advanced_ > kServoSilence) return "the device's servo loop stands still; trying again";
  if (snapshot.error != 0 && (snapshot.error & kErrorClass) != kForceErrors) {
    const char* text = api_->get_error_string(snapshot.error);
    return std::string(text != nullptr ? text : "device error") + "; trying again";
  }
  return {};
}

DeviceReading OpenHapticsDevice::read(Time now) {
  if (!connected_ && retry_.due(now)) static_cast<void>(try_connect());
  if (connected_) {
    Snapshot snapshot;
    {
      const std::lock_guard lock(mutex_);
      snapshot = servo_;
    }
    problem_ = find_problem(now, snapshot);
    if (problem_.empty()) {
      last_ = snapshot;
    } else {
      disconnect();
      static_cast<void>(retry_.due(now));
    }
  }
  DeviceReading reading{.connected = connected_ && last_.count > 0, .problem = problem_};
  reading.axes.assign(last_.position_rad.begin(), last_.position_rad.end());
  for (int i = 0; i < kButtons; ++i) {
    reading.buttons.push_back(static_cast<uint8_t>(last_.buttons >> i & 1));
  }
  const auto clutch = static_cast<size_t>(options_.clutch_button - 1);
  const bool calibrated = last_.calibration != kCalibrationNeedsManualInput;
  reading.engaged = reading.connected && calibrated && clutch < reading.buttons.size() &&
                    reading.buttons[clutch] != 0;
  if (reading.connected && !calibrated) {
    reading.problem = "the device needs calibration: put the stylus into its inkwell";
  } else if (connected_ && !reading.connected) {
    reading.problem = "no reading yet";
  }
  return reading;
}

}  // namespace foresight
