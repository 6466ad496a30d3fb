#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sim/noise.h"
#include "sim/textures.h"

namespace foresight::sim {
namespace {

const Rgb kInk{34, 34, 40};

cv::Mat blank(int width, int height, const Rgb& colour) {
  return cv::Mat(height, width, CV_8UC3, colour);
}

void paste(cv::Mat& image, const cv::Rect& area, const cv::Mat& picture) {
  cv::Mat target = image(area);
  cv::resize(picture, target, area.size(), 0, 0, cv::INTER_AREA);
}

// A diagram: axes and two noisy curves, or bars.
void draw_chart(cv::Mat& image, const cv::Rect& area, Random& random) {
  cv::rectangle(image, area, {250, 250, 250}, cv::FILLED);
  cv::rectangle(image, area, kInk, 2);
  const bool bars = random.below(2) == 0;
  const int columns = 10;
  for (int series = 0; series < 2; ++series) {
    const Rgb colour = random_colour(random);
    cv::Point last;
    for (int i = 0; i < columns; ++i) {
      const int x = area.x + area.width * (2 * i + 1) / (2 * columns);
      const int y = area.y + area.height - static_cast<int>(area.height * random.uniform(0.1, 0.9));
      if (bars && series == 0) {
        cv::rectangle(image, {x - area.width / (3 * columns), y},
                      {x + area.width / (3 * columns), area.y + area.height}, colour, cv::FILLED);
      } else if (i > 0) {
        cv::line(image, last, {x, y}, colour, 2, cv::LINE_AA);
        cv::circle(image, {x, y}, 4, colour, cv::FILLED, cv::LINE_AA);
      }
      last = {x, y};
    }
  }
}

}  // namespace

cv::Mat paint_page(int width, int height, int columns, Random& random) {
  cv::Mat image = blank(width, height, {240, 239, 233});
  const int margin = width / 12, gap = margin / 2;
  write_line(image, {margin, height / 30, width - 2 * margin, height / 18}, random_words(4, random),
             kInk, 2);
  const int top = height / 9, column_width = (width - 2 * margin - (columns - 1) * gap) / columns;
  const double text_height = columns > 1 ? width / 70.0 : width / 50.0;
  for (int i = 0; i < columns; ++i) {
    const int x = margin + i * (column_width + gap);
    int y = top;
    if (i == columns - 1 && columns > 1) {
      draw_chart(image, {x, y, column_width, height / 5}, random);
      y += height / 5;
    }
    write_words(image, {x, y, column_width, height - y - margin / 2}, {text_height, 1.9, kInk},
                random);
  }
  add_wear(image, 3, 3, random);
  return image;
}

cv::Mat paint_letter_card(char letter, Random& random) {
  cv::Mat image = blank(256, 256, {236, 234, 226});
  cv::rectangle(image, {10, 10}, {245, 245}, kInk, 3);
  const std::string text(1, letter);
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, 6.5, 22, nullptr);
  cv::putText(image, text, {(256 - size.width) / 2, (256 + size.height) / 2},
              cv::FONT_HERSHEY_DUPLEX, 6.5, kInk, 22, cv::LINE_AA);
  for (const int x : {20, 220}) {
    for (const int y : {20, 220}) cv::rectangle(image, {x, y}, {x + 15, y + 15}, kInk, cv::FILLED);
  }
  add_wear(image, 4, 4, random);
  return image;
}

cv::Mat paint_poster(int width, int height, Random& random) {
  const Rgb theme = random_colour(random);
  cv::Mat image = blank(width, height, {238, 237, 230});
  const int band = height / 8, margin = width / 24;
  cv::rectangle(image, {0, 0}, {width, band}, theme, cv::FILLED);
  const bool dark = theme[0] + theme[1] + theme[2] < 400;
  write_line(image, {margin, band / 8, width - 2 * margin, band / 2}, random_words(4, random),
             dark ? Rgb{250, 250, 245} : kInk, 2);
  write_line(image, {width / 4, band * 5 / 8, width / 2, band / 4}, random_words(5, random),
             dark ? Rgb{220, 220, 215} : kInk, 1);
  const int column = (width - 3 * margin) / 2;
  for (int side = 0; side < 2; ++side) {
    int y = band + margin;
    const int x = margin + side * (column + margin);
    for (int block = 0; y + height / 6 < height - margin; ++block) {
      const int block_height =
          std::min(height / 5 + random.below(height / 16), height - margin - y);
      const cv::Rect area(x, y, column, block_height - margin / 2);
      if ((block + side) % 2 == 0) {
        write_line(image, {x, y, column * 2 / 3, height / 40}, random_words(2, random), theme, 2);
        write_words(image, {x, y + height / 36, column, area.height - height / 36},
                    {width / 64.0, 1.8, kInk}, random);
      } else if (random.below(2) == 0) {
        draw_chart(image, area, random);
      } else {
        paste(image, area, paint_landscape(256, 192, random));
      }
      y += block_height;
    }
  }
  add_wear(image, 3, 3, random);
  return image;
}

