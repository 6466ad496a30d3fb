// What a process leaves for the one after it: of the same run, whole, or not at all.
#include "common/kept_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class KeptFileTest : public testing::Test {
 protected:
  std::string content() const {
    std::ifstream file(kept_.path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void replace(const std::string& text) const {
    std::ofstream(kept_.path(), std::ios::binary) << text;
  }
  TemporaryFolder folder_;
  RunIdentity run_ = this_run();
  KeptFile kept_{folder_.path() + "/kept", "a/b c", run_};
  std::string trouble_;
};

TEST_F(KeptFileTest, IsReadAsItWasWritten) {
  EXPECT_FALSE(kept_.read(&trouble_));
  EXPECT_EQ(trouble_, "") << "none is no trouble";
  kept_.write("one");
  kept_.write(std::string("two\n\0 x", 7));
  EXPECT_EQ(kept_.read(&trouble_), std::string("two\n\0 x", 7));
  EXPECT_EQ(trouble_, "");
  EXPECT_FALSE(std::filesystem::exists(kept_.path() + ".part"));
  EXPECT_EQ(std::filesystem::path(kept_.path()).filename(),
            "kept_a_b_c." + std::to_string(getppid()));
}

TEST_F(KeptFileTest, NoByteMayDiffer) {
  kept_.write("position 1.25\n");
  const std::string whole = content();
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    replace(damaged);
    EXPECT_FALSE(kept_.read(&trouble_)) << "byte " << i;
    replace(whole.substr(0, i));
    EXPECT_FALSE(kept_.read(&trouble_)) << "cut at " << i;
    EXPECT_EQ(trouble_, kept_.path() + ": is damaged");
  }
  replace(whole);
  EXPECT_TRUE(kept_.read(&trouble_)) << trouble_;
}

TEST_F(KeptFileTest, IsNotForAnotherRun) {
  kept_.write("mine");
  RunIdentity other = run_;
  ++other.parent_start;
  KeptFile theirs(folder_.path() + "/kept", "a/b c", other);
  EXPECT_FALSE(theirs.read(&trouble_));
  EXPECT_EQ(trouble_, "");
  theirs.remove_those_of_ended_runs();
  EXPECT_TRUE(kept_.read(&trouble_)) << "this run goes on";
  theirs.write("theirs");  // whose parent has ended
  kept_.remove_those_of_ended_runs();
  EXPECT_FALSE(std::filesystem::exists(kept_.path())) << "of the same number";
}

TEST_F(KeptFileTest, EndsItsReadersThreeTimesAtMost) {
  kept_.write("deadly");
  for (int i = 0; i < KeptFile::kMostReads; ++i) EXPECT_TRUE(kept_.read(&trouble_));
  EXPECT_FALSE(kept_.read(&trouble_));
  EXPECT_EQ(trouble_, kept_.path() + ": 3 have ended with it");
  kept_.write("new");
  EXPECT_TRUE(kept_.read(&trouble_));
}

TEST_F(KeptFileTest, RemovesWhatItWrote) {
  kept_.write("text");
  std::ofstream(kept_.path() + ".part") << "cut o";
  kept_.remove();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() + "/kept"));
}

TEST_F(KeptFileTest, AFolderThatCannotBeWrittenIsSaid) {
  const std::string file = folder_.write("file", "");
  const KeptFile kept(file, "name", run_);
  const std::string line = error_of<UnavailableError>([&] { kept.write("text"); });
  EXPECT_NE(line.find(file), std::string::npos) << line;
}

}  // namespace
}  // namespace foresight
