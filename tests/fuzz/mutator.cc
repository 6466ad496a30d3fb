#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

namespace foresight::fuzz {
namespace {

// Longer strings and arrays are tried seldom: they are refused by their size, or cost time.
constexpr size_t kSmallCount = 40, kLargeCount = 30'000;

bool is_instant(const FieldSchema& field) {
  const std::string_view name = field.name;
  return field.kind == FieldKind::kInt64 &&
         (name.find("utime") != name.npos || name.ends_with("epoch") || name.ends_with("session"));
}

bool is_array(const FieldSchema& field) { return !field.dimensions.empty(); }

std::string name_of(const FieldSchema& field, size_t element) {
  return field.name + (is_array(field) ? "[" + std::to_string(element) + "]" : std::string());
}

// Of what is sent by itself; parts of other messages bear none.
void set_stamp(const MessageSchema& schema, Time now, Record* record) {
  if (std::string_view(schema.fields[0].name) != "utime") return;
  record->columns[0].numbers = {static_cast<uint64_t>(now.us)};
}

}  // namespace

std::vector<uint8_t> Mutator::invent(const MessageSchema& schema, Time now) {
  Record record = random_record(schema, random_);
  set_stamp(schema, now, &record);
  return write_record(schema, record);
}

Mutant Mutator::mutate(const MessageSchema& schema, std::span<const uint8_t> genuine, Time now) {
  Mutant mutant;
  if (below(20) == 0) return {{genuine.begin(), genuine.end()}, "once more as it was", false};
  Record record = read_record(schema, genuine);
  // Most pretend to be of now: old ones are dropped by many before anything else is looked at.
  if (below(2) == 0) set_stamp(schema, now, &record);
  for (uint64_t n = 1 + below(3); n > 0; --n) {
    mutant.what += (mutant.what.empty() ? "" : ", ") + change(schema, &record, now);
  }
  mutant.bytes = write_record(schema, record);
  mutant.must_be_refused = !find_layout_error(schema, mutant.bytes).empty();
  return mutant;
}

// Structs are entered, each field is as likely as any other of its message.
Mutator::Place Mutator::choose_place(const MessageSchema& schema, Record* record) {
  Place place{&schema, record, below(schema.fields.size())};
  while (place.kind().kind == FieldKind::kStruct && !place.column().records.empty()) {
    auto& records = place.column().records;
    Record* inner = &records[below(records.size())];
    const MessageSchema* nested = place.kind().nested;
    place = {nested, inner, below(nested->fields.size())};
  }
  return place;
}

std::string Mutator::change(const MessageSchema& schema, Record* record, Time now) {
  const Place place = choose_place(schema, record);
  const FieldSchema& field = place.kind();
  if (is_count(*place.schema, place.field)) return change_count(place);
  if (place.column().size() == 0) return std::string(field.name) + " is empty";
  if (field.kind == FieldKind::kStruct) return "nothing";
  if (field.kind == FieldKind::kString) return change_text(place);
  if (field.kind == FieldKind::kByte && is_array(field)) return change_bytes(place);
  switch (below(8)) {
    case 0:
      return swap_fields(place);
    case 1:
      return swap_elements(place);
    default:
      return is_instant(field) ? change_instant(place, now) : change_number(place, now);
  }
}

uint64_t Mutator::extreme(FieldKind kind) {
  const auto real = [&]() -> double {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::array values{0.0,   -0.0,    1.0,    -1.0, 1e308,     -1e308,
                            1e-40, 4e-324,  1e6,    -1e6, 1e30,      -1e30,
                            1e-9,  3.14159, 1000.0, 1e18, kInfinity, std::nan("")};
    return values[below(values.size())];
  };
  if (kind == FieldKind::kDouble) return std::bit_cast<uint64_t>(real());
  if (kind == FieldKind::kFloat) {
    const double v = real();
    const double limit = std::numeric_limits<float>::max();
    const double clamped = std::isfinite(v) ? std::clamp(v, -limit, limit) : v;
    return std::bit_cast<uint32_t>(static_cast<float>(clamped));
  }
  const int bits = 8 * static_cast<int>(bytes_of(kind));
  const uint64_t greatest = ~uint64_t{0} >> (65 - bits);
  const std::array<uint64_t, 8> values{
      0, 1, 2, ~uint64_t{0}, greatest, greatest + 1, greatest / 2, random_()};
  return values[below(values.size())] & (~uint64_t{0} >> (64 - bits));
}

std::string Mutator::change_number(const Place& place, Time) {
  const FieldSchema& field = place.kind();
  auto& numbers = place.column().numbers;
  const size_t i = below(numbers.size());
  const int bits = 8 * static_cast<int>(bytes_of(field.kind));
  switch (below(4)) {
    case 0:
      numbers[i] ^= uint64_t{1} << below(static_cast<uint64_t>(bits));
      return name_of(field, i) + " with a flipped bit";
    case 1:
      std::fill(numbers.begin(), numbers.end(), extreme(field.kind));
      return std::string("all of ") + field.name + " = " + std::to_string(numbers[0]) + " (bits)";
    case 2:
      numbers[i] =
          (numbers[i] + (below(2) == 0 ? 1 : ~uint64_t{0})) & (~uint64_t{0} >> (64 - bits));
      return name_of(field, i) + " with its bits counted on";
    default:
      numbers[i] = extreme(field.kind);
      return name_of(field, i) + " = " + std::to_string(numbers[i]) + " (bits)";
  }
}

std::string Mutator::change_instant(const Place& place, Time now) {
  auto& numbers = place.column().numbers;
  const size_t i = below(numbers.size());
  const auto before = static_cast<int64_t>(numbers[i]);
  const std::array<int64_t, 18> values{now.us,
                                       now.us + 1,
                                       now.us - 1,
                                       now.us + 500'000,
                                       now.us + 3'000'000,
                                       now.us + 3'600'000'000,
                                       now.us - 500'000,
                                       now.us - 3'000'000,
                                       now.us - 3'600'000'000,
                                       before + 1,
                                       before - 1,
                                       0,
                                       -1,
                                       kMaxInstant_us - 1,
                                       1 - kMaxInstant_us,
                                       INT64_C(9'000'000'000'000'000'000),
                                       INT64_MAX,
                                       INT64_MIN};
  numbers[i] = static_cast<uint64_t>(values[below(values.size())]);
  return name_of(place.kind(), i) + " = " + std::to_string(static_cast<int64_t>(numbers[i]));
}

std::string Mutator::change_text(const Place& place) {
  auto& strings = place.column().strings;
  const size_t i = below(strings.size());
  static const std::array<std::string, 8> kTexts{
      "", "\xff\xfe\xc3", "%s%n%d", "\x1b[2J\n\r\t", "../../etc", "\xed\xa0\x80", "{\"a\":1}", "/"};
  switch (below(12)) {
    case 0:
      strings[i].assign(1 + below(kLargeCount), 'x');
      break;
    case 1:
      strings[i] += strings[i];
      break;
    default:
      strings[i] = kTexts[below(kTexts.size())];
  }
  return name_of(place.kind(), i) + " of " + std::to_string(strings[i].size()) + " bytes";
}

std::string Mutator::change_bytes(const Place& place) {
  std::string& bytes = place.column().bytes;
  const uint64_t flips = 1 + below(8);
  for (uint64_t n = flips; n > 0; --n) {
    bytes[below(bytes.size())] ^= static_cast<char>(1 << below(8));
  }
  return std::string(place.kind().name) + " with " + std::to_string(flips) + " flipped bits";
}

std::string Mutator::change_count(const Place& place) {
  const FieldSchema& field = place.kind();
  const auto before = static_cast<int64_t>(place.column().numbers.at(0));
  const std::array<int64_t, 7> values{
      0,         1, before - 1, before + 1, 2 * before, static_cast<int64_t>(below(kSmallCount)),
      before / 2};
  int64_t count = std::clamp<int64_t>(values[below(values.size())], 0, int64_t{kLargeCount});
  if (below(50) == 0) count = kLargeCount;
  const int bits = 8 * static_cast<int>(bytes_of(field.kind));
  count = std::min<int64_t>(count, static_cast<int64_t>(~uint64_t{0} >> (65 - bits)));
  set_count(*place.schema, place.field, count, place.record);
  return std::string(field.name) + " = " + std::to_string(count);
}

std::string Mutator::swap_fields(const Place& place) {
  std::vector<size_t> alike;
  for (size_t f = 0; f < place.schema->fields.size(); ++f) {
    const bool same = place.schema->fields[f].kind == place.kind().kind &&
                      place.record->columns[f].size() == place.column().size() &&
                      !is_count(*place.schema, f) && f != place.field;
    if (same) alike.push_back(f);
  }
  if (alike.empty()) return std::string(place.kind().name) + " has nothing alike";
  const size_t other = alike[below(alike.size())];
  std::swap(place.column(), place.record->columns[other]);
  return std::string(place.kind().name) + " swapped with " + place.schema->fields[other].name;
}

std::string Mutator::swap_elements(const Place& place) {
  auto& numbers = place.column().numbers;
  if (numbers.size() < 2) return std::string(place.kind().name) + " has one element";
  const size_t i = below(numbers.size()), k = below(numbers.size());
  std::swap(numbers[i], numbers[k]);
  return name_of(place.kind(), i) + " swapped with [" + std::to_string(k) + "]";
}

}  // namespace foresight::fuzz
