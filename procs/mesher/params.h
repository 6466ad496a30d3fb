#pragma once

#include <string>

#include "common/params.h"
#include "procs/mesher/mesher.h"

namespace foresight {

constexpr auto names_of(Energy) {
  return std::array{EnumName{Energy::kVisibility, "visibility"},
                    EnumName{Energy::kVolume, "volume"}};
}
constexpr auto names_of(LambdaUnit) {
  return std::array{EnumName{LambdaUnit::kRelative, "relative"},
                    EnumName{LambdaUnit::kMapUnit, "map_unit"}};
}

struct MesherParams {
  Energy energy = Energy::kVisibility;
  VisibilityWeights visibility;
  double lambda = MesherOptions{}.lambda;
  LambdaUnit lambda_unit = LambdaUnit::kRelative;
  int min_constraints = 1;
  int smoothing_passes = 0;
  double rate_hz = 1.0;
  std::string export_ply;

  MesherOptions options() const {
    MesherOptions o;
    o.energy = energy;
    o.visibility = visibility;
    o.lambda = lambda;
    o.lambda_unit = lambda_unit;
    o.min_constraints = min_constraints;
    o.smoothing_passes = smoothing_passes;
    return o;
  }

  template <class V>
  void visit(V& v) {
    v("energy", energy,
      {.doc = "what the surface minimises: contradiction to the constraints, or eq. (1) of the "
              "paper"});
    v("surface_weight", visibility.surface,
      {.unit = "constraints",
       .min = 0,
       .max = kMaxVisibilityWeight,
       .doc =
           "visibility: what the surface behind a point weighs, per constraint that ends at it"});
    v("shape_weight", visibility.shape,
      {.unit = "constraints",
       .min = 0,
       .max = kMaxVisibilityWeight,
       .doc = "visibility: what a facet weighs that bridges a gap; larger is smoother"});
    v("pocket_weight", visibility.pocket,
      {.unit = "constraints",
       .min = 0,
       .max = kMaxVisibilityWeight,
       .doc = "visibility: opens cells between crossed ones that no constraint happened to cross"});
    v("lambda", lambda,
      {.unit = "see lambda_unit",
       .min = 0,
       .max = 1e3,
       .doc = "volume: weight of the surface's area in eq. (1); larger is smoother (the paper: "
              "0.75 mu)"});
    v("lambda_unit", lambda_unit,
      {.doc = "of lambda: shares of the scene's size (the same at every map scale), or map units"});
    v("min_constraints", min_constraints,
      {.unit = "1",
       .min = 1,
       .max = 100,
       .doc = "volume: a cell counts as carved with at least so many constraints"});
    v("smoothing_passes", smoothing_passes,
      {.unit = "1",
       .min = 0,
       .max = 50,
       .doc =
           "evens the mesh out where no constraint passes; 0: vertices stay at the map's points"});
    v("rate_hz", rate_hz,
      {.unit = "Hz", .min = 0.05, .max = 30, .doc = "meshes per second at most (the paper: 1)"});
    v("export_ply", export_ply,
      {.doc = "file that always holds the newest mesh, as PLY in map units; empty: none"});
  }
};

}  // namespace foresight
