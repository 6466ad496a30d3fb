#include "procs/slam/patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core/hal/intrin.hpp>
#include <vector>

namespace foresight::slam {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinEnergy = kPatchArea * 16.0;  // standard deviation of 4 gray levels
constexpr double kHalf = (kPatchSize - 1) / 2.0;  // centre relative to the first pixel

struct Sums {
  int sum = 0, squares = 0, product = 0;
};

Sums patch_sums(const uint8_t* top_left, size_t stride, const int16_t* patch) {
  const cv::v_int16x8 ones = cv::v_setall_s16(1);
  cv::v_int32x4 sum = cv::v_setzero_s32(), squares = sum, product = sum;
  for (int row = 0; row < kPatchSize; ++row) {
    const cv::v_int16x8 pixels =
        cv::v_reinterpret_as_s16(cv::v_load_expand(top_left + static_cast<size_t>(row) * stride));
    sum = sum + cv::v_dotprod(pixels, ones);
    squares = squares + cv::v_dotprod(pixels, pixels);
    product = product + cv::v_dotprod(pixels, cv::v_load(patch + row * kPatchSize));
  }
  return {cv::v_reduce_sum(sum), cv::v_reduce_sum(squares), cv::v_reduce_sum(product)};
}

double zncc_at(const cv::Mat& image, int u, int v, const Patch& patch) {
  const Sums s = patch_sums(image.ptr<uint8_t>(v) + u, image.step[0], patch.pixels.data());
  const double energy = s.squares - static_cast<double>(s.sum) * s.sum / kPatchArea;
  if (energy < kMinEnergy) return -1;
  const double covariance = s.product - static_cast<double>(s.sum) * patch.sum / kPatchArea;
  return covariance / std::sqrt(energy * patch.energy);
}

double squared_distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& ab) {
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).squaredNorm();
}

struct Scored {
  int u, v;
  double zncc;
};

double second_best(const std::vector<Scored>& scores, const Scored& best) {
  double second = -1;
  for (const Scored& s : scores) {
    const int du = s.u - best.u, dv = s.v - best.v;
    if (du * du + dv * dv > 6) second = std::max(second, s.zncc);
  }
  return second;
}

// Samples 8×8 pixels at a sub-pixel position; all share the same four weights.
void sample_shifted(const cv::Mat& image, int u, int v, double fu, double fv, float* out) {
  const float w00 = static_cast<float>((1 - fu) * (1 - fv)),
              w01 = static_cast<float>(fu * (1 - fv));
  const float w10 = static_cast<float>((1 - fu) * fv), w11 = static_cast<float>(fu * fv);
  for (int row = 0; row < kPatchSize; ++row) {
    const uint8_t* p = image.ptr<uint8_t>(v + row) + u;
    const uint8_t* q = image.ptr<uint8_t>(v + row + 1) + u;
    for (int col = 0; col < kPatchSize; ++col) {
      out[row * kPatchSize + col] =
          w00 * static_cast<float>(p[col]) + w01 * static_cast<float>(p[col + 1]) +
          w10 * static_cast<float>(q[col]) + w11 * static_cast<float>(q[col + 1]);
    }
  }
}

struct Gradients {
  std::array<float, kPatchArea> dx, dy, value;
  Matrix3d inverse_hessian;
};

bool template_gradients(const Patch& patch, Gradients* g) {
  Matrix3d hessian = Matrix3d::Zero();
  for (int row = 0; row < kPatchSize; ++row) {
    for (int col = 0; col < kPatchSize; ++col) {
      const float* p = &patch.bordered[(row + 1) * Patch::kBordered + col + 1];
      const int i = row * kPatchSize + col;
      g->dx[i] = 0.5f * (p[1] - p[-1]);
      g->dy[i] = 0.5f * (p[Patch::kBordered] - p[-Patch::kBordered]);
      g->value[i] = p[0];
    }
  }
  double xx = 0, xy = 0, yy = 0, x = 0, y = 0;
  for (int i = 0; i < kPatchArea; ++i) {
    xx += g->dx[i] * g->dx[i];
    xy += g->dx[i] * g->dy[i];
    yy += g->dy[i] * g->dy[i];
    x += g->dx[i];
    y += g->dy[i];
  }
  hessian << xx, xy, x, xy, yy, y, x, y, kPatchArea;
  const double determinant = hessian.determinant();
  if (!(determinant > 1e-6 * xx * yy * kPatchArea) || xx < 1 || yy < 1) return false;
  g->inverse_hessian = hessian.inverse();
  return true;
}

double float_zncc(const float* pixels, const Patch& patch) {
  double sum = 0, squares = 0, product = 0;
  for (int i = 0; i < kPatchArea; ++i) {
    sum += pixels[i];
    squares += static_cast<double>(pixels[i]) * pixels[i];
    product += static_cast<double>(pixels[i]) * patch.pixels[i];
  }
  const double energy = squares - sum * sum / kPatchArea;
  if (energy < 0.5 * kMinEnergy) return -1;
  return (product - sum * patch.sum / kPatchArea) / std::sqrt(energy * patch.energy);
}

}  // namespace

