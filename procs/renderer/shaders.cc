#include "procs/renderer/shaders.h"

namespace foresight {
namespace {

constexpr const char* kVersion = "#version 330 core\n";

constexpr const char* kDistort = R"(
#if LENS == 0
vec2 distort(vec2 p, vec4 k, float k3) { return p; }
#elif LENS == 1
vec2 distort(vec2 p, vec4 k, float k3) {  // k1 k2 p1 p2, k3
  float r2 = dot(p, p);
  float radial = 1.0 + r2 * (k.x + r2 * (k.y + r2 * k3));
  float xy = 2.0 * p.x * p.y;
  return p * radial + vec2(k.z * xy + k.w * (r2 + 2.0 * p.x * p.x),
                           k.z * (r2 + 2.0 * p.y * p.y) + k.w * xy);
}
#else
vec2 distort(vec2 p, vec4 k, float k3) {  // k1 k2 k3 k4
  float r = length(p);
  float theta = atan(r);
  float t2 = theta * theta;
  float bent = theta * (1.0 + t2 * (k.x + t2 * (k.y + t2 * (k.z + t2 * k.w))));
  return r < 1e-6 ? p : p * (bent / r);
}
#endif
)";

constexpr const char* kPaintInputs = R"(
struct View {
  mat4 view_from_pred;   // predicted camera to texturing camera
  vec4 centre_in_pred;   // of the texturing camera; w: least gap in 1/z that can hide a pixel
  vec4 image_matrix;     // fx fy cx cy of the image
  vec4 depth_matrix;     // fx fy cx cy of its depth map
  vec4 distortion;
  vec4 k3_radius_layer;  // k3, greatest radius squared, texture layer, rank
  vec4 sizes;            // of the image, of the depth map
  vec4 padding[6];       // to 256 bytes, so that one view can be bound alone
};
#if ONE_VIEW
layout(std140) uniform Views { View view; };  // a fixed place: much cheaper than views[i]
#else
layout(std140) uniform Views { View views[MAX_VIEWS]; };
#endif
uniform int view_count;
uniform vec4 pred_matrix;       // fx fy cx cy of the picture
uniform sampler2D surface;      // (1/z, its slopes, guess)
uniform sampler2DArray images;
uniform sampler2DArray depths;  // 1/z
uniform bool paint_hull;
uniform bool paint_background;
out vec4 colour;

struct Fragment {
  vec3 ray;         // (x, y, 1) in the predicted camera
  float inverse_z;  // 0: no surface
  vec3 plane;       // of the surface: plane . point = 1
};
struct Choice {
  float quality;
  float rank;  // -1: none
  vec3 texel;  // where to sample, and the layer
};
)";

/// Which of the four depth texels around a point hide it. Returns how far the point is from being
/// hidden (the weight of free texels, 0 to 1), and where to go to get clear of what is in front.
constexpr const char* kFreeWeight = R"(
float free_weight(View view, vec2 xy, vec3 plane_in_view, float inverse_z, out vec2 away) {
  vec2 size = view.sizes.zw;
  vec2 at = xy * view.depth_matrix.xy + view.depth_matrix.zw;  // texel centres are whole
  vec2 base = clamp(floor(at), vec2(0.0), size - 2.0);
  vec2 part = clamp(at - base, 0.0, 1.0);
  vec4 front = textureGather(depths, vec3((base + 1.0) / size, view.k3_radius_layer.z));

  vec2 slope = plane_in_view.xy / view.depth_matrix.xy;  // of 1/z, per texel
  vec3 base_ray = vec3((base - view.depth_matrix.zw) / view.depth_matrix.xy, 1.0);
  vec4 expected = dot(plane_in_view, base_ray) +
                  vec4(slope.y, slope.x + slope.y, slope.x, 0.0);  // order of textureGather
  float bias = max(RELATIVE_BIAS * inverse_z + SLOPE_BIAS * (abs(slope.x) + abs(slope.y)),
                   view.centre_in_pred.w);
  vec4 open = vec4(lessThanEqual(front, expected + bias));
  vec4 weight = vec4((1.0 - part.x) * part.y, part.x * part.y, part.x * (1.0 - part.y),
                     (1.0 - part.x) * (1.0 - part.y));
  float count = dot(open, vec4(1.0));
  vec2 middle = vec2(open.y + open.z, open.x + open.y) / max(count, 1.0);
  away = count < 3.5 ? CLEARANCE * (middle - part) / view.depth_matrix.xy : vec2(0.0);
  return count > 3.5 ? 1.0 : 0.99 * dot(open, weight);
}
)";

