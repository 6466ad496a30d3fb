#include "tests/fuzz/message_record.h"

#include <algorithm>
#include <bit>

#include "common/byte_order.h"

namespace foresight::fuzz {
namespace {

// Sign-extended, as counts are read.
int64_t integer(FieldKind kind, uint64_t raw) {
  const int unused_bits = 64 - 8 * static_cast<int>(bytes_of(kind));
  return static_cast<int64_t>(raw << unused_bits) >> unused_bits;
}

size_t element_count(const FieldSchema& field, const MessageSchema& schema, const Record& record) {
  size_t count = 1;
  for (const FieldDimension& d : field.dimensions) {
    if (d.size_field < 0) {
      count *= static_cast<size_t>(d.constant);
      continue;
    }
    const auto i = static_cast<size_t>(d.size_field);
    const int64_t n = integer(schema.fields[i].kind, record.columns[i].numbers.at(0));
    count *= static_cast<size_t>(std::max<int64_t>(0, n));
  }
  return count;
}

bool is_blob(const FieldSchema& field) {
  return field.kind == FieldKind::kByte && !field.dimensions.empty();
}

class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  Record read(const MessageSchema& schema) {
    Record record;
    for (const FieldSchema& field : schema.fields) {
      record.columns.emplace_back();
      read_column(field, element_count(field, schema, record), &record.columns.back());
    }
    return record;
  }

 private:
  void read_column(const FieldSchema& field, size_t count, Column* column) {
    if (is_blob(field)) {
      column->bytes = take(count);
      return;
    }
    for (size_t i = 0; i < count; ++i) {
      if (field.kind == FieldKind::kStruct) {
        column->records.push_back(read(*field.nested));
      } else if (field.kind == FieldKind::kString) {
        const uint64_t length = number(4);  // with the NUL
        column->strings.push_back(take(static_cast<size_t>(length)).substr(0, length - 1));
      } else {
        column->numbers.push_back(number(bytes_of(field.kind)));
      }
    }
  }
  std::string take(size_t count) {
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
    position_ += count;
    return {begin, begin + static_cast<std::ptrdiff_t>(count)};
  }
  uint64_t number(size_t size) {
    position_ += size;
    return read_big_endian(&bytes_[position_ - size], size);
  }

  std::span<const uint8_t> bytes_;
  size_t position_ = 8;
};

void write(const MessageSchema& schema, const Record& record, std::vector<uint8_t>* out) {
  for (size_t f = 0; f < schema.fields.size(); ++f) {
    const FieldSchema& field = schema.fields[f];
    const Column& column = record.columns[f];
    for (const uint64_t n : column.numbers) append_big_endian(out, n, bytes_of(field.kind));
    for (const std::string& s : column.strings) {
      append_big_endian(out, s.size() + 1, 4);
      out->insert(out->end(), s.begin(), s.end());
      out->push_back(0);
    }
    for (const Record& r : column.records) write(*field.nested, r, out);
    out->insert(out->end(), column.bytes.begin(), column.bytes.end());
  }
}

uint64_t random_number(FieldKind kind, std::mt19937_64& random) {
  if (kind == FieldKind::kFloat) {
    return std::bit_cast<uint32_t>(static_cast<float>(random() % 2000) * 1e-3f - 1);
  }
  if (kind == FieldKind::kDouble) {
    return std::bit_cast<uint64_t>(static_cast<double>(random() % 2000) * 1e-3 - 1);
  }
  return random() % 4;
}

template <class T>
void fit(std::vector<T>* elements, size_t size, const T& first) {
  const size_t before = elements->size();
  elements->resize(size, before == 0 ? first : elements->back());
  for (size_t i = before; before > 0 && i < size; ++i) (*elements)[i] = (*elements)[i % before];
}

}  // namespace

size_t bytes_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::kInt8:
    case FieldKind::kByte:
      return 1;
    case FieldKind::kInt16:
      return 2;
    case FieldKind::kInt32:
    case FieldKind::kFloat:
      return 4;
    default:
      return 8;
  }
}

size_t Column::size() const {
  return numbers.size() + strings.size() + records.size() + bytes.size();
}

Record read_record(const MessageSchema& schema, std::span<const uint8_t> bytes) {
  return Reader(bytes).read(schema);
}

std::vector<uint8_t> write_record(const MessageSchema& schema, const Record& record) {
  std::vector<uint8_t> out;
  append_big_endian(&out, static_cast<uint64_t>(schema.fingerprint()), 8);
  write(schema, record, &out);
  return out;
}

Record random_record(const MessageSchema& schema, std::mt19937_64& random) {
  Record record;
  for (const FieldSchema& field : schema.fields) {
    const size_t count = element_count(field, schema, record);
    Column column;
    if (is_blob(field)) column.bytes.assign(count, '\x80');
    for (size_t i = 0; i < count && !is_blob(field); ++i) {
      if (field.kind == FieldKind::kStruct) {
        column.records.push_back(random_record(*field.nested, random));
      } else if (field.kind == FieldKind::kString) {
        column.strings.push_back("text " + std::to_string(random() % 10));
      } else {
        column.numbers.push_back(random_number(field.kind, random));
      }
    }
    record.columns.push_back(std::move(column));
  }
  return record;
}

bool is_count(const MessageSchema& schema, size_t field) {
  return std::any_of(schema.fields.begin(), schema.fields.end(), [&](const FieldSchema& f) {
    return std::any_of(f.dimensions.begin(), f.dimensions.end(), [&](const FieldDimension& d) {
      return d.size_field == static_cast<int>(field);
    });
  });
}

void set_count(const MessageSchema& schema, size_t field, int64_t count, Record* record) {
  std::mt19937_64 random(1);
  record->columns[field].numbers = {static_cast<uint64_t>(count)};
  for (size_t f = 0; f < schema.fields.size(); ++f) {
    const FieldSchema& s = schema.fields[f];
    if (s.dimensions.empty()) continue;
    const size_t size = element_count(s, schema, *record);
    Column& column = record->columns[f];
    if (is_blob(s)) {
      column.bytes.resize(size, '\x80');
    } else if (s.kind == FieldKind::kStruct) {
      fit(&column.records, size, random_record(*s.nested, random));
    } else if (s.kind == FieldKind::kString) {
      fit(&column.strings, size, std::string());
    } else {
      fit(&column.numbers, size, uint64_t{0});
    }
  }
}

}  // namespace foresight::fuzz
