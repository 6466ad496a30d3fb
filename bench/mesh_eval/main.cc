// mesh-eval SEQUENCE_DIR…: how right is the mesh of a real image sequence? See mesh_evaluation.h.
// scripts/mesh_eval builds and runs it.
#include <cstdio>

#include "bench/mesh_eval/mesh_evaluation.h"
#include "bench/mesh_eval/mesh_pictures.h"
#include "bench/mesh_eval/reports.h"
#include "common/output_file.h"
#include "common/tool_main.h"
#include "procs/carver/process.h"
#include "procs/mesher/process.h"
#include "procs/renderer/scene_renderer.h"
#include "procs/slam/process.h"
#include "sim/swarm/swarm.h"

namespace foresight {
namespace {

struct Arguments {
  std::vector<std::string> folders, settings;
  std::string json, pictures;
  PlayRange play;
  int every = 1;
  double least_confidence = RenderOptions{}.least_confidence;
  bool mesh_alone = false;
};

void declare(CLI::App& app, Arguments& a) {
  app.add_option("sequence", a.folders, "folders with rgb.txt, depth.txt, camera.yaml")->required();
  app.add_option("--every", a.every, "score each Nth depth image")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--start", a.play.start, "first image")->check(CLI::NonNegativeNumber);
  app.add_option("--frames", a.play.frames, "number of images; -1: all")->capture_default_str();
  app.add_option("--set", a.settings, "process.key=value (repeatable), of slam, carver or mesher")
      ->allow_extra_args(false);
  app.add_option(
         "--least-confidence", a.least_confidence,
         "a triangle with a point that is less sure counts as guessed (the renderer draws the "
         "line within the triangle)")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--json", a.json, "write the table's rows to this file");
  app.add_option("--picture", a.pictures, "draw each sequence's mesh as JPEG into this folder");
  app.add_flag("--mesh-alone", a.mesh_alone,
               "leave the sequence's own images, which may not be ours to show, out of pictures");
}

MeshEvaluationOptions options_of(const Arguments& a) {
  check_settings(a.settings, {"slam", "carver", "mesher"});
  const MesherParams mesher = Swarm::params<MesherProcess>(a.settings);
  return {.slam = Swarm::params<SlamProcess>(a.settings).options,
          .mesh = {.carver = Swarm::params<CarverProcess>(a.settings).carver_options(),
                   .mesher = mesher.options(),
                   .period = seconds(1 / mesher.rate_hz)},
          .play = a.play,
          .every = a.every,
          .least_confidence = a.least_confidence};
}

MeshEvaluation evaluate_one(const Arguments& a, const std::string& folder,
                            const MeshEvaluationOptions& options, RunErrors* errors) {
  const Sequence sequence = load_sequence(folder);
  MeshEvaluation e = evaluate_mesh(sequence, options);
  if (!a.pictures.empty()) {
    errors->attempt([&] {
      write_mesh_picture(sequence, e,
                         a.mesh_alone ? PictureOf::kMeshAlone : PictureOf::kMeshAndImages,
                         a.pictures + "/" + e.sequence + ".jpg");
    });
  }
  for (const std::string& remark : e.remarks) {
    std::fprintf(stderr, "%s: %s\n", e.sequence.c_str(), remark.c_str());
  }
  if (!e.complaint.empty()) errors->add(e.complaint);
  e.mesh = {};
  return e;
}

int evaluate_all(const Arguments& a) {
  const MeshEvaluationOptions options = options_of(a);
  check_output("--json", a.json);
  check_output_folder("--picture", a.pictures);
  RunErrors errors;
  std::vector<MeshEvaluation> evaluations;
  for (const std::string& folder : a.folders) {
    errors.attempt([&] { evaluations.push_back(evaluate_one(a, folder, options, &errors)); });
  }
  std::fputs(table_of(evaluations).c_str(), stdout);
  if (!a.json.empty()) errors.attempt([&] { write_json(evaluations, a.json); });
  errors.report();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  using namespace foresight;
  Arguments arguments;
  CLI::App app(
      "Compares the mesh of real image sequences, as slam, carver and mesher make it, with their "
      "depth images",
      "mesh-eval");
  declare(app, arguments);
  return tool_main(app, argc, argv, [&] { return evaluate_all(arguments); });
}
