#include "common/lcm_log.h"

#include <lcm/eventlog.h>

#include <fstream>

#include "common/errors.h"

namespace foresight {

LogReader::LogReader(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  unsigned char magic[4] = {};
  if (!file) throw UnavailableError(path + ": log cannot be read");
  file.read(reinterpret_cast<char*>(magic), 4);
  const bool is_log = file.gcount() == 4 && magic[0] == 0xED && magic[1] == 0xA1 &&
                      magic[2] == 0xDA && magic[3] == 0x01;
  if (!is_log) throw UnavailableError(path + ": is not an LCM log (made by lcm-logger)");
  log_ = lcm_eventlog_create(path.c_str(), "r");
  if (log_ == nullptr) throw UnavailableError(path + ": log cannot be opened");
}

LogReader::~LogReader() { lcm_eventlog_destroy(log_); }

std::optional<LogEvent> LogReader::next() {
  lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log_);
  if (event == nullptr) return std::nullopt;
  const auto* data = static_cast<const uint8_t*>(event->data);
  LogEvent out{{event->timestamp},
               std::string(event->channel, static_cast<size_t>(event->channellen)),
               {data, data + event->datalen}};
  lcm_eventlog_free_event(event);
  return out;
}

LogWriter::LogWriter(const std::string& path) : log_(lcm_eventlog_create(path.c_str(), "w")) {
  if (log_ == nullptr) throw UnavailableError(path + ": log cannot be written");
}

LogWriter::~LogWriter() { lcm_eventlog_destroy(log_); }

void LogWriter::write(Time time, const std::string& channel, std::span<const uint8_t> bytes) {
  lcm_eventlog_event_t event{};
  event.timestamp = time.us;
  event.channellen = static_cast<int32_t>(channel.size());
  event.channel = const_cast<char*>(channel.data());
  event.datalen = static_cast<int32_t>(bytes.size());
  event.data = const_cast<uint8_t*>(bytes.data());
  lcm_eventlog_write_event(log_, &event);
}

}  // namespace foresight
