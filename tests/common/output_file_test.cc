// What tools write is checked before a run and complete after it, or named.
#include "common/output_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

TEST(OutputFile, IsCheckedBeforeARunAndLeavesNoTrace) {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/a.json";
  check_output("--json", file);
  EXPECT_FALSE(std::filesystem::exists(file));
  folder.write("a.json", "old");
  check_output("--json", file);
  EXPECT_EQ(std::filesystem::file_size(file), 3u) << "what is there stays";
  check_output("--json", "");
  const auto refusal = [&](const std::string& path) {
    return error_of<UnavailableError>([&] { check_output("--json", path); });
  };
  EXPECT_NE(refusal(folder.path() + "/none/a.json").find("there is no folder"), std::string::npos);
  EXPECT_NE(refusal(folder.path()).find("is a folder"), std::string::npos);
  EXPECT_NE(refusal("/proc/a.json").find("--json /proc/a.json: cannot be written"),
            std::string::npos);
}

TEST(OutputFile, OfAPictureHasAKnownExtension) {
  const TemporaryFolder folder;
  check_output("--grid", folder.path() + "/a.PNG", kPictureExtensions);
  for (const char* name : {"/a", "/a.txt", "/.png", "/a.png.gz"}) {
    const std::string line = error_of<UsageError>(
        [&] { check_output("--grid", folder.path() + name, kPictureExtensions); });
    EXPECT_NE(line.find("must end with one of .png, .jpg, .jpeg"), std::string::npos) << line;
  }
}

TEST(OutputFile, AFolderIsMade) {
  const TemporaryFolder folder;
  check_output_folder("--plots", folder.path() + "/a/b");
  EXPECT_TRUE(std::filesystem::is_directory(folder.path() + "/a/b"));
  const std::string file = folder.write("file", "");
  EXPECT_NE(error_of<UnavailableError>([&] { check_output_folder("--plots", file); }).find(file),
            std::string::npos);
}

TEST(OutputFile, AFullDiskIsNamed) {
  const std::string line =
      error_of<UnavailableError>([] { write_output("/dev/full", std::string_view("text")); });
  EXPECT_NE(line.find("/dev/full: cannot be written: No space left"), std::string::npos) << line;
}

TEST(OutputFile, OneThatCannotBeReplacedStaysAsItIs) {
  const TemporaryFolder folder;
  const std::string file = folder.write("a", "old");
  replace_output(file, "new");
  EXPECT_EQ(std::filesystem::file_size(file), 3u);
  EXPECT_FALSE(std::filesystem::exists(file + ".part"));
  std::filesystem::create_directory(file + ".part");
  EXPECT_NE(error_of<UnavailableError>([&] { replace_output(file, "newest"); }).find(file),
            std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(file), 3u);
}

TEST(OutputFile, OneThatFailsDoesNotStopTheNext) {
  const TemporaryFolder folder;
  RunErrors errors;
  errors.report();
  errors.attempt([] { throw ConfigError("first"); });
  errors.attempt([] { write_output("/dev/full", std::string_view("text")); });
  errors.attempt([&] { write_output(folder.path() + "/a", std::string_view("text")); });
  errors.add("last");
  EXPECT_TRUE(std::filesystem::exists(folder.path() + "/a"));
  try {
    errors.report();
    FAIL();
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), kExitConfig) << "that of the first";
    EXPECT_EQ(std::string(error.what()),
              "first\n/dev/full: cannot be written: No space left on device\nlast");
  }
}

TEST(OutputFile, JsonTextIsQuoted) {
  EXPECT_EQ(json_text("my \"room\"\\\n"), "\"my \\\"room\\\"\\\\\\u000a\"");
}

}  // namespace
}  // namespace foresight
