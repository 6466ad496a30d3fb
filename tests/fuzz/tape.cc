#include "tests/fuzz/tape.h"

#include <sys/mman.h>

#include <cstring>
#include <new>

namespace foresight::fuzz {
namespace {

// Numbers and blobs in the order in which they were put.
class Reader {
 public:
  Reader(const uint8_t* begin, size_t size) : at_(begin), end_(begin + size) {}
  bool is_done() const { return at_ == end_; }
  int64_t number() {
    int64_t v = 0;
    std::memcpy(&v, at_, sizeof v);
    at_ += sizeof v;
    return v;
  }
  template <class Blob>
  Blob blob() {
    const auto size = static_cast<size_t>(number());
    Blob b(at_, at_ + size);
    at_ += size;
    return b;
  }

 private:
  const uint8_t *at_, *end_;
};

}  // namespace

Tape::Tape(size_t capacity)
    : capacity_(capacity),
      memory_(mmap(nullptr, sizeof(Head) + capacity, PROT_READ | PROT_WRITE,
                   MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)) {
  if (memory_ == MAP_FAILED) throw std::bad_alloc();
  new (memory_) Head;
}

Tape::~Tape() { munmap(memory_, sizeof(Head) + capacity_); }

void Tape::clear() { head() = {}; }

void Tape::put(const void* data, size_t size) {
  std::memcpy(bytes() + head().used, data, size);
  head().used += size;
}

void Tape::append(const Thrown& t) {
  const size_t size =
      6 * sizeof(int64_t) + t.channel.size() + t.only_for.size() + t.what.size() + t.bytes.size();
  if (head().used + size > capacity_) head().is_full = true;
  if (head().is_full) return;
  const auto number = [this](int64_t v) { put(&v, sizeof v); };
  const auto blob = [&](const auto& b) {
    number(static_cast<int64_t>(b.size()));
    put(b.data(), b.size());
  };
  number(t.time.us);
  number(static_cast<int64_t>(t.domain));
  blob(t.channel);
  blob(t.only_for);
  blob(t.what);
  blob(t.bytes);
}

std::vector<Thrown> Tape::read() const {
  std::vector<Thrown> all;
  if (head().is_full) return all;
  Reader reader(bytes(), head().used);
  while (!reader.is_done()) {
    Thrown t;
    t.time = {reader.number()};
    t.domain = static_cast<Domain>(reader.number());
    t.channel = reader.blob<std::string>();
    t.only_for = reader.blob<std::string>();
    t.what = reader.blob<std::string>();
    t.bytes = reader.blob<std::vector<uint8_t>>();
    all.push_back(std::move(t));
  }
  return all;
}

}  // namespace foresight::fuzz
