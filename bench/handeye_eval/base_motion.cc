#include "bench/handeye_eval/base_motion.h"

#include <cmath>
#include <random>

#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

using calibration::kDegree;
using calibration::rotation_from_vector;
using calibration::Vector6d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

class Noise {
 public:
  explicit Noise(unsigned seed) : generator_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<double>(0, 1)(generator_);
  }
  Vector3d gaussian(double sigma3) {
    const double x = normal_(generator_), y = normal_(generator_), z = normal_(generator_);
    return sigma3 / std::sqrt(3.0) * Vector3d(x, y, z);
  }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

// From 0 to 1 with continuous acceleration.
double smooth_step(double x) {
  x = std::min(1.0, std::max(0.0, x));
  return x * x * x * (10 + x * (6 * x - 15));
}

// From 0 at rest with slope 1, the corners rounded over `round_s`.
double ramp(double t_s, double begin_s, double end_s, double round_s) {
  const auto integral = [round_s](double x) {
    if (x <= 0) return 0.0;
    if (x >= round_s) return x - round_s / 2;
    return x * x / (2 * round_s);
  };
  return integral(t_s - begin_s) - integral(t_s - end_s);
}

double push(double t_s) {
  const double there = smooth_step((t_s - 3) / 0.7) - smooth_step((t_s - 10) / 0.9);
  const double since_s = t_s > 10.5 ? t_s - 10.5 : t_s - 3.5;
  if (since_s < 0) return there;
  return there + 0.05 * std::exp(-1.5 * since_s) * std::sin(2 * kPi * 1.2 * since_s) *
                     smooth_step(since_s / 0.3);
}

// Shift (m) and turn (rad) of the base; random walks are integrated by the caller.
Vector6d deterministic_motion(BaseMotionKind kind, double t_s) {
  Vector6d m = Vector6d::Zero();
  switch (kind) {
    case BaseMotionKind::kRamp: {
      const double way_s = ramp(t_s, 4, 10, 0.3);
      m << 0.08 * way_s, 0.06 * way_s, 0, 0, 0, 10 * kDegree * way_s;
      break;
    }
    case BaseMotionKind::kSine: {
      const double sine = std::sin(2 * kPi * 0.25 * t_s);
      m << 0.1 * sine, 0, 0, 0, 5 * kDegree * sine, 0;
      break;
    }
    case BaseMotionKind::kPush: {
      const double way = push(t_s);
      m << 0.12 * way, -0.16 * way, 0, 0, 0, 10 * kDegree * way;
      break;
    }
    case BaseMotionKind::kStill:
    case BaseMotionKind::kRandomWalk:
      break;
  }
  return m;
}

// The arm: its camera sways about 0.7 m from the base.
Pose<Base, Cam> arm_pose(double t_s) {
  const double a = std::sin(0.9 * t_s), b = std::sin(0.6 * t_s + 1);
  return {rotation_from_vector(Vector3d(0.3 * b - 2, 0.4 * a, 0.2 * a)),
          Vector3d(0.55 + 0.1 * b, 0.25 * a, 0.5 + 0.1 * a)};
}

// A first-order process with the given standard deviation and a memory of one second.
class Wander {
 public:
  Wander(double position_m, double rotation_rad) : m_(position_m), rad_(rotation_rad) {}
  const Vector6d& next(double dt_s, Noise* noise) {
    const double keep = std::exp(-dt_s), fresh = std::sqrt(1 - keep * keep);
    state_.head<3>() = keep * state_.head<3>() + fresh * noise->gaussian(m_);
    state_.tail<3>() = keep * state_.tail<3>() + fresh * noise->gaussian(rad_);
    return state_;
  }

 private:
  double m_, rad_;
  Vector6d state_ = Vector6d::Zero();
};

void disturb(const Vector6d& error, Pose<World, Cam>* pose) {
  *pose = {rotation_from_vector(error.tail<3>()) * pose->rotation(),
           pose->translation() + error.head<3>()};
}

Vector6d outlier(const BaseMotionOptions& o, double t_s, Noise* noise) {
  Vector6d error = Vector6d::Zero();
  const double chance = noise->uniform(0, 1);
  const Vector3d shift = noise->gaussian(1), turn = noise->gaussian(1);
  if (t_s >= o.mistrack_begin_s && t_s < o.mistrack_begin_s + o.mistrack_length_s) {
    error << o.mistrack_m, 0, 0, 0, o.mistrack_deg * kDegree, 0;
  } else if (chance < o.outlier_share) {
    error << 0.15 * shift, 10 * kDegree * turn;
  }
  return error;
}

}  // namespace

const char* to_string(BaseMotionKind kind) {
  switch (kind) {
    case BaseMotionKind::kStill:
      return "still";
    case BaseMotionKind::kRamp:
      return "ramp";
    case BaseMotionKind::kSine:
      return "sine";
    case BaseMotionKind::kPush:
      return "push";
    case BaseMotionKind::kRandomWalk:
      return "random walk";
  }
  return "?";
}

std::vector<BaseFrame> make_base_motion(BaseMotionKind kind, const BaseMotionOptions& o) {
  Noise noise(o.seed);
  Wander walk(0.1, 6 * kDegree), wander(o.wander_m, o.wander_deg * kDegree);
  Vector6d walked = Vector6d::Zero();
  std::vector<BaseFrame> frames;
  const double dt_s = 1 / o.rate_hz;
  for (double t_s = 0; t_s < o.length_s; t_s += dt_s) {
    if (kind == BaseMotionKind::kRandomWalk) walked += dt_s * walk.next(dt_s, &noise);
    const Vector6d motion = deterministic_motion(kind, t_s) + walked;
    BaseFrame f;
    f.world_from_base = {rotation_from_vector(motion.tail<3>()), motion.head<3>()};
    f.measurement.time = Time{1'000'000} + seconds(t_s);
    f.measurement.base_from_cam = arm_pose(t_s);
    f.measurement.world_from_cam = f.world_from_base * f.measurement.base_from_cam;
    Vector6d error = wander.next(dt_s, &noise);
    error.head<3>() += noise.gaussian(o.noise_m);
    error.tail<3>() += noise.gaussian(o.noise_deg * kDegree);
    const Vector6d gross = outlier(o, t_s, &noise);
    f.is_wrong = !gross.isZero();
    disturb(error + gross, &f.measurement.world_from_cam);
    frames.push_back(f);
  }
  return frames;
}

}  // namespace foresight
