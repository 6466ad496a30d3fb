// Instants and spans in integer microseconds. Library code receives them and cannot ask for "now":
// only the process host has a clock, so a core behaves the same live, on a log and in simulation.
#pragma once

#include <compare>
#include <cstdint>

namespace foresight {

struct Duration {
  int64_t us = 0;
  constexpr auto operator<=>(const Duration&) const = default;
  constexpr double seconds() const { return static_cast<double>(us) * 1e-6; }
};
constexpr Duration microseconds(int64_t us) { return {us}; }
constexpr Duration milliseconds(int64_t ms) { return {ms * 1000}; }
/// Rounds to the nearest microsecond.
constexpr Duration seconds(double s) {
  return {static_cast<int64_t>(s * 1e6 + (s < 0 ? -0.5 : 0.5))};
}

/// An instant: microseconds of the clock that stamps the messages (`utime` fields).
struct Time {
  int64_t us = 0;
  constexpr auto operator<=>(const Time&) const = default;
};

constexpr Duration operator-(Time a, Time b) { return {a.us - b.us}; }
constexpr Time operator+(Time t, Duration d) { return {t.us + d.us}; }
constexpr Time operator-(Time t, Duration d) { return {t.us - d.us}; }
constexpr Duration operator+(Duration a, Duration b) { return {a.us + b.us}; }
constexpr Duration operator-(Duration a, Duration b) { return {a.us - b.us}; }
constexpr Duration operator*(Duration d, int64_t n) { return {d.us * n}; }

}  // namespace foresight
