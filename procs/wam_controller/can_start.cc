#include "procs/wam_controller/can_start.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/errors.h"
#include "procs/wam_controller/can_socket.h"

namespace foresight {
namespace {

JointVector torque_units_of(const WamControllerParams& params, int joint_count) {
  const std::vector<double>& given = params.can_torque_units_per_nm;
  const bool all_positive = std::all_of(given.begin(), given.end(), [](double u) { return u > 0; });
  if (given.size() != static_cast<size_t>(joint_count) || !all_positive) {
    throw ConfigError("can_torque_units_per_nm: needs " + std::to_string(joint_count) +
                      " numbers above 0: the pucks' property IPNM");
  }
  JointVector units(joint_count);
  std::copy(given.begin(), given.end(), units.data());
  return units;
}

std::optional<HomeReference> stored_reference(const std::string& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  return read_home_reference(text.str());
}

}  // namespace

StartedCanArm start_can_arm(const WamControllerParams& params, const ArmModel& arm, Time now) {
  static_cast<void>(torque_units_of(params, arm.size()));  // a bus that is not there comes second
  return start_can_arm(params, arm, now, std::make_unique<CanSocket>(params.can_interface));
}

StartedCanArm start_can_arm(const WamControllerParams& params, const ArmModel& arm, Time now,
                            std::unique_ptr<CanBus> bus) {
  StartedCanArm can;
  can.bus = std::move(bus);
  can.arm = std::make_unique<CanArm>(*can.bus, arm, torque_units_of(params, arm.size()));
  if (!can.arm->start()) {
    throw UnavailableError("can_interface: " + params.can_interface +
                           ": not all motor controllers answer");
  }
  const auto counts = can.arm->position_counts();
  const HomeAnswer answer =
      find_home(arm, {.now = now,
                      .confirmed_at_s = static_cast<int64_t>(params.can_home_confirmed_at_s),
                      .stored = stored_reference(params.can_home_file),
                      .pucks_kept_running = can.arm->had_been_running(),
                      .counts = {counts.begin(), counts.end()}});
  if (!answer.reference) throw ConfigError(answer.refusal);
  can.home = *answer.reference;
  if (!keep_home_reference(params.can_home_file, can.home)) {
    throw UnavailableError("can_home_file: " + params.can_home_file + ": cannot be written");
  }
  can.arm->set_zero(can.home.counts_at_zero);
  return can;
}

bool keep_home_reference(const std::string& path, const HomeReference& home) {
  const std::filesystem::path target(path), fresh(path + ".new");
  std::error_code error;
  if (target.has_parent_path()) std::filesystem::create_directories(target.parent_path(), error);
  std::ofstream file(fresh);
  file << to_text(home);
  file.close();
  if (!file) return false;
  std::filesystem::rename(fresh, target, error);
  return !error;
}

}  // namespace foresight
