// How sure the depth of a mesh vertex is, from what it rests on.
#pragma once

#include "common/carving_delta.h"

namespace foresight {

/// 0…1. A direction is known to about 2 mrad (a pixel at a focal length of 500 px), so a point that
/// n observations see from directions θ apart has a relative depth error of about e = 2 mrad / (θ
/// √n). Confidence 1 / (1 + (e / 5 %)²): a half where 5 % are to be expected; none for a single
/// one.
float confidence_of(const VertexEvidence& evidence);

}  // namespace foresight
