// A HealthTable as text for a terminal, and as JSON.
#pragma once

#include <string>

#include "procs/top/health_table.h"

namespace foresight {

enum class Ports : uint8_t { kBusy, kAll };  // kBusy: those that ever carried a message
enum class Colour : uint8_t { kOff, kOn };

std::string to_text(const HealthTable& table, Time now, Ports ports, Colour colour);

/// One line, one object: {"utime", "processes": [{…, "ports": [{…}], "metrics": {…}}], "link":
/// […]}.
std::string to_json(const HealthTable& table, Time now);

}  // namespace foresight
