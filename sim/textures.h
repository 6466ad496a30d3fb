// Procedural textures: materials (wood, brick, plaster, …) and printed things (pages, posters,
// book spines, …). Each is an RGB image (CV_8UC3, red first) made from a random stream alone.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "sim/random.h"

namespace foresight::sim {

using Rgb = cv::Scalar;  // red, green, blue, 0 … 255

// Materials; they tile, except where noted.
struct WoodLook {
  Rgb light{201, 170, 122};
  Rgb dark{139, 101, 62};
  int planks = 1;  // boards side by side, along the image's x
};
cv::Mat paint_wood(int width, int height, const WoodLook& look, Random& random);
struct BrickLook {
  Rgb brick{158, 116, 98};
  Rgb mortar{142, 134, 125};
  int columns = 4;
  int rows = 10;
};
cv::Mat paint_brick(int width, int height, const BrickLook& look, Random& random);
/// Nearly plain paint: a poor texture on purpose.
cv::Mat paint_plaster(int size, const Rgb& colour, double contrast, Random& random);
/// Coloured flecks on a base, at several scales: linoleum, carpet, terrazzo.
cv::Mat paint_flecks(int size, const Rgb& colour, double contrast, int flecks, Random& random);
cv::Mat paint_ceiling(int size, Random& random);
cv::Mat paint_fabric(int size, const Rgb& colour, Random& random);
cv::Mat paint_leaf(const Rgb& colour, Random& random);  // stretched over a leaf

// Printed things; stretched over their surface.
cv::Mat paint_page(int width, int height, int columns, Random& random);
cv::Mat paint_letter_card(char letter, Random& random);
cv::Mat paint_poster(int width, int height, Random& random);
cv::Mat paint_landscape(int width, int height, Random& random);
cv::Mat paint_abstract(int width, int height, Random& random);
cv::Mat paint_book_spine(Random& random);
cv::Mat paint_book_cover(Random& random);
cv::Mat paint_page_edges(Random& random);
cv::Mat paint_checkerboard(int columns, int rows);
cv::Mat paint_screen(Random& random);
cv::Mat paint_keyboard(Random& random);
cv::Mat paint_can_label(Random& random);
cv::Mat paint_cardboard(bool printed, Random& random);
cv::Mat paint_whiteboard(int width, int height, Random& random);
cv::Mat paint_notes(Random& random);  // a pin board with coloured notes
cv::Mat paint_led();                  // a red lens from its top, dark while it does not shine
cv::Mat paint_led_panel(int number);  // its front without the LEDs

// Brushes the painters share.

/// Lines of random words from the field's vocabulary, until the rectangle is full.
struct TextStyle {
  double height_px = 14;  // of a line's capitals
  double spacing = 1.7;   // line pitch / height
  Rgb colour{30, 30, 34};
};
void write_words(cv::Mat& image, const cv::Rect& area, const TextStyle& style, Random& random);
/// One line of text, as wide as the rectangle allows, centred.
void write_line(cv::Mat& image, const cv::Rect& area, const std::string& text, const Rgb& colour,
                int thickness);
std::string random_words(int count, Random& random);
/// A strong colour from a palette that goes well together.
Rgb random_colour(Random& random);
/// Adds mono noise of the given amplitude in levels, at several scales, and fine grain.
void add_wear(cv::Mat& image, double amplitude, double grain, Random& random);

}  // namespace foresight::sim