constexpr const char* kConsider = R"(
void consider(View view, Fragment f, inout Choice choice) {
  mat3 turn = mat3(view.view_from_pred);
  vec3 m = turn * f.ray + view.view_from_pred[3].xyz * f.inverse_z;  // point / its z
  float facing = 1.0 - dot(f.plane, view.centre_in_pred.xyz);         // < 0: sees the back
  float near = dot(f.ray, f.ray) / dot(m, m);
  float quality = facing * near * sqrt(near);
  vec2 xy = m.xy / m.z;
  vec2 size = view.sizes.xy;
  vec2 uv = distort(xy, view.distortion, view.k3_radius_layer.x) * view.image_matrix.xy +
            view.image_matrix.zw + 0.5;
  bool inside = m.z > 1e-6 && dot(xy, xy) < view.k3_radius_layer.y &&
                all(greaterThanEqual(uv, vec2(0.0))) && all(lessThanEqual(uv, size));
#if HAS_MESH
  vec2 away;
  float open = free_weight(view, xy, turn * f.plane / facing, f.inverse_z / m.z, away);
  uv += away * view.image_matrix.xy;
  if (open < 1.0) quality = min(quality, 1.0) * EDGE_QUALITY;
  inside = inside && open >= LEAST_OPEN;
#endif
  if (inside && quality > choice.quality) {
    choice = Choice(quality, view.k3_radius_layer.w, vec3(uv / size, view.k3_radius_layer.z));
  }
}
)";

constexpr const char* kPaintMain = R"(
vec3 unknown_shade(Fragment f) {
  if (f.inverse_z <= 0.0) return vec3(0.07, 0.075, 0.10);
  float steepness = f.inverse_z / max(length(f.plane) * length(f.ray), 1e-30);
  return vec3(0.23, 0.26, 0.37) * (0.55 + 0.45 * steepness);
}

void main() {
  vec3 ray = vec3((gl_FragCoord.xy - 0.5 - pred_matrix.zw) / pred_matrix.xy, 1.0);
#if HAS_MESH
  vec4 hit = texelFetch(surface, ivec2(gl_FragCoord.xy), 0);
#else
  vec4 hit = vec4(0.0);
#endif
  Fragment f = Fragment(ray, hit.x, vec3(hit.yz, hit.x - dot(hit.yz, ray.xy)));
  bool background = hit.x <= 0.0;
  bool guess = background || hit.w > 0.0;
  bool paint = background ? paint_background : (paint_hull || !guess);
  Choice choice = Choice(0.0, -1.0, vec3(0.0));
#if ONE_VIEW
  consider(view, f, choice);
  if (!paint || choice.quality < GOOD_QUALITY) discard;
#else
  int count = paint ? view_count : 0;
  for (int i = 0; i < count && choice.quality < GOOD_QUALITY; ++i) {
    consider(views[i], f, choice);
  }
  if (choice.rank < 0.0) {
    colour = vec4(unknown_shade(f), 0.0);
    return;
  }
#endif
  float code = choice.rank + 1.0 + (guess ? 128.0 : 0.0);
  colour = vec4(textureLod(images, choice.texel, 0.0).rgb, code / 255.0);
}
)";

/// Tuning of the paint shader; the page on rendering says why.
constexpr const char* kPaintConstants = R"(
#define RELATIVE_BIAS 0.01
#define SLOPE_BIAS 0.5
#define CLEARANCE 1.5
#define LEAST_OPEN 0.25
#define EDGE_QUALITY 0.15
#define GOOD_QUALITY 0.2
)";

}  // namespace

std::string surface_vertex_shader() {
  return std::string(kVersion) + R"(
layout(location = 0) in vec4 vertex;  // point in map, confidence
uniform mat4 clip_from_map;
out float confidence;
void main() {
  confidence = vertex.w;
  gl_Position = clip_from_map * vec4(vertex.xyz, 1.0);
}
)";
}

std::string surface_fragment_shader() {
  return std::string(kVersion) + R"(
in float confidence;
uniform vec2 focal_px;
uniform float least_confidence;
out vec4 hit;
void main() {
  float inverse_z = gl_FragCoord.w;
  hit = vec4(inverse_z, dFdx(inverse_z) * focal_px.x, dFdy(inverse_z) * focal_px.y,
             confidence < least_confidence ? 1.0 : 0.0);
}
)";
}

std::string full_screen_vertex_shader() {
  return std::string(kVersion) + R"(
void main() {  // one triangle that covers the target
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}
)";
}

std::string paint_fragment_shader(const PaintShader& variant) {
  const auto define = [](const char* name, int value) {
    return std::string("#define ") + name + " " + std::to_string(value) + "\n";
  };
  return std::string(kVersion) + "#extension GL_ARB_texture_gather : require\n" +
         define("LENS", static_cast<int>(variant.lens)) + define("MAX_VIEWS", kMaxUsedViews) +
         define("HAS_MESH", variant.has_mesh ? 1 : 0) +
         define("ONE_VIEW", variant.one_view ? 1 : 0) + kPaintConstants + kDistort + kPaintInputs +
         (variant.has_mesh ? kFreeWeight : "") + kConsider + kPaintMain;
}

std::string quad_vertex_shader() {
  return std::string(kVersion) + R"(
out vec2 at;
void main() {  // a strip of four corners that fills the viewport
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = vec2(corner.x, 1.0 - corner.y);  // first row on top
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
)";
}

std::string quad_fragment_shader() {
  return std::string(kVersion) + R"(
in vec2 at;
uniform sampler2D picture;
uniform bool opaque;
out vec4 colour;
void main() {
  vec4 texel = textureLod(picture, at, 0.0);
  colour = opaque ? vec4(texel.rgb, 1.0) : texel;
}
)";
}

}  // namespace foresight
