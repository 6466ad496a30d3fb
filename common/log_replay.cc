#include "common/log_replay.h"

#include <sys/stat.h>

#include <iostream>
#include <memory>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/log_timeline.h"

namespace foresight {
namespace {

struct Source {
  Domain domain;
  std::string path;
};

Source parse_source(const std::string& text, Domain home) {
  for (const Domain domain : {Domain::kRobot, Domain::kOperator}) {
    const std::string prefix = std::string(to_string(domain)) + "=";
    if (text.starts_with(prefix)) return {domain, text.substr(prefix.size())};
  }
  return {home, text};
}

// By whatever name: relative, through a symbolic link, as a hard link.
bool is_same_file(const std::string& a, const std::string& b) {
  struct stat of_a {
  }, of_b{};
  return stat(a.c_str(), &of_a) == 0 && stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

// One log in the order of its replay.
class Track {
 public:
  explicit Track(const Source& source)
      : source_(source), log_(std::make_unique<LogReader>(source.path)) {
    std::vector<Time> stamps;
    while (const auto entry = log_->next_entry()) {
      entries_.push_back(*entry);
      stamps.push_back(entry->time);
    }
    timeline_ = make_timeline(stamps);
  }

  Domain domain() const { return source_.domain; }
  bool is_over() const { return next_ == entries_.size(); }
  Time time() const { return timeline_.times[next_]; }
  LogEvent take() { return log_->event(entries_[timeline_.order[next_++]]); }

  /// Says what is wrong with the log; false when it is not what was recorded.
  bool report(const std::string& process) const {
    const std::string damage = log_->complaint(), stamps = timeline_.remark();
    if (!damage.empty()) std::cerr << process << ": " << damage << "\n";
    if (!stamps.empty()) std::cerr << process << ": " << source_.path << ": " << stamps << "\n";
    return damage.empty() && !timeline_.is_out_of_order();
  }

 private:
  Source source_;
  std::unique_ptr<LogReader> log_;
  std::vector<LogReader::Entry> entries_;
  LogTimeline timeline_;
  size_t next_ = 0;
};

std::vector<Track> open_tracks(const LogReplay& replay) {
  std::vector<Source> sources;
  for (const std::string& text : replay.logs) sources.push_back(parse_source(text, replay.home));
  for (const Source& source : sources) {
    if (is_same_file(source.path, replay.output)) {
      throw UsageError("--output " + replay.output +
                       " is the log that --replay reads; it would be "
                       "lost");
    }
  }
  std::vector<Track> tracks;
  for (const Source& source : sources) tracks.emplace_back(source);
  return tracks;
}

Track* earliest(std::vector<Track>& tracks) {
  Track* first = nullptr;
  for (Track& track : tracks) {
    if (!track.is_over() && (first == nullptr || track.time() < first->time())) first = &track;
  }
  return first;
}

}  // namespace

int replay_logs(const LogReplay& replay, const Simulation::Factory& factory) {
  std::vector<Track> tracks = open_tracks(replay);
  LogWriter output(replay.output);
  Track* source = earliest(tracks);
  Simulation world(source != nullptr ? source->time() : Time{0});
  world.set_tap([&](Time time, Domain, const std::string& channel, auto bytes) {
    output.write(time, channel, bytes);
  });
  world.add(replay.process, replay.health_domains, factory);
  int64_t count = 0;
  for (; source != nullptr && !output.has_failed(); source = earliest(tracks), ++count) {
    const Time time = source->time();
    LogEvent event = source->take();
    world.run_until(time - microseconds(1));
    world.inject(time, source->domain(), event.channel, std::move(event.bytes));
    world.run_until(time);
  }
  if (!output.has_failed()) world.run_until(world.now() + seconds(1));  // what is still due
  output.close();
  std::cerr << replay.process << ": replayed " << count << " events to " << replay.output << "\n";
  bool all_whole = true;
  for (const Track& track : tracks) all_whole = track.report(replay.process) && all_whole;
  return all_whole ? kExitDone : kExitUnavailable;
}

}  // namespace foresight
