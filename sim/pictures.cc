#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sim/noise.h"
#include "sim/textures.h"

namespace foresight::sim {
namespace {

const Rgb kInk{34, 34, 40};

cv::Vec3b to_pixel(const Rgb& colour) {
  return {cv::saturate_cast<uint8_t>(colour[0]), cv::saturate_cast<uint8_t>(colour[1]),
          cv::saturate_cast<uint8_t>(colour[2])};
}

void draw_barcode(cv::Mat& image, const cv::Rect& area, Random& random) {
  cv::rectangle(image, area, {235, 230, 220}, cv::FILLED);
  for (int x = area.x + 6; x < area.x + area.width - 10;) {
    const int bar = 2 + random.below(5);
    cv::rectangle(image, {x, area.y + 6, bar, area.height - 12}, kInk, cv::FILLED);
    x += bar + 2 + random.below(5);
  }
}

void draw_scribble(cv::Mat& image, const cv::Point& centre, int size, const Rgb& ink,
                   Random& random) {
  switch (random.below(4)) {
    case 0:
      cv::ellipse(image, centre, {size, size * 2 / 3}, random.uniform(0, 180), 0, 350, ink, 3,
                  cv::LINE_AA);
      break;
    case 1:
      cv::arrowedLine(image, centre, centre + cv::Point(size, random.below(size) - size / 2), ink,
                      3, cv::LINE_AA);
      break;
    case 2:
      cv::rectangle(image, {centre.x - size / 2, centre.y - size / 3, size, size * 2 / 3}, ink, 3,
                    cv::LINE_AA);
      break;
    default:
      cv::putText(image, random_words(2, random), centre, cv::FONT_HERSHEY_SCRIPT_SIMPLEX,
                  size / 70.0, ink, 2, cv::LINE_AA);
  }
}

}  // namespace

// Sky, ranges of hills, a foreground: each band coloured by noise.
cv::Mat paint_landscape(int width, int height, Random& random) {
  cv::Mat image(height, width, CV_8UC3);
  const std::vector<float> clouds = fractal_noise(width, height, {3, 6, 5, 0.55f}, random);
  const std::vector<float> ground = fractal_noise(width, height, {8, 8, 6, 0.75f}, random);
  const Rgb sky = random.below(3) == 0 ? Rgb{232, 160, 104} : Rgb{108, 158, 212};
  const Rgb hills[] = {{96, 112, 140}, {62, 92, 84}, {random.uniform(70, 150), 104, 48}};
  for (int x = 0; x < width; ++x) {
    double ridge[3];
    for (int k = 0; k < 3; ++k) {
      const size_t row = static_cast<size_t>(height / 4 * (k + 1)) * width;
      ridge[k] = height * (0.38 + 0.2 * k - 0.16 * clouds[row + x] - 0.05 * ground[row + x]);
    }
    for (int y = 0; y < height; ++y) {
      const size_t i = static_cast<size_t>(y) * width + x;
      const double white = std::clamp(0.25 + 0.9 * clouds[i], 0.0, 1.0);
      Rgb colour = sky + (Rgb{250, 248, 240} - sky) * white;
      for (int k = 0; k < 3; ++k) {
        if (y > ridge[k]) colour = hills[k] * (1 + 0.7 * ground[i]);
      }
      image.at<cv::Vec3b>(y, x) = to_pixel(colour);
    }
  }
  return image;
}

cv::Mat paint_abstract(int width, int height, Random& random) {
  cv::Mat image(height, width, CV_8UC3, random_colour(random));
  for (int i = 0; i < 40; ++i) {
    const cv::Point centre(random.below(width), random.below(height));
    const int size = width / 24 + random.below(width / 6);
    const Rgb colour = random_colour(random);
    const int thickness = random.below(3) == 0 ? 2 + random.below(5) : cv::FILLED;
    if (random.below(2) == 0) {
      cv::circle(image, centre, size / 2, colour, thickness, cv::LINE_AA);
    } else {
      const cv::RotatedRect box(cv::Point2f(centre), cv::Size2f(cv::Size(size, size / 2 + 2)),
                                static_cast<float>(random.uniform(0, 180)));
      cv::Point2f corners[4];
      box.points(corners);
      std::vector<cv::Point> polygon(corners, corners + 4);
      cv::fillConvexPoly(image, polygon, colour, cv::LINE_AA);
    }
  }
  add_wear(image, 14, 6, random);
  return image;
}

cv::Mat paint_cardboard(bool printed, Random& random) {
  cv::Mat image(384, 512, CV_8UC3, Rgb{176, 132, 88});
  for (int x = 0; x < 512; x += 6) cv::line(image, {x, 0}, {x, 383}, {170, 126, 82}, 1);
  cv::rectangle(image, {0, 168}, {511, 216}, {196, 160, 112}, cv::FILLED);
  cv::line(image, {0, 192}, {511, 192}, {92, 66, 44}, 2);
  if (printed) {
    write_line(image, {36, 30, 200, 60}, random.below(2) == 0 ? "FRAGILE" : "THIS SIDE UP",
               {132, 36, 28}, 4);
    write_line(image, {300, 40, 180, 40}, random_words(2, random), kInk, 3);
    draw_barcode(image, {310, 250, 160, 90}, random);
    for (const int x : {60, 130}) {
      cv::arrowedLine(image, {x, 350}, {x, 240}, kInk, 10, cv::LINE_AA, 0, 0.35);
    }
    write_words(image, {180, 240, 120, 100}, {9, 2.0, kInk}, random);
  }
  cv::rectangle(image, {0, 0}, {511, 383}, {126, 92, 60}, 5);
  add_wear(image, 12, 8, random);
  return image;
}

cv::Mat paint_whiteboard(int width, int height, Random& random) {
  cv::Mat image(height, width, CV_8UC3, Rgb{236, 238, 238});
  const Rgb inks[] = {{30, 60, 150}, {170, 36, 40}, {24, 110, 60}, {40, 40, 44}};
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) {
      const cv::Point centre(width * (2 * column + 1) / 10 + random.below(width / 20),
                             height * (2 * row + 1) / 8 + random.below(height / 12));
      draw_scribble(image, centre, width / 14 + random.below(width / 20), inks[random.below(4)],
                    random);
    }
  }
  for (int i = 0; i < 5; ++i) {
    cv::putText(image, std::string("x").append(std::to_string(i)).append(" = K [R t] X"),
                {width / 20 + random.below(width * 3 / 5), height * (i + 1) / 6},
                cv::FONT_HERSHEY_SCRIPT_SIMPLEX, width / 900.0, inks[random.below(4)], 2,
                cv::LINE_AA);
  }
  add_wear(image, 4, 2, random);
  return image;
}

cv::Mat paint_notes(Random& random) {
  cv::Mat image(512, 768, CV_8UC3, Rgb{178, 136, 92});
  add_wear(image, 16, 40, random);
  const Rgb papers[] = {
      {244, 226, 110}, {240, 150, 170}, {150, 214, 226}, {176, 224, 140}, {242, 242, 236}};
  for (int i = 0; i < 22; ++i) {
    const int side = 90 + random.below(60);
    const cv::Rect note(10 + random.below(768 - side - 20), 10 + random.below(512 - side - 20),
                        side, side + random.below(20) - 10);
    cv::rectangle(image, note + cv::Point(4, 5), {110, 82, 54}, cv::FILLED);
    cv::rectangle(image, note, papers[random.below(5)], cv::FILLED);
    write_words(image, {note.x + 8, note.y + 10, side - 16, side - 24}, {10, 1.8, {40, 44, 90}},
                random);
    cv::circle(image, {note.x + side / 2, note.y + 8}, 6, random_colour(random), cv::FILLED,
               cv::LINE_AA);
  }
  return image;
}

}  // namespace foresight::sim
