#include "common/yaml_reader.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class YamlReaderTest : public testing::Test {
 protected:
  YamlReader open(const std::string& text) {
    return YamlReader::open(folder_.write("file.yaml", text));
  }
  // The refusal of `use` on a file of this text; it names the file and every part.
  template <class Use>
  void expect_refusal(const std::string& text, std::initializer_list<const char*> parts,
                      const Use& use) {
    const std::string line = error_of<ConfigError>([&] {
      YamlReader in = open(text);
      use(in);
    });
    EXPECT_NE(line.find("file.yaml"), std::string::npos) << line;
    for (const char* part : parts) EXPECT_NE(line.find(part), std::string::npos) << line;
  }
  TemporaryFolder folder_;
};

TEST_F(YamlReaderTest, ReadsWhatIsThere) {
  YamlReader in = open(
      "%YAML:1.0\nname: a\nmass: 2.5\nrow: [1, 2]\nbox: {side: 3}\n"
      "list:\n  - {x: 1}\n  - {x: 2}\n");
  EXPECT_EQ(in.text("name"), "a");
  EXPECT_EQ(in.number("mass", 0, 3), 2.5);
  EXPECT_EQ(in.numbers("row", 2, 0, 9), (std::vector<double>{1, 2}));
  EXPECT_EQ(in.map("box").number("side", 0, 9), 3);
  EXPECT_EQ(in.list("list", 1, 2).at(1).number("x", 0, 9), 2);
  EXPECT_EQ(in.number_or("none", 7, 0, 9), 7);
  EXPECT_TRUE(in.has("mass"));
  EXPECT_FALSE(in.has("none"));
  in.refuse_leftovers();
}

TEST_F(YamlReaderTest, RefusesNumbersThatAreNone) {
  const auto use = [](YamlReader& in) { in.number("mass", 0, 3); };
  expect_refusal("other: 1\n", {"mass", "missing"}, use);
  expect_refusal("mass: heavy\n", {"mass", "not a number"}, use);
  expect_refusal("mass: [1]\n", {"mass", "not a number"}, use);
  expect_refusal("mass: .nan\n", {"mass", "[0, 3]"}, use);
  expect_refusal("mass: 3.5\n", {"mass", "3.5", "[0, 3]"}, use);
}

TEST_F(YamlReaderTest, RefusesListsOfTheWrongLength) {
  expect_refusal("row: [1, 2]\n", {"row", "3 numbers"},
                 [](YamlReader& in) { in.numbers("row", 3, 0, 9); });
  expect_refusal("row: 1\n", {"row", "3 numbers"},
                 [](YamlReader& in) { in.numbers("row", 3, 0, 9); });
  expect_refusal("list: [{x: 1}]\n", {"list", "2 to 4"},
                 [](YamlReader& in) { in.list("list", 2, 4); });
  expect_refusal("list: [1, 2]\n", {"list", "maps"}, [](YamlReader& in) { in.list("list", 2, 4); });
  expect_refusal("box: 1\n", {"box", "map"}, [](YamlReader& in) { in.map("box"); });
  expect_refusal("name: [a]\n", {"name", "one word"}, [](YamlReader& in) { in.text("name"); });
}

TEST_F(YamlReaderTest, NamesTheWayToANestedKey) {
  expect_refusal("list:\n  - {x: 1}\n  - {x: 9}\n", {"list[1]", "x", "[0, 3]"}, [](YamlReader& in) {
    for (YamlReader& entry : in.list("list", 1, 3)) entry.number("x", 0, 3);
  });
  expect_refusal("box: {side: 9}\n", {"box", "side"},
                 [](YamlReader& in) { in.map("box").number("side", 0, 3); });
}

TEST_F(YamlReaderTest, RefusesKeysThatNobodyAskedFor) {
  expect_refusal("mass: 1\nmas: 2\n", {"mas", "unknown key"}, [](YamlReader& in) {
    in.number("mass", 0, 3);
    in.refuse_leftovers();
  });
}

TEST_F(YamlReaderTest, RefusesWhatIsNoMapOfLines) {
  for (const char* text : {"", "just text", "- a\n- b\n", "a: [unclosed", "\x01\xff"}) {
    expect_refusal(text, {}, [](YamlReader&) {});
  }
  EXPECT_NE(error_of<ConfigError>([&] {
              YamlReader::open(folder_.path() + "/none.yaml");
            }).find("none.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace foresight
