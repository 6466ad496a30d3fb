// Where a scene from a file should stand: which axis is up, where its floor is, where an arm fits,
// and the lamps that it lacks. Everything here is in the scene's own coordinates, z up, metres,
// unless it says otherwise.
#pragma once

#include <vector>

#include "sim/loaded_mesh.h"

namespace foresight::sim {

/// Whether the larger floor lies across y rather than z.
bool y_is_up(const std::vector<LoadedMesh>& meshes);

/// Height of the largest level area in the lower half.
float floor_height_m(const std::vector<LoadedMesh>& meshes);

/// A pose over the floor, at the arm's shoulder, with free space around it, turned so that a camera
/// in the hand sees much texture 0.5 to 3.5 m away. For a thing without a floor around it: before
/// its middle. The scene need not be baked; about 1 s.
Frame find_arm_spot(const Scene& scene, float floor_m, float floor_to_shoulder_m);

/// A lamp under the ceiling, or above a scene that has none, and a backdrop around it all. The
/// scene is in world coordinates (kFloor_m).
void add_lamp_and_backdrop(Scene& scene);

}  // namespace foresight::sim
