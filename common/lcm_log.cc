#include "common/lcm_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/byte_order.h"
#include "common/check.h"
#include "common/errors.h"

namespace foresight {
namespace {

constexpr uint32_t kSyncWord = 0xEDA1DA01;
constexpr std::array<uint8_t, 4> kSyncBytes = {0xED, 0xA1, 0xDA, 0x01};
constexpr int64_t kHeaderSize = 28;
constexpr int64_t kLongestChannel = 63;        // LCM's own limit
constexpr int64_t kLargestData = 256ll << 20;  // bytes; no message comes near
constexpr int64_t kLatestTime_us = 1ll << 60;  // 36 000 years
constexpr int64_t kWindow = 64 << 10;          // bytes read at once
constexpr int64_t kSearchForBeginning = 1
                                        << 20;  // bytes; a damaged log still shows its first events
constexpr size_t kDamagesNamed = 3;

std::string error_text(int number) { return std::strerror(number); }

}  // namespace

LogReader::LogReader(const std::string& path) : path_(path) {
  file_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_ < 0) throw UnavailableError(path + ": log cannot be read: " + error_text(errno));
  struct stat status {};
  const bool is_file = fstat(file_, &status) == 0 && S_ISREG(status.st_mode);
  size_ = is_file ? status.st_size : 0;
  const bool is_log =
      is_file && (is_sync_at(0) || find_header(0, std::min(size_, kSearchForBeginning), true));
  if (is_log) return;
  close(file_);
  throw UnavailableError(path + ": is not an LCM log (made by lcm-logger)");
}

LogReader::~LogReader() { close(file_); }

// A view of the file, valid until the next call. The range lies inside the file.
std::span<const uint8_t> LogReader::bytes_at(int64_t offset, int64_t size) {
  FORESIGHT_CHECK(offset >= 0 && size >= 0 && size <= size_ - offset);
  const int64_t window_end = window_offset_ + static_cast<int64_t>(window_.size());
  if (offset < window_offset_ || offset + size > window_end) {
    window_.resize(static_cast<size_t>(std::min(size_ - offset, std::max(size, kWindow))));
    window_offset_ = offset;
    for (size_t done = 0; done < window_.size();) {
      const ssize_t count = pread(file_, window_.data() + done, window_.size() - done,
                                  offset + static_cast<int64_t>(done));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) {
        window_.clear();
        throw UnavailableError(path_ + ": cannot be read at byte " + std::to_string(offset) + ": " +
                               (count < 0 ? error_text(errno) : "it has become shorter"));
      }
      done += static_cast<size_t>(count);
    }
  }
  return {window_.data() + (offset - window_offset_), static_cast<size_t>(size)};
}

bool LogReader::is_sync_at(int64_t offset) {
  return offset + 4 <= size_ && read_big_endian(bytes_at(offset, 4).data(), 4) == kSyncWord;
}

// The header there, if what it says can be true in this file.
std::optional<LogReader::Header> LogReader::header_at(int64_t offset) {
  if (offset + kHeaderSize > size_ || !is_sync_at(offset)) return std::nullopt;
  const uint8_t* bytes = bytes_at(offset, kHeaderSize).data();
  const Header header{offset, static_cast<int64_t>(read_big_endian(bytes + 4, 8)),
                      static_cast<int64_t>(read_big_endian(bytes + 12, 8)),
                      static_cast<int64_t>(read_big_endian(bytes + 20, 4)),
                      static_cast<int64_t>(read_big_endian(bytes + 24, 4))};
  if (header.time_us < 0 || header.time_us > kLatestTime_us) return std::nullopt;
  if (header.channel_size < 1 || header.channel_size > kLongestChannel) return std::nullopt;
  if (header.data_size > kLargestData || header.end() > size_) return std::nullopt;
  const auto channel = bytes_at(offset + kHeaderSize, header.channel_size);
  const bool printable =
      std::all_of(channel.begin(), channel.end(), [](uint8_t c) { return c >= 0x20 && c != 0x7f; });
  return printable ? std::optional(header) : std::nullopt;
}

bool LogReader::is_followed(const Header& header) {
  return header.end() == size_ || is_sync_at(header.end());
}

bool LogReader::is_followed_by_its_successor(const Header& header) {
  const auto next = header_at(header.end());
  return next && next->number == header.number + 1;
}

// The first place in [from, to) where a plausible header begins; `followed`: and with an event or
// the end of the file right behind that event.
std::optional<int64_t> LogReader::find_header(int64_t from, int64_t to, bool followed) {
  const int64_t end = std::min(to + 3, size_);  // of the last sync word that begins before `to`
  while (from + 4 <= end) {
    const auto bytes = bytes_at(from, std::min(kWindow, end - from));
    const auto found =
        std::search(bytes.begin(), bytes.end(), kSyncBytes.begin(), kSyncBytes.end());
    if (found == bytes.end()) {
      from += static_cast<int64_t>(bytes.size()) - 3;  // a sync word may begin in the last three
      continue;
    }
    from += found - bytes.begin();
    const auto header = header_at(from);
    if (header && (!followed || is_followed(*header))) return from;
    ++from;
  }
  return std::nullopt;
}