cv::Mat paint_book_spine(Random& random) {
  const Rgb colour = random_colour(random);
  cv::Mat image = blank(64, 512, colour);
  const bool dark = colour[0] + colour[1] + colour[2] < 380;
  const Rgb ink = dark ? Rgb{240, 228, 190} : Rgb{40, 36, 40};
  const int band = 30 + random.below(60);
  cv::rectangle(image, {0, band}, {63, band + 8 + random.below(20)}, random_colour(random),
                cv::FILLED);
  cv::rectangle(image, {0, 470}, {63, 476}, ink, cv::FILLED);
  cv::Mat title = blank(340, 64, colour);
  write_line(title, {6, 8, 328, 48}, random_words(2 + random.below(2), random), ink, 2);
  cv::rotate(title, title, cv::ROTATE_90_CLOCKWISE);
  title.copyTo(image({0, 120, 64, 340}));
  cv::circle(image, {32, 490}, 9, ink, 2, cv::LINE_AA);
  add_wear(image, 10, 5, random);
  return image;
}

cv::Mat paint_book_cover(Random& random) {
  const Rgb colour = random_colour(random);
  cv::Mat image = blank(384, 512, colour);
  paste(
      image, {32, 150, 320, 250},
      random.below(2) == 0 ? paint_landscape(320, 250, random) : paint_abstract(320, 250, random));
  const bool dark = colour[0] + colour[1] + colour[2] < 380;
  const Rgb ink = dark ? Rgb{245, 240, 225} : kInk;
  write_line(image, {24, 30, 336, 60}, random_words(2, random), ink, 3);
  write_line(image, {60, 95, 264, 30}, random_words(3, random), ink, 1);
  write_line(image, {80, 430, 224, 34}, random_words(2, random), ink, 2);
  add_wear(image, 8, 4, random);
  return image;
}

cv::Mat paint_page_edges(Random& random) {
  cv::Mat image = blank(256, 64, {226, 218, 196});
  for (int y = 0; y < 64; y += 2) {
    cv::line(image, {0, y}, {255, y}, Rgb{190, 180, 156} * random.uniform(0.8, 1.15), 1);
  }
  return image;
}

cv::Mat paint_checkerboard(int columns, int rows) {
  constexpr int kSquare_px = 48;
  cv::Mat image = blank((columns + 2) * kSquare_px, (rows + 2) * kSquare_px, {242, 242, 238});
  for (int y = 0; y < rows; ++y) {
    for (int x = y % 2; x < columns; x += 2) {
      const cv::Point corner((x + 1) * kSquare_px, (y + 1) * kSquare_px);
      cv::rectangle(image, {corner, cv::Size(kSquare_px, kSquare_px)}, {24, 24, 26}, cv::FILLED);
    }
  }
  return image;
}

cv::Mat paint_screen(Random& random) {
  cv::Mat image = blank(1024, 576, {24, 27, 36});
  cv::rectangle(image, {0, 0}, {1023, 26}, {52, 58, 74}, cv::FILLED);
  cv::rectangle(image, {0, 26}, {150, 575}, {32, 36, 46}, cv::FILLED);
  write_words(image, {14, 34, 130, 520}, {8.5, 2.3, {150, 160, 175}}, random);
  int indent = 0;
  for (int y = 52; y < 566; y += 19) {
    if (random.below(9) == 0) continue;
    indent = std::clamp(indent + random.below(3) - 1, 0, 4);
    const Rgb colours[] = {{130, 200, 140}, {225, 190, 110}, {120, 170, 230}, {210, 210, 215}};
    int x = 170 + indent * 24;
    for (int word = 0; word < 2 + random.below(4); ++word) {
      const std::string text = random_words(1, random);
      cv::putText(image, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.5, colours[random.below(4)], 1,
                  cv::LINE_AA);
      x += static_cast<int>(text.size()) * 10 + 12;
    }
  }
  paste(image, {740, 60, 256, 192}, paint_landscape(256, 192, random));
  draw_chart(image, {740, 290, 256, 200}, random);
  return image;
}

