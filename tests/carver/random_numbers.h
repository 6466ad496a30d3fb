// Random choices from a seeded generator, the same on every platform.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

namespace foresight::carver_test {

/// A whole number from 0 to bound − 1.
inline int below(std::mt19937& random, int bound) {
  return static_cast<int>(random() % static_cast<uint32_t>(bound));
}

inline double real(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

template <class T, size_t N>
T one_of(const std::array<T, N>& values, std::mt19937& random) {
  return values[static_cast<size_t>(below(random, static_cast<int>(N)))];
}

}  // namespace foresight::carver_test
