#include "procs/omni/device_config.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/check.h"
#include "common/yaml_reader.h"
#include "procs/omni/file_device.h"
#include "procs/omni/gamepad_device.h"
#include "procs/omni/keyboard_device.h"
#include "procs/omni/openhaptics_device.h"
#include "procs/omni/script_device.h"
#include "procs/omni/spacemouse_device.h"

namespace foresight {
namespace {

constexpr int kMaxAxes = 16;

JointSource read_source(YamlReader& in) {
  JointSource source;
  if (!in.has("axis")) {  // held
    if (in.has("hold_rad")) source.offset_rad = in.number("hold_rad", -6.3, 6.3);
    return source;
  }
  const double axis = in.number("axis", 1, kMaxAxes);
  source.axis = static_cast<int>(axis);
  if (source.axis != axis) in.refuse("axis", "must be a whole number");
  source.scale = in.number_or("scale", 1, -100, 100);
  if (source.scale == 0) in.refuse("scale", "must not be 0; leave axis out to hold the joint");
  source.offset_rad = in.number_or("offset_rad", 0, -20, 20);
  return source;
}

// The device's own clutch button, unless the parameters name one.
int clutch_button(const OmniParams& params, int of_device) {
  return params.clutch_button > 0 ? params.clutch_button : of_device;
}

std::unique_ptr<InputDevice> make_script(const OmniParams& params, const ArmModel& arm,
                                         const JointMapping& mapping) {
  if (mapping.axes_needed() > static_cast<int>(kOmniRanges.size())) {
    throw ConfigError("mapping_file: device=script has 6 axes, the mapping needs " +
                      std::to_string(mapping.axes_needed()));
  }
  auto axes =
      plan_script_axes(arm, mapping, kOmniRanges, params.commander.limit_margin_rad, params.script);
  return std::make_unique<ScriptDevice>(ScriptMotion(std::move(axes), params.script),
                                        params.start_delay_s);
}

std::unique_ptr<InputDevice> make_file(const OmniParams& params, MotionStyle style) {
  return std::make_unique<FileDevice>(FileOptions{.path = params.device_path,
                                                  .style = style,
                                                  .start_delay_s = params.start_delay_s,
                                                  .loop = params.loop,
                                                  .resume = params.resume});
}

std::unique_ptr<InputDevice> make_waypoints(const OmniParams& params, const ArmModel&,
                                            const JointMapping&) {
  return make_file(params, MotionStyle::kRest);
}

std::unique_ptr<InputDevice> make_recorded(const OmniParams& params, const ArmModel&,
                                           const JointMapping&) {
  return make_file(params, MotionStyle::kLinear);
}

std::unique_ptr<InputDevice> make_openhaptics(const OmniParams& params, const ArmModel&,
                                              const JointMapping&) {
  return std::make_unique<OpenHapticsDevice>(OpenHapticsOptions{
      .device_name = params.device_path, .clutch_button = clutch_button(params, 1)});
}

std::unique_ptr<InputDevice> make_gamepad(const OmniParams& params, const ArmModel&,
                                          const JointMapping& mapping) {
  GamepadOptions options{
      .dead_zone = params.dead_zone, .silence_s = params.stick_silence_s, .mapping = mapping};
  if (!params.device_path.empty()) options.path = params.device_path;
  options.clutch_button = clutch_button(params, options.clutch_button);
  return std::make_unique<GamepadDevice>(file_opener(options.path), options);
}

std::unique_ptr<InputDevice> make_keyboard(const OmniParams& params, const ArmModel&,
                                           const JointMapping&) {
  const std::string& path = params.device_path;
  if (path.empty()) {
    return std::make_unique<KeyboardDevice>(standard_input_opener(),
                                            KeyboardOptions{.hold_s = params.key_hold_s});
  }
  return std::make_unique<KeyboardDevice>(
      file_opener(path),
      KeyboardOptions{.name = path, .hold_s = params.key_hold_s, .needs_terminal = false});
}

std::unique_ptr<InputDevice> make_spacemouse(const OmniParams& params, const ArmModel&,
                                             const JointMapping&) {
  return std::make_unique<SpaceMouseDevice>(
      SpaceMouseOptions{.dead_zone = params.dead_zone, .clutch_button = clutch_button(params, 1)});
}

// Everything that differs from device to device: a new one is a line here, and its name in
// params.h.
struct DeviceEntry {
  DeviceKind kind;
  JointMapping (*mapping)();
  std::unique_ptr<InputDevice> (*make)(const OmniParams&, const ArmModel&, const JointMapping&);
};
constexpr DeviceEntry kDevices[] = {
    {DeviceKind::kScript, paper_mapping, make_script},
    {DeviceKind::kWaypoints, paper_mapping, make_waypoints},
    {DeviceKind::kRecorded, paper_mapping, make_recorded},  // or that of the recorded device
    {DeviceKind::kOpenHaptics, paper_mapping, make_openhaptics},
    {DeviceKind::kGamepad, gamepad_mapping, make_gamepad},
    {DeviceKind::kKeyboard, keyboard_mapping, make_keyboard},
    {DeviceKind::kSpaceMouse, spacemouse_mapping, make_spacemouse},
};
static_assert(std::size(kDevices) == names_of(DeviceKind{}).size());

const DeviceEntry& entry_of(DeviceKind kind) {
  const auto* at = std::find_if(std::begin(kDevices), std::end(kDevices),
                                [kind](const DeviceEntry& entry) { return entry.kind == kind; });
  FORESIGHT_CHECK(at != std::end(kDevices));
  return *at;
}

}  // namespace

JointMapping load_mapping_file(const std::string& path, const ArmModel& arm) {
  YamlReader in = YamlReader::open(path);
  JointMapping mapping;
  if (in.has("axes")) {
    for (YamlReader& axis : in.list("axes", 1, kMaxAxes)) {
      const double sign = axis.number("sign", -1, 1);
      if (std::abs(sign) != 1) axis.refuse("sign", "must be 1 or -1");
      mapping.axis_signs.push_back(sign);
      axis.refuse_leftovers();
    }
  }
  for (YamlReader& joint : in.list("joints", 1, arm.joints.size())) {
    mapping.joints.push_back(read_source(joint));
    joint.refuse_leftovers();
  }
  in.refuse_leftovers();
  return mapping;
}

JointMapping choose_mapping(const OmniParams& params, const ArmModel& arm) {
  DeviceKind kind = params.device;
  if (kind == DeviceKind::kRecorded && params.mapping_file.empty()) {
    kind = value_named<DeviceKind>(recorded_device(params.device_path)).value_or(kind);
  }
  JointMapping mapping = params.mapping_file.empty() ? entry_of(kind).mapping()
                                                     : load_mapping_file(params.mapping_file, arm);
  if (mapping.joints.size() > arm.joints.size()) mapping.joints.resize(arm.joints.size());
  return mapping;
}

std::unique_ptr<InputDevice> make_device(const OmniParams& params, const ArmModel& arm,
                                         const JointMapping& mapping) {
  return entry_of(params.device).make(params, arm, mapping);
}

}  // namespace foresight
