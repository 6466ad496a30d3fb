#include "common/node.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "common/byte_order.h"
#include "common/check.h"
#include "common/printable_text.h"

namespace foresight {
namespace {

int64_t read_int64(std::span<const uint8_t> bytes, size_t offset) {
  return static_cast<int64_t>(read_big_endian(&bytes[offset], 8));
}

// One line to stderr, with the process's name: the supervisor puts it into the process's log.
void log_line(const std::string& name, const std::string& line) {
  std::fprintf(stderr, "%s: %s\n", name.c_str(), line.c_str());
}

// Types whose stamps say nothing at the border. Reports and orders come from anybody: their stamps
// are of many clocks and in no order. Images are of a camera whose clock slam judges itself
// (procs/slam/image_stream.h): one that was set loses none.
constexpr std::array<std::string_view, 6> kOfAnyTime{
    "health_t", "link_stats_t", "snapshot_request_t", "slam_command_t", "pendant_t", "image_t"};

// A port says so often at most why it rejects: a stranger must not fill the disk with log lines.
constexpr Duration kRejectionLogged = seconds(1);

std::string future_text(Duration lead) {
  char text[64];
  std::snprintf(text, sizeof text, "stamped %.3g s in the future", lead.seconds());
  return text;
}

const char* to_string(ProcessState state) {
  switch (state) {
    case ProcessState::kStarting:
      return "starting";
    case ProcessState::kOk:
      return "ok";
    case ProcessState::kWaiting:
      return "waiting";
    case ProcessState::kDegraded:
      return "degraded";
    case ProcessState::kFailed:
      return "failed";
    case ProcessState::kDone:
      return "done";
  }
  return "?";
}

}  // namespace

const char* to_string(Domain domain) { return domain == Domain::kRobot ? "robot" : "operator"; }

Node::Node(std::string name, Host& host, std::vector<Domain> health_domains)
    : name_(std::move(name)), host_(host), started_(host.now()), measured_at_(host.now()) {
  for (Domain domain : health_domains) {
    health_ports_.push_back(add_port({.channel = "HEALTH",
                                      .domain = domain,
                                      .rate_hz = 1,
                                      .doc = "state, reason, ports and metrics of this process"},
                                     health_t::getTypeName(), false));
  }
  // Who has just begun says so at once, and not when the first second is over.
  at(host_.now(), [this] {
    if (state_ == ProcessState::kStarting) publish_health();
  });
  every(seconds(1), "health", [this] {
    measure();
    publish_health();
    mark_rejections();
  });
}

PortRecord* Node::add_port(const PortSpec& spec, const std::string& type, bool is_input) {
  PortRecord port;
  port.spec = spec;
  port.type = type;
  port.is_input = is_input;
  port.judges_stamps = std::find(kOfAnyTime.begin(), kOfAnyTime.end(), type) == kOfAnyTime.end();
  ports_.push_back(port);
  return &ports_.back();
}

void Node::listen(PortRecord* port, Queue queue, Host::Handler handler) {
  host_.subscribe(port->spec.domain, port->spec.channel, queue, &port->skipped, std::move(handler));
}

void Node::subscribe_raw(const PortSpec& spec, Queue queue, Host::Handler handler) {
  PortRecord* port = add_port(spec, "any", true);
  listen(port, queue, [this, port, handler = std::move(handler)](auto bytes) {
    ++port->messages;
    ++port->arrived;
    port->bytes += static_cast<int64_t>(bytes.size());
    guard(port, [&] { handler(bytes); });
  });
}

// Empty, or why the message is refused before it is decoded.
std::string Node::find_error(PortRecord* port, const MessageSchema& schema, int64_t fingerprint,
                             std::span<const uint8_t> bytes) const {
  if (bytes.size() < 16 || read_int64(bytes, 0) != fingerprint) return "is not a " + port->type;
  if (std::string error = find_layout_error(schema, bytes); !error.empty()) return error;
  const Time stamp{read_int64(bytes, 8)};
  if (!port->judges_stamps || port->stamps.accept(stamp, host_.now())) return {};
  return future_text(stamp - host_.now());
}

bool Node::accept(PortRecord* port, const MessageSchema& schema, int64_t fingerprint,
                  std::span<const uint8_t> bytes) {
  ++port->arrived;
  if (const std::string error = find_error(port, schema, fingerprint, bytes); !error.empty()) {
    reject(port, error);
    return false;
  }
  ++port->messages;
  port->bytes += static_cast<int64_t>(bytes.size());
  const Duration latency = host_.now() - Time{read_int64(bytes, 8)};
  port->latency = std::max(port->latency.value_or(latency), latency);
  return true;
}

void Node::reject(PortRecord* port, const std::string& why) {
  ++port->rejected;
  const bool is_news = why != port->last_rejection;
  port->last_rejection = why;
  const Time now = host_.now();
  // Say it once, count the rest.
  if (!is_news || (port->rejection_logged && now - *port->rejection_logged < kRejectionLogged)) {
    return;
  }
  port->rejection_logged = now;
  log_line(name_, port->spec.channel + " rejected: " + why);
}

void Input::reject(const std::string& why) const {
  FORESIGHT_CHECK(node_ != nullptr);
  node_->reject(port_, why);
}

void Node::guard(PortRecord* port, const std::function<void()>& call) {
  const Time begin = host_.now();
  try {
    call();
  } catch (const std::exception& e) {
    log_line(name_, "bug: exception in the handler of " + port->spec.channel + ": " + e.what());
    check_failed(__FILE__, __LINE__, "handlers do not throw");
  }
  port->handling = std::max(port->handling, host_.now() - begin);
}

void Node::publish_raw(PortRecord* port, std::span<const uint8_t> bytes) {
  ++port->messages;
  port->bytes += static_cast<int64_t>(bytes.size());
  host_.publish(port->spec.domain, port->spec.channel, bytes);
}

void Node::every(Duration period, const std::string& name, std::function<void()> call) {
  timers_.push_back({name, period});
  host_.call_every(period, std::move(call));
}

void Node::at(Time time, std::function<void()> call) { host_.call_at(time, std::move(call)); }

bool Node::run_beside(Job job, Duration simulated_cost) {
  if (job_running_) return false;
  job_running_ = true;
  host_.run_job(
      [this, job = std::move(job)]() -> std::function<void()> {
        auto apply = job();
        return [this, apply = std::move(apply)] {
          job_running_ = false;
          apply();
        };
      },
      simulated_cost);
  return true;
}

void Node::set_state(ProcessState state, const std::string& reason) {
  const bool changed = state != state_;
  state_ = state;
  reason_ = reason;
  if (!changed) return;
  log_line(name_, std::string(to_string(state)) + (reason.empty() ? "" : ": " + printable(reason)));
  publish_health();
}

void Node::set_metric(const std::string& name_with_unit, double value) {
  metrics_[name_with_unit] = value;
}

void Node::finish(const std::string& reason, std::optional<ExitCode> exit_code) {
  set_state(ProcessState::kDone, reason);
  if (exit_code) host_.stop(*exit_code);
}

void Node::log(const std::string& line) const { log_line(name_, printable(line)); }

// Rates and worst cases of the second that ends now.
void Node::measure() {
  const double elapsed_s = std::max(1e-6, (host_.now() - measured_at_).seconds());
  for (PortRecord& port : ports_) {
    port.rate_hz = static_cast<double>(port.messages - port.messages_mark) / elapsed_s;
    port.bytes_per_s = static_cast<double>(port.bytes - port.bytes_mark) / elapsed_s;
    port.messages_mark = port.messages;
    port.bytes_mark = port.bytes;
    port.last_latency = port.latency;
    port.last_handling = port.handling;
    port.latency.reset();
    port.handling = {0};
  }
  const double cpu_s = host_.usage().cpu_s;
  cpu_share_ = (cpu_s - cpu_mark_s_) / elapsed_s;
  cpu_mark_s_ = cpu_s;
  measured_at_ = host_.now();
}

void Node::mark_rejections() {
  for (PortRecord& port : ports_) port.marks = {{{port.arrived, port.rejected}, port.marks[0]}};
}

// Of the last two seconds; empty unless most messages of some input were rejected.
std::string Node::rejections() const {
  std::string text;
  for (const PortRecord& port : ports_) {
    const int64_t arrived = port.arrived - port.marks[1].arrived;
    const int64_t rejected = port.rejected - port.marks[1].rejected;
    if (rejected == 0 || 2 * rejected <= arrived) continue;
    text += (text.empty() ? "" : "; ") + port.spec.channel + ": " + std::to_string(rejected) +
            " of " + std::to_string(std::max(arrived, rejected)) +
            " rejected: " + port.last_rejection;
  }
  return text;
}

static port_health_t make_port_health(const PortRecord& port) {
  port_health_t p{};
  p.channel = port.spec.channel;
  p.is_input = port.is_input ? 1 : 0;
  p.is_operator_domain = port.spec.domain == Domain::kOperator ? 1 : 0;
  p.messages = port.messages;
  p.rate_hz = static_cast<float>(port.rate_hz);
  p.bytes_per_s = static_cast<float>(port.bytes_per_s);
  p.rejected = port.rejected;
  p.skipped = port.skipped;
  p.lost = port.losses.lost();
  const Duration latency = port.last_latency.value_or(Duration{0});
  p.worst_latency_ms = static_cast<float>(static_cast<double>(latency.us) * 1e-3);
  p.handler_ms = static_cast<float>(static_cast<double>(port.last_handling.us) * 1e-3);
  return p;
}

health_t Node::make_health() const {
  health_t health{};
  health.utime = host_.now().us;
  health.process = printable(name_);
  health.pid = host_.is_simulated() ? 0 : static_cast<int32_t>(getpid());
  health.state = static_cast<int8_t>(state_);
  std::string reason = reason_;
  for (const std::string& complaint : {host_.complaint(), rejections()}) {
    if (complaint.empty()) continue;
    if (state_ == ProcessState::kOk) health.state = health_t::STATE_DEGRADED;
    reason += (reason.empty() ? "" : "; ") + complaint;
  }
  health.reason = printable(reason);
  health.uptime_s = static_cast<float>((host_.now() - started_).seconds());
  health.cpu_share = static_cast<float>(cpu_share_);
  health.memory_mb = static_cast<float>(host_.usage().memory_mb);
  for (const PortRecord& port : ports_) health.ports.push_back(make_port_health(port));
  health.n_ports = static_cast<int32_t>(health.ports.size());
  for (const auto& [name, value] : metrics_) {
    health.metric_names.push_back(printable(name));
    health.metric_values.push_back(value);
  }
  health.n_metrics = static_cast<int32_t>(metrics_.size());
  return health;
}

void Node::publish_health() {
  const std::vector<uint8_t> bytes = encode(make_health());
  for (PortRecord* port : health_ports_) publish_raw(port, bytes);
}

}  // namespace foresight
