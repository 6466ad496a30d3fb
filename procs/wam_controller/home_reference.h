// Where the motors' counts have their zero. The motor controllers ("pucks") count from where they
// woke up, so a person puts the arm into its home position and confirms it, once after they were
// switched on. The answer is kept, and serves a restarted process only while it is proved that the
// pucks went on counting; the arm's present place is never taken for home without a new word.
//
//   const HomeAnswer answer = find_home(arm, {.stored = read_home_reference(text), …});
//   if (!answer.reference) throw ConfigError(answer.refusal);
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/arm_model.h"
#include "common/time.h"

namespace foresight {

struct HomeReference {
  std::string arm;             // as the arm file names it
  int64_t confirmed_at_s = 0;  // since 1970, by whom it stood at home then
  std::vector<int32_t> counts_at_zero, counts_last_seen;  // of each motor
};
std::string to_text(const HomeReference& reference);
/// Nothing when the text is no such reference.
std::optional<HomeReference> read_home_reference(const std::string& text);

struct HomeQuestion {
  Time now;
  int64_t confirmed_at_s = 0;           // the person's word; 0: none
  std::optional<HomeReference> stored;  // of the last process
  bool pucks_kept_running = false;      // all were awake before this process woke them
  std::vector<int32_t> counts;          // of the motors now
};
struct HomeAnswer {
  std::optional<HomeReference> reference;
  std::string refusal;  // why there is none
};

/// A word counts once, and for 15 minutes. Without a new one the stored reference holds if the
/// pucks kept running, the motors are within 0.5 rad (of a joint) of where they were last seen, and
/// the joints within their limits. A word that contradicts such a reference by more than 0.1 rad is
/// refused: one of them is wrong.
HomeAnswer find_home(const ArmModel& arm, const HomeQuestion& question);

}  // namespace foresight
