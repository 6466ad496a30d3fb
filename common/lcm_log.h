// LCM log files (lcm-logger's format), read and written by ourselves: logs come from disks that
// filled up, recorders that were killed and networks that people copied them over, and liblcm's own
// reader ends silently, or crashes, at the first damaged byte.
//
// An event is a header of 28 bytes, big endian (sync word 0xEDA1DA01, event number, time-stamp in
// µs, length of the channel's name, length of the data), the name and the data.
//
//   LogReader log(path);
//   while (const auto event = log.next()) use(*event);
//   log.require_whole();
//
//   LogWriter log(path);
//   log.write(time, "CHANNEL", bytes);
//   log.close();
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

struct LogEvent {
  Time time;  // when the logger received it
  std::string channel;
  std::vector<uint8_t> bytes;
};

/// Reads events one after the other. After damage it goes on at the next sync word and remembers
/// what it skipped; no length is believed before it was compared with the file's size.
class LogReader {
 public:
  /// An event's place in the file.
  struct Entry {
    Time time;
    int64_t offset = 0;
  };

  /// Throws UnavailableError when the file cannot be opened or is not an LCM log.
  explicit LogReader(const std::string& path);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// The next event, or nothing at the end. Throws UnavailableError when the disk fails.
  std::optional<LogEvent> next();
  /// The same without reading the event's data: for an index.
  std::optional<Entry> next_entry();
  LogEvent event(const Entry& entry);

  /// What could not be read so far, in one line (file, offset, bytes skipped); empty: nothing.
  std::string complaint() const;
  /// To be called after the last event: throws UnavailableError with complaint() if there is one.
  void require_whole() const;

 private:
  struct Header {
    int64_t offset, number, time_us, channel_size, data_size;
    int64_t data() const { return offset + 28 + channel_size; }
    int64_t end() const { return data() + data_size; }
  };
  struct Damage {
    int64_t offset, size;
    bool is_cut_off;
  };

  std::span<const uint8_t> bytes_at(int64_t offset, int64_t size);
  bool is_sync_at(int64_t offset);
  std::optional<Header> header_at(int64_t offset);
  bool is_followed(const Header& header);
  bool is_followed_by_its_successor(const Header& header);
  std::optional<int64_t> find_header(int64_t from, int64_t to, bool followed);
  std::optional<int64_t> find_swallowed(const Header& header);
  void skip_damage(std::optional<int64_t> to);

  std::string path_;
  int file_ = -1;
  int64_t size_ = 0;    // of the file when it was opened
  int64_t offset_ = 0;  // of the next event
  std::vector<uint8_t> window_;
  int64_t window_offset_ = 0;
  std::vector<Damage> damages_;  // the first ones; all are counted
  int64_t damage_count_ = 0, skipped_bytes_ = 0;
};

enum class LogPlacement : uint8_t {
  /// In a temporary file beside it (PATH.partial), which close() renames: a run that fails leaves
  /// an
  /// earlier log as it was.
  kWhenWhole,
  /// A recording: one that was cut off is worth having.
  kAtOnce,
};

/// Writes a log. What is no regular file (/dev/null) is written directly.
class LogWriter {
 public:
  /// Throws UnavailableError when the file cannot be written, or when there is one that is not an
  /// LCM log: such a file is somebody's, and was named by mistake.
  explicit LogWriter(const std::string& path, LogPlacement placement = LogPlacement::kWhenWhole);
  /// Without close() a log that would have been placed when whole is discarded.
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Does not throw, because it may be called in a handler: see has_failed() and close().
  void write(Time time, const std::string& channel, std::span<const uint8_t> bytes);
  /// Hands what is buffered to the kernel: others can read it.
  void flush();
  /// True from the first write that did not succeed (full disk): the rest is not worth the effort.
  bool has_failed() const { return error_ != 0; }
  /// Throws UnavailableError with file and cause when not everything could be written.
  void close();

 private:
  std::string path_, partial_;  // partial_ is what is open
  std::FILE* file_ = nullptr;
  int64_t count_ = 0;
  int error_ = 0;
};

}  // namespace foresight
