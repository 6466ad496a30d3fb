// Lists of images as people's tools write them.
#include "procs/camera/image_list.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class ImageList : public testing::Test {
 protected:
  std::vector<ListedImage> load(const std::string& text) const {
    return load_image_list(folder_.write("rgb.txt", text));
  }
  std::string refusal(const std::string& text) const {
    return error_of<ConfigError>([&] { load(text); });
  }
  std::string in_folder(const std::string& name) const { return folder_.path() + "/" + name; }
  TemporaryFolder folder_;
};

TEST_F(ImageList, ReadsMarksCommasCarriageReturnsAndLinesOfBlanks) {
  for (const char* text :
       {"0.0 a.jpg\n0.1 b.jpg\n",
        "\xEF\xBB\xBF"
        "0.0 a.jpg\r\n0.1 b.jpg\r\n",
        "# time,file\n0.0,a.jpg\n0.1, b.jpg\n", "  \n0.0\ta.jpg\n\n \t \n0.1   b.jpg   \n   \n",
        "0.0;a.jpg\n0.1 ; \"b.jpg\"\n", "0.0 a.jpg\n0.1 b.jpg"}) {
    const auto images = load(text);
    ASSERT_EQ(images.size(), 2u) << text;
    EXPECT_EQ(images[0].path, in_folder("a.jpg")) << text;
    EXPECT_EQ(images[1].path, in_folder("b.jpg")) << text;
    EXPECT_EQ(images[1].time, Time{100'000}) << text;
  }
}

TEST_F(ImageList, NamesMayHoldBlanksAndBeAbsolute) {
  const auto images = load("0.0 my 0.jpg\n0.1 /elsewhere/b 1.jpg\n0.2 \"c d.jpg\"\n");
  EXPECT_EQ(images[0].path, in_folder("my 0.jpg"));
  EXPECT_EQ(images[1].path, "/elsewhere/b 1.jpg");
  EXPECT_EQ(images[2].path, in_folder("c d.jpg"));
}

TEST_F(ImageList, NamesMayBeWindows) {
  std::filesystem::create_directory(in_folder("rgb"));
  folder_.write("rgb/a.jpg", "");
  EXPECT_EQ(load("0.0 rgb\\a.jpg\n")[0].path, in_folder("rgb/a.jpg"));
}

TEST_F(ImageList, OfPairsOfImagesSaysWhatIsTooMuch) {
  folder_.write("a.jpg", "");
  EXPECT_NE(refusal("0.0 a.jpg 0.01 depth/a.png\n").find("'0.01 depth/a.png' is too much"),
            std::string::npos);
}

TEST_F(ImageList, ReadsStampsInNanosecondsMicrosecondsAndMilliseconds) {
  for (const char* text :
       {"1403636579763555584 a\n1403636579863555584 b\n",
        "1403636579763555 a\n1403636579863555 b\n", "1403636579763 a\n1403636579863 b\n"}) {
    const auto images = load(text);
    EXPECT_NEAR(static_cast<double>(images[0].time.us), 1403636579763555.0, 1000) << text;
    EXPECT_EQ(images[1].time - images[0].time, milliseconds(100)) << text;
  }
  EXPECT_NE(refusal("1000000000 a\n1033333333 b\n1066666666 c\n").find("are the stamps seconds"),
            std::string::npos)
      << "nanoseconds since the start of a recording look like seconds";
}

TEST_F(ImageList, NamesTheCauseOfARefusal) {
  EXPECT_NE(refusal("0.0 a\n0.1 b\n0.1 c\n").find("rgb.txt:3: its time is that of"),
            std::string::npos);
  EXPECT_NE(refusal("0.0 a\n0.2 b\n0.1 c\n").find("rgb.txt:3: its time is before"),
            std::string::npos);
  EXPECT_NE(refusal("0.0 a\nnan b\n").find("rgb.txt:2: 'nan' is no time"), std::string::npos);
  EXPECT_NE(refusal("-1.0 a\n").find("'-1.0' is no time"), std::string::npos);
  EXPECT_NE(refusal("99999999999999999999 a\n").find("is no time"), std::string::npos);
  EXPECT_NE(refusal("a.jpg 0.0\n").find("'a.jpg' is no time"), std::string::npos);
  EXPECT_NE(refusal("0,0 a.jpg\n").find("decimal comma"), std::string::npos);
  EXPECT_NE(refusal("0.0\n").find("rgb.txt:1: names no file"), std::string::npos);
  EXPECT_NE(refusal(std::string("\xFF\xFE"
                                "0\0.\0",
                                6))
                .find("UTF-16"),
            std::string::npos);
  EXPECT_NE(refusal("# nothing\n\n").find("lists no frames"), std::string::npos);
}

}  // namespace
}  // namespace foresight
