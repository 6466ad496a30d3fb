// Makes absurd messages out of real ones, by their schemas: fingerprint and layout stay valid, the
// contents do not make sense. What no message may hold (numbers that are not finite, instants of no
// age, more bytes than its kind has) is made too, and marked: the border must refuse it.
//
//   Mutator mutator(seed);
//   Mutant mutant = mutator.mutate(schema, genuine_bytes, now);
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/time.h"
#include "tests/fuzz/message_record.h"

namespace foresight::fuzz {

struct Mutant {
  std::vector<uint8_t> bytes;
  std::string what;              // in words, for who looks for the fault
  bool must_be_refused = false;  // by find_layout_error()
};

class Mutator {
 public:
  explicit Mutator(uint64_t seed) : random_(seed) {}

  /// One to three changes of a genuine message, or, now and then, the message as it was.
  Mutant mutate(const MessageSchema& schema, std::span<const uint8_t> genuine, Time now);
  /// A message of a type of which there is no genuine one.
  std::vector<uint8_t> invent(const MessageSchema& schema, Time now);

 private:
  // A field of the message or of a struct within it.
  struct Place {
    const MessageSchema* schema;
    Record* record;
    size_t field;
    const FieldSchema& kind() const { return schema->fields[field]; }
    Column& column() const { return record->columns[field]; }
  };

  Place choose_place(const MessageSchema& schema, Record* record);
  std::string change(const MessageSchema& schema, Record* record, Time now);
  std::string change_number(const Place& place, Time now);
  std::string change_text(const Place& place);
  std::string change_bytes(const Place& place);
  std::string change_count(const Place& place);
  std::string swap_fields(const Place& place);
  std::string swap_elements(const Place& place);
  std::string change_instant(const Place& place, Time now);
  uint64_t extreme(FieldKind kind);
  uint64_t below(uint64_t n) { return random_() % n; }

  std::mt19937_64 random_;
};

}  // namespace foresight::fuzz
