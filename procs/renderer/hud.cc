#include "procs/renderer/hud.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "procs/renderer/gl_objects.h"
#include "procs/renderer/shaders.h"

namespace foresight {
namespace {

constexpr int kMargin_px = 8;
constexpr int kLineHeight_px = 18;
constexpr double kFontScale = 0.45;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

struct BadgeStyle {
  const char* text;
  cv::Scalar colour;  // RGBA
};

BadgeStyle style_of(Badge badge) {
  switch (badge) {
    case Badge::kOk:
      return {"OK", {40, 150, 70, 255}};
    case Badge::kStale:
      return {"STALE", {200, 130, 20, 255}};
    case Badge::kLost:
      return {"LOST", {200, 45, 45, 255}};
    case Badge::kNoModel:
      return {"NO MODEL", {85, 95, 150, 255}};
  }
  return {"?", {128, 128, 128, 255}};
}

int text_width(const std::string& text) {
  return cv::getTextSize(text, kFont, kFontScale, 1, nullptr).width;
}

void put_line(cv::Mat* panel, const std::string& text, int x, int row) {
  const cv::Point origin(x, kMargin_px + row * kLineHeight_px + 12);
  cv::putText(*panel, text, origin, kFont, kFontScale, {255, 255, 255, 255}, 1, cv::LINE_AA);
}

/// RGBA picture of a panel: a see-through dark box, the badge, the title beside it, lines below.
cv::Mat draw_text(const Panel& panel) {
  const BadgeStyle style = style_of(panel.badge);
  const int badge_width = text_width(style.text) + 12;
  int width = badge_width + 8 + text_width(panel.title);
  for (const std::string& line : panel.lines) width = std::max(width, text_width(line));
  const int rows = 1 + static_cast<int>(panel.lines.size());
  cv::Mat picture(rows * kLineHeight_px + 2 * kMargin_px - 2, width + 2 * kMargin_px, CV_8UC4,
                  cv::Scalar(12, 14, 20, 165));
  cv::rectangle(picture, cv::Rect(kMargin_px - 2, kMargin_px - 2, badge_width, kLineHeight_px),
                style.colour, cv::FILLED);
  put_line(&picture, style.text, kMargin_px + 4, 0);
  put_line(&picture, panel.title, kMargin_px + badge_width + 6, 0);
  for (int row = 1; row < rows; ++row) put_line(&picture, panel.lines[row - 1], kMargin_px, row);
  return picture;
}

/// Bounds what a caller may ask for, and keeps only what the font can draw.
Panel bounded(Panel panel) {
  constexpr size_t kMaxLines = 40, kMaxLength = 120;
  if (panel.lines.size() > kMaxLines) panel.lines.resize(kMaxLines);
  const auto clean = [](std::string* text) {
    if (text->size() > kMaxLength) text->resize(kMaxLength);
    std::replace_if(
        text->begin(), text->end(), [](char c) { return c < 32 || c > 126; }, '?');
  };
  clean(&panel.title);
  for (std::string& line : panel.lines) clean(&line);
  return panel;
}

std::optional<Rectangle> fit(int x, int width, int height, double aspect) {
  if (width <= 0 || height <= 0 || !(aspect > 0)) return std::nullopt;
  const int w = std::min(width, static_cast<int>(std::min(height * aspect, 1e6) + 0.5));
  const int h = std::min(height, static_cast<int>(w / aspect + 0.5));
  if (w < 1 || h < 1) return std::nullopt;
  return Rectangle{x + (width - w) / 2, (height - h) / 2, w, h};
}

// The lower right corner, a third of the width.
std::optional<Rectangle> corner_of(const Rectangle& whole) {
  const int w = whole.width_px / 3, h = whole.height_px / 3;
  if (w < 1 || h < 1) return std::nullopt;
  return Rectangle{whole.x_px + whole.width_px - w, whole.y_px + whole.height_px - h, w, h};
}

}  // namespace

Places place_pictures(Layout layout, int window_width_px, int window_height_px, double aspect) {
  const int half = window_width_px / 2;
  switch (layout) {
    case Layout::kDelayed:
      return {fit(0, window_width_px, window_height_px, aspect), {}, {}};
    case Layout::kPredicted:
      return {{}, fit(0, window_width_px, window_height_px, aspect), {}};
    case Layout::kUndelayed:
      return {{}, {}, fit(0, window_width_px, window_height_px, aspect)};
    case Layout::kInset: {
      const auto whole = fit(0, window_width_px, window_height_px, aspect);
      return {whole ? corner_of(*whole) : whole, whole, {}};
    }
    case Layout::kSideBySide:
      return {fit(0, half, window_height_px, aspect),
              fit(half, window_width_px - half, window_height_px, aspect),
              {}};
  }
  return {};
}

/// A panel's texture, kept as long as its text stays the same.
struct Hud::State {
  struct Text {
    Panel panel;
    GlTexture texture;
    int width_px = 0, height_px = 0;
  };
  static constexpr size_t kKeptPanels = 4;

  GlProgram program = make_program("quad", quad_vertex_shader(), quad_fragment_shader());
  GLint opaque_at = glGetUniformLocation(program.name(), "opaque");
  GlVertexArray no_vertices = make_vertex_array();
  std::vector<Text> texts;  // most recently used last

  const Text& text_of(const Panel& panel);
  void draw_quad(unsigned texture, const Rectangle& place, int window_height_px, bool opaque);
};

const Hud::State::Text& Hud::State::text_of(const Panel& panel) {
  const auto found = std::find_if(texts.begin(), texts.end(), [&panel](const Text& text) {
    return text.panel.badge == panel.badge && text.panel.title == panel.title &&
           text.panel.lines == panel.lines;
  });
  if (found != texts.end()) {
    std::rotate(found, found + 1, texts.end());
    return texts.back();
  }
  if (texts.size() >= kKeptPanels) texts.erase(texts.begin());
  const cv::Mat picture = draw_text(panel);
  Text text{panel, make_texture(GL_RGBA8, picture.cols, picture.rows, GL_LINEAR), picture.cols,
            picture.rows};
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, picture.cols, picture.rows, GL_RGBA, GL_UNSIGNED_BYTE,
                  picture.data);
  texts.push_back(std::move(text));
  return texts.back();
}

void Hud::State::draw_quad(unsigned texture, const Rectangle& place, int window_height_px,
                           bool opaque) {
  glViewport(place.x_px, window_height_px - place.y_px - place.height_px, place.width_px,
             place.height_px);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  if (opaque) {
    glDisable(GL_BLEND);
  } else {
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  }
  glUseProgram(program.name());
  glUniform1i(opaque_at, opaque ? 1 : 0);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, texture);
  glBindVertexArray(no_vertices.name());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glBindVertexArray(0);
  glDisable(GL_BLEND);
}

Hud::Hud() : state_(std::make_unique<State>()) {}
Hud::~Hud() = default;

void Hud::clear() {
  glClearColor(0.04f, 0.045f, 0.06f, 1);
  glClear(GL_COLOR_BUFFER_BIT);
}

void Hud::draw_texture(unsigned texture, const Rectangle& place, int window_height_px) {
  if (texture == 0) return;  // nothing drawn yet
  state_->draw_quad(texture, place, window_height_px, true);
}

void Hud::draw_panel(const Panel& panel, const Rectangle& place, int window_height_px) {
  const State::Text& text = state_->text_of(bounded(panel));
  const Rectangle box{place.x_px + kMargin_px, place.y_px + kMargin_px, text.width_px,
                      text.height_px};
  state_->draw_quad(text.texture.name(), box, window_height_px, false);
}

}  // namespace foresight