bool warp_patch(const cv::Mat& source, const Vector2d& center, const Matrix2d& source_from_patch,
                Patch* patch) {
  constexpr int kN = Patch::kBordered;
  constexpr double kReach = (kN - 1) / 2.0;
  const Vector2d reach = kReach * source_from_patch.cwiseAbs().rowwise().sum();
  const Vector2d low = center - reach, high = center + reach;
  if (!(low.minCoeff() >= 0) || !(high.x() < source.cols - 1) || !(high.y() < source.rows - 1)) {
    return false;
  }
  const Eigen::Vector2f step_x = source_from_patch.col(0).cast<float>();
  const Eigen::Vector2f step_y = source_from_patch.col(1).cast<float>();
  const Eigen::Vector2f start =
      (center - kReach * (source_from_patch.col(0) + source_from_patch.col(1))).cast<float>();
  for (int row = 0; row < kN; ++row) {
    Eigen::Vector2f p = start + static_cast<float>(row) * step_y;
    for (int col = 0; col < kN; ++col, p += step_x) {
      const int u = static_cast<int>(p.x()), v = static_cast<int>(p.y());
      const float fu = p.x() - static_cast<float>(u), fv = p.y() - static_cast<float>(v);
      const uint8_t* a = source.ptr<uint8_t>(v) + u;
      const uint8_t* b = source.ptr<uint8_t>(std::min(v + 1, source.rows - 1)) + u;
      const float top = a[0] + fu * static_cast<float>(a[1] - a[0]);
      const float bottom = b[0] + fu * static_cast<float>(b[1] - b[0]);
      patch->bordered[row * kN + col] = top + fv * (bottom - top);
    }
  }
  int sum = 0, squares = 0;
  for (int row = 0; row < kPatchSize; ++row) {
    for (int col = 0; col < kPatchSize; ++col) {
      const int value = static_cast<int>(patch->bordered[(row + 1) * kN + col + 1] + 0.5f);
      patch->pixels[row * kPatchSize + col] = static_cast<int16_t>(value);
      sum += value;
      squares += value * value;
    }
  }
  patch->sum = sum;
  patch->energy = squares - static_cast<double>(sum) * sum / kPatchArea;
  return patch->energy >= kMinEnergy;
}

PatchMatch search_patch(const cv::Mat& image, const Patch& patch, const Vector2d& a,
                        const Vector2d& b, double margin_px, Ambiguity ambiguity) {
  const Vector2d low = a.cwiseMin(b).array() - margin_px - kHalf;
  const Vector2d high = a.cwiseMax(b).array() + margin_px - kHalf;
  const int u0 = std::max(0, static_cast<int>(std::ceil(std::max(low.x(), -1.0))));
  const int v0 = std::max(0, static_cast<int>(std::ceil(std::max(low.y(), -1.0))));
  const int u1 = static_cast<int>(
      std::floor(std::min(high.x(), static_cast<double>(image.cols - kPatchSize))));
  const int v1 = static_cast<int>(
      std::floor(std::min(high.y(), static_cast<double>(image.rows - kPatchSize))));
  const Vector2d ab = b - a;
  const double margin2 = margin_px * margin_px;
  Scored best{0, 0, -1};
  std::vector<Scored> scores;
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      if (squared_distance_to_segment({u + kHalf, v + kHalf}, a, ab) > margin2) continue;
      const Scored here{u, v, zncc_at(image, u, v, patch)};
      if (ambiguity == Ambiguity::kMeasure && here.zncc > 0.5) scores.push_back(here);
      if (here.zncc > best.zncc) best = here;
    }
  }
  PatchMatch match;
  match.center = {best.u + kHalf, best.v + kHalf};
  match.zncc = best.zncc;
  match.second_zncc = second_best(scores, best);
  return match;
}

std::optional<PatchMatch> align_patch(const cv::Mat& image, const Patch& patch,
                                      const Vector2d& start) {
  Gradients g;
  if (!template_gradients(patch, &g)) return std::nullopt;
  Vector2d center = start;
  double offset = 0;
  std::array<float, kPatchArea> pixels;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const Vector2d corner = center.array() - kHalf;
    const int u = static_cast<int>(std::floor(corner.x()));
    const int v = static_cast<int>(std::floor(corner.y()));
    if (u < 0 || v < 0 || u + kPatchSize >= image.cols || v + kPatchSize >= image.rows) {
      return std::nullopt;
    }
    sample_shifted(image, u, v, corner.x() - u, corner.y() - v, pixels.data());
    float bx = 0, by = 0, b1 = 0;
    for (int i = 0; i < kPatchArea; ++i) {
      const float residual = pixels[i] - g.value[i] + static_cast<float>(offset);
      bx += residual * g.dx[i];
      by += residual * g.dy[i];
      b1 += residual;
    }
    const Vector3d update = g.inverse_hessian * Vector3d(bx, by, b1);
    center -= update.head<2>();
    offset -= update.z();
    if ((center - start).squaredNorm() > 4) return std::nullopt;
    if (update.head<2>().squaredNorm() < 0.02 * 0.02) {
      return PatchMatch{center, float_zncc(pixels.data(), patch), -1};
    }
  }
  return std::nullopt;
}

}  // namespace foresight::slam
