#include "procs/slam/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cmath>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector3d;

constexpr int kMaxIterations = 20;
constexpr double kConverged = 1e-6;  // largest component of a step

Vector7d step_of(const Similarity<Cam, Cam>& s) {
  const Eigen::AngleAxisd turn(s.rotation());
  Vector7d step;
  step << s.translation(), turn.angle() * turn.axis(), std::log(s.scale());
  return step;
}

// A step before `s` has the effect of adjoint(s) · step after it.
Matrix7d adjoint(const Similarity<Cam, Cam>& s) {
  const Eigen::Matrix3d rotation = s.rotation().toRotationMatrix();
  Matrix7d m = Matrix7d::Zero();
  m.block<3, 3>(0, 0) = s.scale() * rotation;
  m.block<3, 3>(0, 3) = skew(s.translation()) * rotation;
  m.block<3, 1>(0, 6) = -s.translation();
  m.block<3, 3>(3, 3) = rotation;
  m(6, 6) = 1;
  return m;
}

struct EdgeError {
  Vector7d residual;  // whitened
  Similarity<Cam, Cam> error;
  Vector7d whitening;
};

EdgeError error_of(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const PoseGraphVertex& a = graph.vertices[edge.a];
  const PoseGraphVertex& b = graph.vertices[edge.b];
  EdgeError e;
  e.error = edge.b_from_a * a.cam_from_map * b.cam_from_map.inverse();
  const double weight = std::sqrt(edge.weight);
  e.whitening.setConstant(weight);
  e.whitening.head<3>().setConstant(weight / b.depth);
  e.residual = e.whitening.cwiseProduct(step_of(e.error));
  return e;
}

double cost_of(const PoseGraph& graph) {
  double cost = 0;
  for (const PoseGraphEdge& edge : graph.edges)
    cost += error_of(graph, edge).residual.squaredNorm();
  return cost;
}

class NormalEquations {
 public:
  explicit NormalEquations(const PoseGraph& graph) {
    for (const PoseGraphVertex& v : graph.vertices) {
      first_.push_back(v.fixed ? -1 : size_);
      if (!v.fixed) size_ += 7;
    }
    gradient_ = Eigen::VectorXd::Zero(size_);
  }

  void add(const PoseGraph& graph, const PoseGraphEdge& edge) {
    const EdgeError e = error_of(graph, edge);
    const Matrix7d by_a = e.whitening.asDiagonal() * adjoint(edge.b_from_a);
    const Matrix7d by_b = -(e.whitening.asDiagonal() * adjoint(e.error));
    const int a = first_[edge.a], b = first_[edge.b];
    add_block(a, a, by_a.transpose() * by_a);
    add_block(b, b, by_b.transpose() * by_b);
    add_block(a, b, by_a.transpose() * by_b);
    add_block(b, a, by_b.transpose() * by_a);
    if (a >= 0) gradient_.segment<7>(a) += by_a.transpose() * e.residual;
    if (b >= 0) gradient_.segment<7>(b) += by_b.transpose() * e.residual;
  }

  /// False if the equations have no unique solution.
  bool solve(Eigen::VectorXd* step) {
    if (size_ == 0) return false;
    Eigen::SparseMatrix<double> matrix(size_, size_);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    if (solver.info() != Eigen::Success) return false;
    *step = solver.solve(-gradient_);
    return step->allFinite();
  }

  int first_of(VertexId vertex) const { return first_[vertex]; }

 private:
  void add_block(int row, int column, const Matrix7d& block) {
    if (row < 0 || column < 0) return;
    for (int r = 0; r < 7; ++r) {
      for (int c = 0; c < 7; ++c) entries_.emplace_back(row + r, column + c, block(r, c));
    }
  }

  int size_ = 0;
  IdVector<VertexId, int> first_;  // unknown of each vertex; −1: fixed
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd gradient_;
};

}  // namespace

PoseGraphReport optimize_pose_graph(PoseGraph* graph) {
  PoseGraphReport report;
  const IdVector<VertexId, PoseGraphVertex> before = graph->vertices;
  report.initial_cost = report.final_cost = cost_of(*graph);
  for (; report.iterations < kMaxIterations; ++report.iterations) {
    NormalEquations equations(*graph);
    for (const PoseGraphEdge& edge : graph->edges) equations.add(*graph, edge);
    Eigen::VectorXd step;
    if (!equations.solve(&step)) break;
    const IdVector<VertexId, PoseGraphVertex> last = graph->vertices;
    for (const VertexId i : graph->vertices.ids()) {
      const int first = equations.first_of(i);
      if (first < 0) continue;
      PoseGraphVertex& v = graph->vertices[i];
      v.cam_from_map = small_similarity<Cam>(step.segment<7>(first)) * v.cam_from_map;
    }
    const double cost = cost_of(*graph);
    if (!(cost <= report.final_cost)) {  // past the minimum, or not a number
      graph->vertices = last;
      break;
    }
    report.final_cost = cost;
    report.usable = true;
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }
  if (!report.usable) graph->vertices = before;
  return report;
}

}  // namespace foresight::slam
