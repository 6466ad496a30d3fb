// A message taken apart by its schema, so that it can be changed field by field and put together
// again: for fuzzers that cover a new message by themselves.
//
//   Record record = read_record(schema, bytes);
//   record.columns[2].numbers[0] = …;
//   std::vector<uint8_t> changed = write_record(schema, record);
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/message_check.h"

namespace foresight::fuzz {

struct Record;

/// All elements of one field: one for a scalar, and in row-major order for an array.
struct Column {
  std::vector<uint64_t> numbers;  // bit patterns; of every kind but strings, bytes and structs
  std::vector<std::string> strings;
  std::vector<Record> records;
  std::string bytes;  // of a kByte array: pictures are long

  size_t size() const;
};

struct Record {
  std::vector<Column> columns;  // one for each field
};

/// `bytes` must have passed find_layout_error().
Record read_record(const MessageSchema& schema, std::span<const uint8_t> bytes);
/// With the type's fingerprint. Counts are written as they are, whatever the columns hold.
std::vector<uint8_t> write_record(const MessageSchema& schema, const Record& record);
/// A small valid message of random contents, for types of which nobody has sent one yet.
Record random_record(const MessageSchema& schema, std::mt19937_64& random);

/// Whether the field is the size of an array of the same message.
bool is_count(const MessageSchema& schema, size_t field);
/// Sets a count, and makes the arrays that it sizes as long: cut, or continued with copies.
void set_count(const MessageSchema& schema, size_t field, int64_t count, Record* record);

size_t bytes_of(FieldKind kind);

}  // namespace foresight::fuzz