// A length that was damaged upwards swallows the events behind it. It shows by what follows: no
// event, or not the next one.
std::optional<int64_t> LogReader::find_swallowed(const Header& header) {
  if (is_followed_by_its_successor(header)) return std::nullopt;
  return find_header(header.offset + kHeaderSize, header.end(), true);
}

void LogReader::skip_damage(std::optional<int64_t> to) {
  const bool is_cut_off = !to && (is_sync_at(offset_) || size_ - offset_ < kHeaderSize);
  const int64_t end = to.value_or(size_);
  ++damage_count_;
  skipped_bytes_ += end - offset_;
  if (damages_.size() < kDamagesNamed) damages_.push_back({offset_, end - offset_, is_cut_off});
  offset_ = end;
}

std::optional<LogReader::Entry> LogReader::next_entry() {
  while (offset_ < size_) {
    const auto header = header_at(offset_);
    if (!header) {
      skip_damage(find_header(offset_ + 1, size_, false));
    } else if (const auto swallowed = find_swallowed(*header)) {
      skip_damage(swallowed);
    } else {
      offset_ = header->end();
      return Entry{{header->time_us}, header->offset};
    }
  }
  return std::nullopt;
}

LogEvent LogReader::event(const Entry& entry) {
  const auto header = header_at(entry.offset);
  FORESIGHT_CHECK(header);
  const auto channel = bytes_at(entry.offset + kHeaderSize, header->channel_size);
  LogEvent event{entry.time, std::string(channel.begin(), channel.end()), {}};
  const auto data = bytes_at(header->data(), header->data_size);
  event.bytes.assign(data.begin(), data.end());
  return event;
}

std::optional<LogEvent> LogReader::next() {
  const auto entry = next_entry();
  return entry ? std::optional(event(*entry)) : std::nullopt;
}

std::string LogReader::complaint() const {
  std::string text;
  for (const Damage& damage : damages_) {
    text += (text.empty() ? path_ + ": " : "; ") +
            (damage.is_cut_off ? "the last event is cut off at byte " : "damaged at byte ") +
            std::to_string(damage.offset) + " (" + std::to_string(damage.size) + " bytes skipped)";
  }
  const int64_t others = damage_count_ - static_cast<int64_t>(damages_.size());
  if (others == 0) return text;
  return text + "; and at " + std::to_string(others) + " more places (" +
         std::to_string(skipped_bytes_) + " bytes skipped in all)";
}

void LogReader::require_whole() const {
  if (damage_count_ > 0) throw UnavailableError(complaint());
}

namespace {

void require_log(const std::string& path) {
  try {
    LogReader log(path);
  } catch (const UnavailableError&) {
    throw UnavailableError(path + ": exists and is not an LCM log; it is left as it is");
  }
}

}  // namespace

LogWriter::LogWriter(const std::string& path, LogPlacement placement)
    : path_(path), partial_(path) {
  struct stat status {};
  const bool exists = stat(path.c_str(), &status) == 0;
  if (!exists || S_ISREG(status.st_mode)) {
    if (exists && status.st_size > 0) require_log(path);
    std::error_code ignored;
    const auto target = std::filesystem::canonical(path, ignored);  // of a symbolic link
    if (!target.empty()) path_ = target.string();
    partial_ = path_ + (placement == LogPlacement::kWhenWhole ? ".partial" : "");
  }
  file_ = std::fopen(partial_.c_str(), "wbe");
  if (file_ == nullptr) {
    throw UnavailableError(path + ": log cannot be written: " + error_text(errno));
  }
}

LogWriter::~LogWriter() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  if (partial_ != path_) std::remove(partial_.c_str());
}

void LogWriter::write(Time time, const std::string& channel, std::span<const uint8_t> bytes) {
  FORESIGHT_CHECK(file_ != nullptr);
  if (has_failed()) return;
  std::vector<uint8_t> event;
  event.reserve(static_cast<size_t>(kHeaderSize) + channel.size() + bytes.size());
  append_big_endian(&event, kSyncWord, 4);
  append_big_endian(&event, static_cast<uint64_t>(count_++), 8);
  append_big_endian(&event, static_cast<uint64_t>(time.us), 8);
  append_big_endian(&event, channel.size(), 4);
  append_big_endian(&event, bytes.size(), 4);
  event.insert(event.end(), channel.begin(), channel.end());
  event.insert(event.end(), bytes.begin(), bytes.end());
  if (std::fwrite(event.data(), 1, event.size(), file_) != event.size()) error_ = errno;
}

void LogWriter::flush() {
  if (!has_failed() && std::fflush(file_) != 0) error_ = errno;
}

void LogWriter::close() {
  FORESIGHT_CHECK(file_ != nullptr);
  // On the disk before the name changes, so that a crash leaves one of the two logs whole.
  flush();
  if (!has_failed() && partial_ != path_ && fsync(fileno(file_)) != 0) error_ = errno;
  if (std::fclose(file_) != 0 && !has_failed()) error_ = errno;
  file_ = nullptr;
  if (!has_failed() && partial_ != path_ && std::rename(partial_.c_str(), path_.c_str()) != 0) {
    error_ = errno;
  }
  if (!has_failed()) return;
  if (partial_ != path_) std::remove(partial_.c_str());
  throw UnavailableError(path_ + ": log cannot be written: " + error_text(error_));
}

}  // namespace foresight
