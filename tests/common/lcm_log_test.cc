#include "common/lcm_log.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

TEST(LcmLog, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/a.lcmlog";
  {
    LogWriter log(path);
    for (int i = 0; i < 100; ++i) {
      const std::vector<uint8_t> bytes(static_cast<size_t>(i * 37 % 101), static_cast<uint8_t>(i));
      log.write(Time{1'000'000 + i}, i % 2 == 0 ? "EVEN" : "ODD", bytes);
    }
  }
  LogReader log(path);
  for (int i = 0; i < 100; ++i) {
    const auto event = log.next();
    ASSERT_TRUE(event) << i;
    EXPECT_EQ(event->time.us, 1'000'000 + i);
    EXPECT_EQ(event->channel, i % 2 == 0 ? "EVEN" : "ODD");
    EXPECT_EQ(event->bytes,
              std::vector<uint8_t>(static_cast<size_t>(i * 37 % 101), static_cast<uint8_t>(i)));
  }
  EXPECT_FALSE(log.next());
}

TEST(LcmLog, EndsAtATruncatedEvent) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/a.lcmlog";
  const std::vector<uint8_t> bytes(100, 7);
  {
    LogWriter log(path);
    log.write(Time{1}, "A", bytes);
    log.write(Time{2}, "A", bytes);
  }
  const auto size = std::filesystem::file_size(path);
  for (uintmax_t cut : {1u, 50u, 100u, 110u, 127u}) {
    std::filesystem::resize_file(path, size - cut);
    LogReader log(path);
    EXPECT_TRUE(log.next()) << cut;
    EXPECT_FALSE(log.next()) << cut;
  }
}

TEST(LcmLog, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  const auto refusal = [](const std::string& path) {
    return error_of<UnavailableError>([&] { LogReader log(path); });
  };
  EXPECT_NE(refusal(folder.path() + "/none").find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal(folder.write("text", "no log")).find("not an LCM log"), std::string::npos);
  EXPECT_NE(refusal(folder.write("empty", "")).find("not an LCM log"), std::string::npos);
  refusal(folder.path());
  error_of<UnavailableError>([&] { LogWriter log(folder.path() + "/no/such/folder"); });
}

}  // namespace
}  // namespace foresight
