#include "common/params.h"

#include <gtest/gtest.h>

#include "tests/common/files.h"

namespace foresight {
namespace {

enum class Mode { kA, kB };
constexpr auto names_of(Mode) {
  return std::array{EnumName{Mode::kA, "a"}, EnumName{Mode::kB, "b"}};
}

struct TestParams {
  double gain = 0.5;
  int count = 3;
  bool fast = false;
  Mode mode = Mode::kA;
  std::vector<int> places = {0, 3};
  std::vector<std::string> names;
  std::string text;

  template <class V>
  void visit(V& v) {
    v("gain", gain, {.unit = "1", .min = 0, .max = 1, .doc = "a share"});
    v("count", count, {.min = 1, .max = 10, .doc = "a number"});
    v("fast", fast, {.doc = "a switch"});
    v("mode", mode, {.doc = "a choice"});
    v("places", places, {.min = 0, .max = 9, .doc = "some numbers"});
    v("names", names, {.doc = "some words"});
    v("text", text, {.doc = "free text"});
  }
};

class Params : public testing::Test {
 protected:
  TestParams load_file(const std::string& yaml) {
    return load_params<TestParams>(ParamSource::from_file(folder_.write("p.yaml", yaml)));
  }
  static TestParams load_set(std::initializer_list<std::string> assignments) {
    ParamSource source;
    for (const std::string& a : assignments) source.override_with(a);
    return load_params<TestParams>(std::move(source));
  }
  std::string file_refusal(const std::string& yaml) {
    return error_of<ConfigError>([&] { load_file(yaml); });
  }
  static std::string set_refusal(const std::string& assignment) {
    return error_of<ConfigError>([&] { load_set({assignment}); });
  }
  TemporaryFolder folder_;
};

void expect_parts(const std::string& line, std::initializer_list<std::string> parts) {
  for (const std::string& part : parts) {
    EXPECT_NE(line.find(part), std::string::npos) << part << " in " << line;
  }
  EXPECT_EQ(line.find('\n'), std::string::npos) << "one line: " << line;
}

TEST_F(Params, AreTheDefaultsWhenNothingIsGiven) {
  const TestParams p = load_params<TestParams>({});
  EXPECT_EQ(p.gain, 0.5);
  EXPECT_EQ(p.mode, Mode::kA);
  EXPECT_EQ(load_file("").count, 3);
  EXPECT_EQ(load_file("# only a comment\n").count, 3);
}

TEST_F(Params, ComeFromAFileAndAreOverridden) {
  const std::string path = folder_.write("p.yaml", "gain: 0.25\ncount: 7\nfast: true\nmode: b\n");
  ParamSource source = ParamSource::from_file(path);
  source.override_with("count=8");
  source.override_with("text=x=y z");
  const auto p = load_params<TestParams>(std::move(source));
  EXPECT_EQ(p.gain, 0.25);
  EXPECT_EQ(p.count, 8);
  EXPECT_TRUE(p.fast);
  EXPECT_EQ(p.mode, Mode::kB);
  EXPECT_EQ(p.text, "x=y z");
}

TEST_F(Params, TextIsTakenAsItStands) {
  for (const std::string text : {"/data/take #1", "a: b", "[x", "~", "*x", "null", "'quoted'", "{",
                                 "- a", "5", "true", "", "%s", "ü"}) {
    EXPECT_EQ(load_set({"text=" + text}).text, text);
  }
}

TEST_F(Params, RefusesAnUnknownKeyAndNamesTheKnownOnes) {
  expect_parts(file_refusal("gian: 0.25\n"), {"p.yaml", "gian", "gain", "count"});
  expect_parts(set_refusal("gian=0.25"), {"--set", "gian", "gain"});
}

TEST_F(Params, RefusesValuesOutOfRangeAndNamesTheLimit) {
  expect_parts(file_refusal("gain: 1.5\n"), {"p.yaml", "gain", "1.5", "[0, 1]"});
  expect_parts(set_refusal("count=0"), {"--set", "count", "0", "[1, 10]"});
  expect_parts(set_refusal("gain=-1e-9"), {"gain"});
  expect_parts(set_refusal("gain=.nan"), {"gain"});
  expect_parts(set_refusal("gain=.inf"), {"gain"});
  EXPECT_EQ(load_set({"gain=0"}).gain, 0);
  EXPECT_EQ(load_set({"gain=1"}).gain, 1);
}

TEST_F(Params, RefusesTheWrongType) {
  expect_parts(set_refusal("count=3.5"), {"count", "'3.5'", "int"});
  expect_parts(set_refusal("count=99999999999"), {"count", "int"});
  expect_parts(set_refusal("gain=high"), {"gain", "'high'", "float"});
  expect_parts(set_refusal("fast=perhaps"), {"fast", "bool"});
  expect_parts(set_refusal("gain="), {"gain"});
  expect_parts(file_refusal("gain: [1, 2]\n"), {"gain", "float"});
  expect_parts(file_refusal("text: {a: b}\n"), {"text", "string"});
}

TEST_F(Params, RefusesAKeyWithoutValue) {
  expect_parts(file_refusal("gain:\n"), {"p.yaml", "gain"});
  expect_parts(file_refusal("text:\n"), {"p.yaml", "text"});
  EXPECT_EQ(load_file("text: ''\n").text, "");
}

TEST_F(Params, RefusesAWordThatIsNoChoice) {
  expect_parts(set_refusal("mode=c"), {"mode", "'c'", "a, b"});
}

TEST_F(Params, AListIsYamlsOrOneText) {
  using Numbers = std::vector<int>;
  EXPECT_EQ(load_file("places: [4, 5, 6]\n").places, (Numbers{4, 5, 6}));
  EXPECT_EQ(load_file("places: 4 5,6\n").places, (Numbers{4, 5, 6}));
  EXPECT_EQ(load_file("places: 7\n").places, Numbers{7});
  EXPECT_EQ(load_file("places: []\n").places, Numbers{});
  EXPECT_EQ(load_set({"places= 4, 5 "}).places, (Numbers{4, 5}));
  EXPECT_EQ(load_set({"places="}).places, Numbers{});
  EXPECT_EQ(load_file("names: [a b, ~x]\n").names, (std::vector<std::string>{"a b", "~x"}));
  EXPECT_EQ(load_set({"names=MESH VIEW"}).names, (std::vector<std::string>{"MESH", "VIEW"}));
}

TEST_F(Params, RefusesAListByItsElements) {
  expect_parts(set_refusal("places=4 10"), {"places", "10", "[0, 9]"});
  expect_parts(set_refusal("places=4 x"), {"places", "'x'", "int"});
  expect_parts(file_refusal("places: [1, [2]]\n"), {"places", "list"});
  expect_parts(file_refusal("places: {a: 1}\n"), {"places", "list"});
  expect_parts(file_refusal("places:\n"), {"places"});
  expect_parts(file_refusal("mode: [a]\n"), {"mode", "a, b"});
}

TEST_F(Params, AChoiceHasANameAndANameIsAChoice) {
  EXPECT_STREQ(name_of(Mode::kB), "b");
  EXPECT_EQ(value_named<Mode>("b"), Mode::kB);
  EXPECT_FALSE(value_named<Mode>("c"));
}

TEST_F(Params, RefusesAKeyThatIsGivenTwice) {
  expect_parts(file_refusal("gain: 0.1\ngain: 0.2\n"), {"p.yaml", "gain", "twice"});
}

TEST_F(Params, RefusesFilesThatAreNoMap) {
  expect_parts(file_refusal("- 1\n- 2\n"), {"p.yaml", "map"});
  expect_parts(file_refusal("just text"), {"p.yaml", "map"});
  expect_parts(file_refusal("gain: [1\n"), {"p.yaml", "YAML"});
  file_refusal("[a, b]: 1\n");
  error_of<ConfigError>([&] { ParamSource::from_file(folder_.path() + "/none.yaml"); });
  error_of<ConfigError>([&] { ParamSource::from_file(folder_.path()); });
}

TEST_F(Params, RefusesAssignmentsWithoutKey) {
  error_of<UsageError>([] { load_set({"gain"}); });
  error_of<UsageError>([] { load_set({"=1"}); });
}

TEST_F(Params, DescribeThemselves) {
  std::vector<ParamDescription> descriptions;
  ParamSource source;
  source.override_with("gain=0.25");
  load_params<TestParams>(std::move(source), &descriptions);
  ASSERT_EQ(descriptions.size(), 7u);
  EXPECT_EQ(descriptions[0].key, "gain");
  EXPECT_EQ(descriptions[0].value, "0.25");
  EXPECT_EQ(descriptions[0].unit, "1");
  EXPECT_EQ(descriptions[1].type, "int");
  EXPECT_EQ(descriptions[2].value, "false");
  EXPECT_EQ(descriptions[3].choices, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(descriptions[4].type, "int list");
  EXPECT_EQ(descriptions[4].value, "0 3");
}

}  // namespace
}  // namespace foresight
