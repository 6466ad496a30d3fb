// LCM log files (lcm-logger's format): reading with errors in words, and writing.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/time.h"

struct _lcm_eventlog_t;

namespace foresight {

struct LogEvent {
  Time time;  // when the logger received it
  std::string channel;
  std::vector<uint8_t> bytes;
};

class LogReader {
 public:
  /// Throws UnavailableError when the file cannot be opened or is not an LCM log.
  explicit LogReader(const std::string& path);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;
  /// The next event, or nothing at the end.
  std::optional<LogEvent> next();

 private:
  _lcm_eventlog_t* log_;
};

class LogWriter {
 public:
  /// Throws UnavailableError when the file cannot be written.
  explicit LogWriter(const std::string& path);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  void write(Time time, const std::string& channel, std::span<const uint8_t> bytes);

 private:
  _lcm_eventlog_t* log_;
};

}  // namespace foresight
