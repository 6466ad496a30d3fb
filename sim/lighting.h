// Bakes the light of the scene's lamps into the light maps: soft shadows by rays to points spread
// over each lamp, and ambient light that corners and the undersides of things receive less of.
#pragma once

#include "sim/scene.h"

namespace foresight::sim {

struct LightingParams {
  float ambient = 0.24f;         // brightness of an open, white, upward-facing surface
  float ambient_reach_m = 0.6f;  // what is nearer than this takes ambient light away
  float gamma = 2.2f;            // picture level = light^(1/gamma)
};

/// Replaces every surface's light map (also of what glows: it may be put out later). Rays: 16 per
/// lamp and 16 for ambient light per sample.
void bake_lighting(Scene& scene, const LightingParams& params = {});

/// Turns the light's normals to the side that gets more light, for triangles whose order of corners
/// cannot be trusted.
void turn_to_light(Scene& scene, const LightingParams& params = {});

}  // namespace foresight::sim
