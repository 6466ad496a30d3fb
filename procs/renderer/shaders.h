// GLSL sources of the renderer. docs/algorithms/rendering.md derives them step by step.
#pragma once

#include <compare>
#include <string>

namespace foresight {

constexpr int kMaxUsedViews = 8;  // size of the views block in the paint shader

/// Lens of the texturing images.
enum class ShaderLens { kPinhole, kRadtan, kEquidistant };

/// What is fixed when a paint shader is compiled.
struct PaintShader {
  ShaderLens lens = ShaderLens::kPinhole;
  bool has_mesh = false;
  bool one_view = false;
  auto operator<=>(const PaintShader&) const = default;
};

std::string surface_vertex_shader();
/// Out: (1/z, ∂(1/z)/∂x, ∂(1/z)/∂y, guess) with (x, y, 1) the pixel's ray; 1/z alone in a
/// one-channel target.
std::string surface_fragment_shader();
std::string full_screen_vertex_shader();
/// With `one_view`: paints what this view sees well and discards the rest. Else: searches all
/// views, and shades what none sees.
std::string paint_fragment_shader(const PaintShader& variant);
std::string quad_vertex_shader();
std::string quad_fragment_shader();

}  // namespace foresight
