#include "common/lcm_log.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <random>
#include <set>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

constexpr int64_t kHeader = 28;

std::vector<uint8_t> payload(int i) {
  return std::vector<uint8_t>(static_cast<size_t>(i * 37 % 101), static_cast<uint8_t>(i));
}

std::string channel(int i) { return i % 2 == 0 ? "EVEN" : "ODD"; }

/// The bytes of a log of `count` events, and where each begins.
struct Bytes {
  std::string text;
  std::vector<size_t> begins;
};

class LcmLog : public testing::Test {
 protected:
  std::string path() const { return folder_.path() + "/a.lcmlog"; }

  void write(int count) const {
    LogWriter log(path());
    for (int i = 0; i < count; ++i) log.write(Time{1'000'000 + i}, channel(i), payload(i));
    log.close();
  }

  std::string bytes() const {
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  Bytes sample(int count) const {
    write(count);
    Bytes out{bytes(), {}};
    size_t at = 0;
    for (int i = 0; i < count; ++i) {
      out.begins.push_back(at);
      at += static_cast<size_t>(kHeader) + channel(i).size() + payload(i).size();
    }
    EXPECT_EQ(at, out.text.size());
    return out;
  }

  /// Which of the sample's events come out unharmed, and what is said.
  struct Reading {
    std::set<int> whole;
    int events = 0;
    std::string path, complaint;
  };
  static Reading read(const std::string& text) {
    Reading reading;
    const int file = memfd_create("log", 0);
    EXPECT_EQ(::write(file, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    reading.path = "/proc/self/fd/" + std::to_string(file);
    const std::shared_ptr<void> closer(nullptr, [file](void*) { close(file); });
    LogReader log(reading.path);
    while (const auto event = log.next()) {
      ++reading.events;
      const int i = static_cast<int>(event->time.us - 1'000'000);
      if (i < 0 || i > 1000) continue;
      if (event->channel == channel(i) && event->bytes == payload(i)) reading.whole.insert(i);
    }
    reading.complaint = log.complaint();
    return reading;
  }

  TemporaryFolder folder_;
};

TEST_F(LcmLog, GivesBackWhatWasWritten) {
  write(100);
  LogReader log(path());
  for (int i = 0; i < 100; ++i) {
    const auto event = log.next();
    ASSERT_TRUE(event) << i;
    EXPECT_EQ(event->time.us, 1'000'000 + i);
    EXPECT_EQ(event->channel, channel(i));
    EXPECT_EQ(event->bytes, payload(i));
  }
  EXPECT_FALSE(log.next());
  EXPECT_EQ(log.complaint(), "");
  log.require_whole();
}

TEST_F(LcmLog, GivesBackAnEventByItsPlace) {
  write(100);
  LogReader log(path());
  std::vector<LogReader::Entry> entries;
  while (const auto entry = log.next_entry()) entries.push_back(*entry);
  ASSERT_EQ(entries.size(), 100u);
  for (const int i : {99, 0, 50, 49, 51}) {
    EXPECT_EQ(log.event(entries[static_cast<size_t>(i)]).bytes, payload(i));
  }
}

TEST_F(LcmLog, EventsLargerThanAReadAreWhole) {
  std::vector<uint8_t> large(300'000);
  std::mt19937 random(1);
  for (uint8_t& byte : large) byte = static_cast<uint8_t>(random());
  LogWriter log(path());
  for (int i = 0; i < 4; ++i) log.write(Time{i}, "IMAGE", large);
  log.close();
  LogReader reader(path());
  for (int i = 0; i < 4; ++i) EXPECT_EQ(reader.next()->bytes, large);
  EXPECT_FALSE(reader.next());
  reader.require_whole();
}

TEST_F(LcmLog, ATruncatedLastEventIsSaid) {
  const Bytes log = sample(20);
  for (size_t size = log.begins[18] + 1; size < log.text.size(); ++size) {
    const Reading reading = read(log.text.substr(0, size));
    const auto whole = static_cast<size_t>(
        std::upper_bound(log.begins.begin(), log.begins.end(), size) - log.begins.begin() - 1);
    EXPECT_EQ(reading.whole.size(), whole) << size;
    const bool is_border = size == log.begins[19];
    EXPECT_EQ(reading.complaint.empty(), is_border) << size;
    if (is_border) continue;
    EXPECT_NE(reading.complaint.find(reading.path + ": the last event is cut off at byte " +
                                     std::to_string(log.begins[whole]) + " (" +
                                     std::to_string(size - log.begins[whole]) + " bytes skipped)"),
              std::string::npos)
        << reading.complaint;
  }
}

TEST_F(LcmLog, ALostSyncWordCostsOneEvent) {
  Bytes log = sample(20);
  log.text.replace(log.begins[7], 4, std::string(4, '\0'));
  const Reading reading = read(log.text);
  EXPECT_EQ(reading.events, 19);
  EXPECT_EQ(reading.whole.size(), 19u);
  const size_t lost = log.begins[8] - log.begins[7];
  EXPECT_NE(reading.complaint.find("damaged at byte " + std::to_string(log.begins[7]) + " (" +
                                   std::to_string(lost) + " bytes skipped)"),
            std::string::npos)
      << reading.complaint;
}

TEST_F(LcmLog, AnAbsurdLengthCostsOneEvent) {
  for (const char* length :
       {"\x7f\xff\xff\xff", "\xff\xff\xff\xff", "\x10\x00\x00\x00", "\x80\x00\x00\x01"}) {
    for (const size_t field : {20u, 24u}) {  // of the channel, of the data
      Bytes log = sample(20);
      log.text.replace(log.begins[7] + field, 4, std::string(length, 4));
      const Reading reading = read(log.text);
      EXPECT_EQ(reading.events, 19);
      EXPECT_EQ(reading.whole.size(), 19u);
      EXPECT_FALSE(reading.complaint.empty());
    }
  }
}

// Every bit of every byte: at most the event that has it is lost, and a damaged frame is said.
TEST_F(LcmLog, AnyFlippedBitCostsAtMostItsEvent) {
  constexpr int kCount = 12;
  const Bytes log = sample(kCount);
  for (size_t at = 0; at < log.text.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string text = log.text;
      text[at] = static_cast<char>(text[at] ^ (1 << bit));
      const Reading reading = read(text);
      EXPECT_GE(reading.whole.size(), kCount - 1u) << at << "." << bit;
      const auto event = std::upper_bound(log.begins.begin(), log.begins.end(), at) - 1;
      const size_t field = at - *event;
      const bool is_frame = field < 4 || (field >= 20 && field < 28);
      EXPECT_FALSE(is_frame && reading.complaint.empty()) << at << "." << bit;
    }
  }
}

// Events of one size: a length that is damaged upwards ends exactly where another event begins.
TEST_F(LcmLog, ALengthThatSwallowsWholeEventsIsSeen) {
  LogWriter writer(path());
  const std::vector<uint8_t> data(256 - kHeader - 3, 5);
  for (int i = 0; i < 20; ++i) writer.write(Time{i}, "ABC", data);
  writer.close();
  const std::string text = bytes();
  for (const int event : {0, 7, 15}) {
    for (const int high : {1, 2, 4}) {
      std::string damaged = text;
      char& byte = damaged[static_cast<size_t>(256 * event + 26)];
      byte = static_cast<char>(byte + high);
      LogReader log(folder_.write("b.lcmlog", damaged));
      int count = 0;
      while (log.next()) ++count;
      EXPECT_EQ(count, 19) << event << " " << high;
      EXPECT_NE(log.complaint(), "");
    }
  }
}

// Anything at all, anywhere: no crash, no endless reading, no more bytes than the file has.
TEST_F(LcmLog, RandomDamageIsReadToItsEnd) {
  const Bytes log = sample(12);
  std::mt19937 random(7);
  const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
  for (int round = 0; round < 3000; ++round) {
    std::string text = log.text;
    for (size_t n = 1 + below(6); n > 0; --n) {
      const size_t at = below(text.size()), size = std::min(text.size() - at, 1 + below(40));
      if (const size_t what = below(4); what == 0) {
        text.erase(at, size);
      } else if (what == 1) {
        text.insert(at, log.text.substr(below(log.text.size()), size));
      } else {
        for (size_t i = 0; i < size; ++i) text[at + i] = static_cast<char>(random());
      }
      if (text.empty()) text = "x";
    }
    try {
      const Reading reading = read(text);
      EXPECT_LE(reading.events, static_cast<int>(text.size() / kHeader));
    } catch (const UnavailableError&) {
      // nothing of a log was left
    }
  }
}

TEST_F(LcmLog, ADamagedBeginningIsSkipped) {
  Bytes log = sample(20);
  log.text[0] = 'x';
  const Reading reading = read(log.text);
  EXPECT_EQ(reading.whole.size(), 19u);
  EXPECT_NE(reading.complaint.find("damaged at byte 0"), std::string::npos);
}

TEST_F(LcmLog, ManyDamagesAreOneLine) {
  Bytes log = sample(20);
  for (const size_t i : {2u, 4u, 6u, 8u, 10u}) log.text[log.begins[i]] = 'x';
  const Reading reading = read(log.text);
  EXPECT_EQ(reading.whole.size(), 15u);
  EXPECT_NE(reading.complaint.find("at 2 more places"), std::string::npos) << reading.complaint;
  EXPECT_EQ(reading.complaint.find('\n'), std::string::npos);
  LogReader reader(folder_.write("b.lcmlog", log.text));
  while (reader.next()) continue;
  EXPECT_EQ(error_of<UnavailableError>([&] { reader.require_whole(); }), reader.complaint());
}

TEST_F(LcmLog, SaysWhatIsWrongWithAFile) {
  const auto refusal = [](const std::string& path) {
    return error_of<UnavailableError>([&] { LogReader log(path); });
  };
  EXPECT_NE(refusal(folder_.path() + "/none").find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal(folder_.write("text", "no log")).find("not an LCM log"), std::string::npos);
  EXPECT_NE(refusal(folder_.write("empty", "")).find("not an LCM log"), std::string::npos);
  EXPECT_NE(refusal("/dev/null").find("not an LCM log"), std::string::npos);
  refusal(folder_.path());
  error_of<UnavailableError>([&] { LogWriter log(folder_.path() + "/no/such/folder"); });
}

TEST_F(LcmLog, AnUnfinishedLogLeavesTheEarlierOneAlone) {
  write(3);
  const std::string before = bytes();
  {
    LogWriter log(path());
    log.write(Time{1}, "A", payload(5));
  }
  EXPECT_EQ(bytes(), before);
  EXPECT_FALSE(std::filesystem::exists(path() + ".partial"));
  write(5);
  EXPECT_GT(bytes().size(), before.size());
  EXPECT_FALSE(std::filesystem::exists(path() + ".partial"));
}

TEST_F(LcmLog, ASymbolicLinkStaysOne) {
  write(3);
  const std::string link = folder_.path() + "/link.lcmlog";
  std::filesystem::create_symlink(path(), link);
  LogWriter log(link);
  log.write(Time{1}, "A", payload(5));
  log.close();
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(LogReader(path()).next()->channel, "A");
}

TEST_F(LcmLog, AFileThatIsNoLogIsNotReplaced) {
  const std::string notes = folder_.write("notes.txt", "keep me");
  EXPECT_NE(error_of<UnavailableError>([&] { LogWriter log(notes); }).find("notes.txt"),
            std::string::npos);
  std::ifstream file(notes);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "keep me");
}

TEST_F(LcmLog, AFullDiskIsNoticed) {
  LogWriter small("/dev/full");
  small.write(Time{1}, "A", payload(5));  // stays in a buffer until it is closed
  EXPECT_NE(error_of<UnavailableError>([&] { small.close(); }).find("/dev/full: log cannot be"),
            std::string::npos);
  LogWriter large("/dev/full");
  for (int i = 0; i < 10; ++i) large.write(Time{i}, "A", std::vector<uint8_t>(100'000));
  EXPECT_TRUE(large.has_failed());
  error_of<UnavailableError>([&] { large.close(); });
}

TEST_F(LcmLog, AFileSizeLimitIsNoticedAndLeavesTheEarlierLog) {
  write(3);
  const std::string before = bytes();
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{10'000, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  std::string error;
  {
    LogWriter log(path());
    for (int i = 0; i < 10; ++i) log.write(Time{i}, "A", std::vector<uint8_t>(5'000));
    EXPECT_TRUE(log.has_failed());
    error = error_of<UnavailableError>([&] { log.close(); });
  }
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(error.find("a.lcmlog"), std::string::npos);
  EXPECT_EQ(bytes(), before);
}

}  // namespace
}  // namespace foresight
