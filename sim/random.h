// Seeded random numbers with the same values on every machine (the distributions of <random> differ
// between standard libraries). A stream name keeps the parts of a scene independent: adding an
// object does not change the others.
//
//   Random random(seed, "desk");
//   const double yaw_rad = random.uniform(-0.2, 0.2);
#pragma once

#include <cstdint>
#include <string_view>

namespace foresight::sim {

class Random {
 public:
  Random(uint64_t seed, std::string_view stream) : state_(seed * 0x9E3779B97F4A7C15u) {
    for (const char c : stream) state_ = (state_ ^ static_cast<uint8_t>(c)) * 0x100000001B3u;
    next();
  }

  /// 64 random bits (SplitMix64, Steele et al. 2014).
  uint64_t next() {
    state_ += 0x9E3779B97F4A7C15u;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In 0 … count − 1.
  int below(int count) { return static_cast<int>(uniform() * count); }
  /// Mean 0, standard deviation 1, bounded by ±6 (sum of twelve uniforms).
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  uint64_t state_;
};

}  // namespace foresight::sim
