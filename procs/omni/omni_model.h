// The PHANTOM Omni (now "Touch") as its library reads it: how far its joints can be turned.
#pragma once

#include <array>

namespace foresight {

struct AxisRange {
  double lower_rad, upper_rad;
};

/// Three joints (the third is absolute, through a parallel linkage), then the gimbal's three.
constexpr std::array<AxisRange, 6> kOmniRanges{
    {{-0.98, 0.98}, {0, 1.75}, {-0.81, 1.25}, {-2.5, 2.5}, {0, 2.4}, {-2.6, 2.6}}};

}  // namespace foresight