cv::Mat paint_keyboard(Random& random) {
  cv::Mat image = blank(1024, 320, {46, 47, 50});
  constexpr int kPitch_px = 60;
  for (int row = 0; row < 5; ++row) {
    const int shift = row == 4 ? 0 : (row % 3) * 18;
    for (int column = 0; column < 17; ++column) {
      const bool space_bar = row == 4 && column >= 4 && column < 10;
      if (space_bar && column > 4) continue;
      const cv::Point corner(10 + shift + column * kPitch_px, 10 + row * kPitch_px);
      const cv::Size size(space_bar ? 6 * kPitch_px - 8 : kPitch_px - 8, kPitch_px - 8);
      const cv::Rect key = cv::Rect(corner, size) & cv::Rect(0, 0, image.cols, image.rows);
      if (key.width < 20) continue;
      cv::rectangle(image, key, {74, 76, 80}, cv::FILLED);
      cv::rectangle(image, key, {22, 22, 24}, 2);
      if (space_bar) continue;
      const std::string cap(1, static_cast<char>('A' + random.below(26)));
      cv::putText(image, cap, corner + cv::Point(12, 32), cv::FONT_HERSHEY_DUPLEX, 0.9,
                  {225, 225, 228}, 2, cv::LINE_AA);
    }
  }
  return image;
}

cv::Mat paint_can_label(Random& random) {
  const Rgb colour = random_colour(random);
  cv::Mat image = blank(512, 256, colour);
  cv::rectangle(image, {0, 150}, {511, 215}, random_colour(random), cv::FILLED);
  for (int copy = 0; copy < 2; ++copy) {
    const int x = 256 * copy;
    cv::ellipse(image, {x + 128, 85}, {100, 48}, 0, 0, 360, {240, 236, 224}, cv::FILLED,
                cv::LINE_AA);
    write_line(image, {x + 48, 60, 160, 50}, random_words(1, random), kInk, 3);
    write_words(image, {x + 12, 152, 232, 62}, {11, 1.6, {245, 245, 240}}, random);
    cv::circle(image, {x + 30, 28}, 14, random_colour(random), cv::FILLED, cv::LINE_AA);
  }
  for (int x = 0; x < 512; x += 16) cv::line(image, {x, 226}, {x + 8, 250}, {240, 236, 224}, 3);
  add_wear(image, 6, 4, random);
  return image;
}

cv::Mat paint_led() {
  constexpr int kSize = 64;
  cv::Mat image(kSize, kSize, CV_8UC3);
  const Rgb core{86, 30, 26}, rim{52, 6, 5};
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double radius = std::hypot(x - kSize / 2 + 0.5, y - kSize / 2 + 0.5) / (kSize / 2);
      const double weight = std::clamp(1.25 - 1.5 * radius, 0.0, 1.0);
      const Rgb colour = rim + (core - rim) * weight;
      image.at<cv::Vec3b>(y, x) = {static_cast<uint8_t>(colour[0]), static_cast<uint8_t>(colour[1]),
                                   static_cast<uint8_t>(colour[2])};
    }
  }
  return image;
}

cv::Mat paint_led_panel(int number) {
  cv::Mat image = blank(256, 256, {38, 40, 44});
  cv::rectangle(image, {5, 5}, {250, 250}, {214, 212, 204}, 6);
  for (const int x : {22, 233}) {
    for (const int y : {22, 233}) cv::circle(image, {x, y}, 7, {150, 150, 146}, cv::FILLED);
  }
  write_line(image, {92, 12, 72, 18}, "PANEL " + std::to_string(number), {214, 212, 204}, 1);
  write_line(image, {104, 226, 48, 16}, "3 x 3", {150, 150, 146}, 1);
  return image;
}

}  // namespace foresight::sim
