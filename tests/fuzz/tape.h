// What was thrown, in memory that a child process shares with its parent: so that the very same
// messages, or some of them, can be thrown again whatever the system answers.
//
//   Tape tape(std::size_t{2} << 30);        // before fork(); memory is used as it is written
//   tape.append(thrown);                    // in the child
//   std::vector<Thrown> all = tape.read();  // in the parent; empty when it was too small
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/host.h"
#include "common/time.h"

namespace foresight::fuzz {

struct Thrown {
  Time time;
  Domain domain = Domain::kRobot;
  std::string channel;
  std::string only_for;  // one process; empty: everybody
  std::string what;      // in words
  std::vector<uint8_t> bytes;
};

class Tape {
 public:
  /// Throws std::bad_alloc.
  explicit Tape(size_t capacity);
  ~Tape();
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  void append(const Thrown& thrown);
  std::vector<Thrown> read() const;
  void clear();

 private:
  struct Head {
    size_t used = 0;
    bool is_full = false;
  };
  void put(const void* data, size_t size);
  Head& head() const { return *static_cast<Head*>(memory_); }
  uint8_t* bytes() const { return static_cast<uint8_t*>(memory_) + sizeof(Head); }

  size_t capacity_;
  void* memory_;
};

}  // namespace foresight::fuzz
