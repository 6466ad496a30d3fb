#include "procs/omni/spacemouse_device.h"

#include <poll.h>

#include <algorithm>

#include "common/errors.h"
#include "procs/omni/joystick_decoder.h"

namespace foresight {
namespace {

constexpr int kMotionEvent = 1, kButtonEvent = 2;
constexpr double kFullScale = 350;
constexpr int kMaxButtons = 64;
constexpr int kMaxEventsPerReading = 1000;
// Of a deflected cap, which speaks at 60 Hz or more.
constexpr Duration kSilence = seconds(0.5);

}  // namespace

SpnavApi::SpnavApi(const std::string& file)
    : library(file, "the packages libspnav0 and spacenavd, or choose another device") {
  library.find("spnav_open", open);
  library.find("spnav_close", close);
  library.find("spnav_fd", fd);
  library.find("spnav_poll_event", poll_event);
}

SpaceMouseDevice::~SpaceMouseDevice() {
  if (connected_) api_->close();
}

void SpaceMouseDevice::open() {
  api_ = std::make_unique<SpnavApi>(options_.library);
  connected_ = api_->open() != -1;
  if (!connected_) {
    throw UnavailableError("device=spacemouse: spacenavd does not answer (is it running?)");
  }
}

// The library does not tell that the daemon has gone, but its socket does.
bool SpaceMouseDevice::daemon_is_there() const {
  pollfd state{.fd = api_->fd(), .events = POLLIN | POLLRDHUP, .revents = 0};
  if (state.fd < 0) return false;
  return poll(&state, 1, 0) <= 0 || (state.revents & (POLLRDHUP | POLLHUP | POLLERR)) == 0;
}

void SpaceMouseDevice::drain(Time now) {
  SpnavApi::Event event{};
  for (int i = 0; i < kMaxEventsPerReading && api_->poll_event(&event) > 0; ++i) {
    take(event);
    last_event_ = now;
  }
}

void SpaceMouseDevice::take(const SpnavApi::Event& event) {
  if (event.type == kMotionEvent) {
    const SpnavApi::Motion& m = event.motion;
    const int values[6] = {m.x, m.y, m.z, m.rx, m.ry, m.rz};
    for (size_t i = 0; i < axes_.size(); ++i) {
      axes_[i] =
          without_dead_zone(std::clamp(values[i] / kFullScale, -1.0, 1.0), options_.dead_zone);
    }
  } else if (event.type == kButtonEvent) {
    const int number = event.button.number;
    if (number < 0 || number >= kMaxButtons) return;
    const auto index = static_cast<size_t>(number);
    if (index >= buttons_.size()) buttons_.resize(index + 1, 0);
    buttons_[index] = event.button.press != 0 ? 1 : 0;
  }
}

DeviceReading SpaceMouseDevice::read(Time now) {
  if (!connected_ && retry_.due(now)) connected_ = api_->open() != -1;
  if (connected_ && !daemon_is_there()) {
    api_->close();
    connected_ = false;
    std::fill(axes_.begin(), axes_.end(), 0.0);
    std::fill(buttons_.begin(), buttons_.end(), uint8_t{0});
    static_cast<void>(retry_.due(now));
  }
  if (connected_) drain(now);
  DeviceReading reading{.connected = connected_, .kind = AxisKind::kVelocity, .axes = axes_};
  reading.buttons = buttons_;
  const auto clutch = static_cast<size_t>(options_.clutch_button - 1);
  reading.engaged = connected_ && clutch < buttons_.size() && buttons_[clutch] != 0;
  const bool is_deflected =
      std::any_of(axes_.begin(), axes_.end(), [](double axis) { return axis != 0; });
  reading.silent = reading.engaged && is_deflected && now - last_event_ >= kSilence;
  if (reading.silent) {
    reading.problem = "the cap is held, but the SpaceMouse says nothing: counts as let go";
  }
  if (!connected_) reading.problem = "spacenavd has gone; trying again";
  return reading;
}

}  // namespace foresight
