#include "procs/top/table_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "common/printable_text.h"

namespace foresight {
namespace {

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  std::array<char, 512> buffer{};
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(buffer.data(), buffer.size(), pattern, arguments);
  va_end(arguments);
  return buffer.data();
}

std::string duration_text(double s) {
  if (s < 100) return format("%.0f s", s);
  return s < 6000 ? format("%.0f min", s / 60) : format("%.1f h", s / 3600);
}

std::string bandwidth_text(double bytes_per_s) {
  if (bytes_per_s < 1e3) return format("%.0f B/s", bytes_per_s);
  return bytes_per_s < 1e6 ? format("%.1f kB/s", bytes_per_s / 1e3)
                           : format("%.2f MB/s", bytes_per_s / 1e6);
}

std::string milliseconds_text(double ms) { return format("%.1f", ms); }

// Only inputs have an age, and only in a second in which something arrived.
bool has_latency(const port_health_t& p) { return p.is_input != 0 && p.rate_hz > 0; }

const char* colour_of(const ProcessRow& row) {
  if (row.is_gone || row.health.state == health_t::STATE_FAILED) return "\x1b[31m";
  if (row.health.state == health_t::STATE_OK || row.health.state == health_t::STATE_DONE) {
    return "\x1b[32m";
  }
  return "\x1b[33m";
}

std::string process_line(const ProcessRow& row, Colour colour) {
  const health_t& h = row.health;
  std::string state = format("%-9s", row.state().c_str());
  if (colour == Colour::kOn) state = colour_of(row) + state + "\x1b[0m";
  std::string line = format("%-14s ", printable(h.process).c_str()) + state;
  line += format(" %7d %8s %5.0f %% %6.0f MB %8d  ", h.pid, duration_text(h.uptime_s).c_str(),
                 100 * h.cpu_share, h.memory_mb, row.restarts);
  return line + printable(h.reason) + "\n";
}

std::string port_line(const std::string& process, const port_health_t& p) {
  return format("%-14s %-3s %-18s %-8s %7.1f Hz %12s %8s %8s %8lld %8lld %8lld\n", process.c_str(),
                p.is_input != 0 ? "in" : "out", printable(p.channel).c_str(),
                p.is_operator_domain != 0 ? "operator" : "robot", p.rate_hz,
                bandwidth_text(p.bytes_per_s).c_str(),
                has_latency(p) ? milliseconds_text(p.worst_latency_ms).c_str() : "-",
                p.is_input != 0 ? milliseconds_text(p.handler_ms).c_str() : "-",
                static_cast<long long>(p.rejected), static_cast<long long>(p.skipped),
                static_cast<long long>(p.lost));
}

std::string flow_line(const link_flow_t& f) {
  return format("%-18s %-12s %10lld %8lld %8lld %10lld %7d %10.1f %9.1f\n",
                printable(f.channel).c_str(), f.to_operator != 0 ? "to operator" : "to robot",
                static_cast<long long>(f.forwarded), static_cast<long long>(f.lost),
                static_cast<long long>(f.rate_dropped), static_cast<long long>(f.reordered),
                f.queued, f.delay_ms, f.delay_error_ms);
}

// Whatever a message holds, the line is JSON in UTF-8.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : printable(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string number(double v) { return std::isfinite(v) ? format("%.9g", v) : "null"; }

// "key":value,"key":value,…
class JsonObject {
 public:
  JsonObject& raw(const std::string& key, const std::string& json) {
    if (!text_.empty()) text_ += ",";
    text_ += quoted(key) + ":" + json;
    return *this;
  }
  JsonObject& text(const std::string& key, const std::string& v) { return raw(key, quoted(v)); }
  JsonObject& real(const std::string& key, double v) { return raw(key, number(v)); }
  JsonObject& integer(const std::string& key, int64_t v) { return raw(key, std::to_string(v)); }
  std::string str() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};

template <class Items, class Convert>
std::string json_list(const Items& items, const Convert& convert) {
  std::string text;
  for (const auto& item : items) {
    if (!text.empty()) text += ",";
    text += convert(item);
  }
  return "[" + text + "]";
}

std::string port_json(const port_health_t& p) {
  return JsonObject()
      .text("channel", p.channel)
      .text("direction", p.is_input != 0 ? "in" : "out")
      .text("domain", p.is_operator_domain != 0 ? "operator" : "robot")
      .integer("messages", p.messages)
      .real("rate_hz", p.rate_hz)
      .real("bytes_per_s", p.bytes_per_s)
      .integer("rejected", p.rejected)
      .integer("skipped", p.skipped)
      .integer("lost", p.lost)
      .raw("worst_latency_ms", has_latency(p) ? number(p.worst_latency_ms) : "null")
      .real("handler_ms", p.handler_ms)
      .str();
}

std::string process_json(const ProcessRow& row) {
  const health_t& h = row.health;
  JsonObject metrics;
  for (size_t i = 0; i < h.metric_names.size(); ++i) {
    metrics.real(h.metric_names[i], h.metric_values[i]);
  }
  return JsonObject()
      .text("process", h.process)
      .text("state", row.state())
      .text("reason", h.reason)
      .integer("utime", h.utime)
      .integer("pid", h.pid)
      .integer("restarts", row.restarts)
      .real("age_s", row.age.seconds())
      .real("uptime_s", h.uptime_s)
      .real("cpu_share", h.cpu_share)
      .real("memory_mb", h.memory_mb)
      .raw("ports", json_list(h.ports, port_json))
      .raw("metrics", metrics.str())
      .str();
}

std::string flow_json(const link_flow_t& f) {
  return JsonObject()
      .text("channel", f.channel)
      .text("to", f.to_operator != 0 ? "operator" : "robot")
      .integer("forwarded", f.forwarded)
      .integer("lost", f.lost)
      .integer("rate_dropped", f.rate_dropped)
      .integer("reordered", f.reordered)
      .integer("queued", f.queued)
      .real("delay_ms", f.delay_ms)
      .real("delay_error_ms", f.delay_error_ms)
      .str();
}

}  // namespace

std::string to_text(const HealthTable& table, Time now, Ports ports, Colour colour) {
  const std::vector<ProcessRow> rows = table.rows(now);
  if (rows.empty()) return "no process reports\n";
  std::string text =
      "PROCESS        STATE         PID       UP     CPU    MEMORY RESTARTS  REASON\n";
  for (const ProcessRow& row : rows) text += process_line(row, colour);
  text +=
      "\nPROCESS        PORT                   SITE           RATE    BANDWIDTH   AGE ms  WORK ms"
      " REJECTED  SKIPPED     LOST\n";
  for (const ProcessRow& row : rows) {
    for (const port_health_t& p : row.health.ports) {
      const bool busy = p.messages > 0 || p.rejected > 0;
      const bool shown = ports == Ports::kAll || (busy && p.channel != "HEALTH");
      if (shown && !row.is_gone) text += port_line(printable(row.health.process), p);
    }
  }
  const std::vector<link_flow_t> flows = table.flows();
  if (flows.empty()) return text;
  text +=
      "\nLINK               DIRECTION     FORWARDED     LOST  DROPPED  REORDERED  QUEUED   DELAY ms"
      "  ERROR ms\n";
  for (const link_flow_t& flow : flows) text += flow_line(flow);
  return text;
}

std::string to_json(const HealthTable& table, Time now) {
  return JsonObject()
      .integer("utime", now.us)
      .raw("processes", json_list(table.rows(now), process_json))
      .raw("link", json_list(table.flows(), flow_json))
      .str();
}

}  // namespace foresight
