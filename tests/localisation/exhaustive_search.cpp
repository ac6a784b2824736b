// SPDX-License-Identifier: Apache-2.0
#include "tests/localisation/exhaustive_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace twocone::localisation {
namespace {

struct Model {
  Eigen::Matrix3d hessian_gn = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  double cost = 0;
};

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

double cost_of(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  double cost = 0;
  for (const auto& m : all) {
    const double dx = m.landmark_m.x() - pose.x();
    const double dy = m.landmark_m.y() - pose.y();
    if (m.range_m) cost += std::pow(*m.range_m - std::hypot(dx, dy), 2) / m.covariance(0, 0);
    if (m.bearing_rad) {
      cost += std::pow(wrapped(*m.bearing_rad - std::atan2(dy, dx) + pose.z()), 2) / m.covariance(1, 1);
    }
  }
  return cost;
}

/// Half of chi-squared's slope and curvature, with all terms.
Model model_at(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  Model model;
  const auto add = [&](double error, const Eigen::Vector3d& gradient, const Eigen::Matrix2d& bend, double variance) {
    model.cost += error * error / variance;
    model.slope += error / variance * gradient;
    model.hessian_gn += gradient * gradient.transpose() / variance;
    model.hessian.topLeftCorner<2, 2>() += error / variance * bend;
  };
  for (const auto& m : all) {
    const double dx = m.landmark_m.x() - pose.x();
    const double dy = m.landmark_m.y() - pose.y();
    const double d2 = dx * dx + dy * dy;
    const double d = std::sqrt(d2);
    if (m.range_m) {  // error = |d| - range
      Eigen::Matrix2d bend;
      bend << dy * dy, -dx * dy, -dx * dy, dx * dx;
      add(d - *m.range_m, {-dx / d, -dy / d, 0}, bend / (d2 * d), m.covariance(0, 0));
    }
    if (m.bearing_rad) {  // error = direction - heading - bearing
      Eigen::Matrix2d bend;
      bend << 2 * dx * dy, dy * dy - dx * dx, dy * dy - dx * dx, -2 * dx * dy;
      add(wrapped(std::atan2(dy, dx) - pose.z() - *m.bearing_rad), {dy / d2, -dx / d2, -1}, bend / (d2 * d2),
          m.covariance(1, 1));
    }
  }
  model.hessian += model.hessian_gn;
  return model;
}

bool is_on_landmark(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  return std::any_of(all.begin(), all.end(), [&](const LandmarkMeasurement& m) {
    return m.bearing_rad && (m.landmark_m - pose.head<2>()).norm() < kOnLandmark_m;
  });
}

/// Descends by Levenberg and Marquardt, and ends where nothing is gained.
Eigen::Vector3d go_down(const std::vector<LandmarkMeasurement>& all, Eigen::Vector3d pose) {
  Model now = model_at(all, pose);
  double damping = 1e-3;
  for (int i = 0; i < 80 && damping < 1e12; ++i) {
    Eigen::Matrix3d damped = now.hessian_gn;
    damped.diagonal() *= 1 + damping;
    const Eigen::Vector3d step = damped.ldlt().solve(-now.slope);
    const Eigen::Vector3d there = pose + step;
    const Model next = model_at(all, there);
    if (next.cost < now.cost) {
      const bool is_little = now.cost - next.cost < 1e-7 * (1 + next.cost) && damping < 1e-2;
      pose = there;
      now = next;
      damping = std::max(1e-9, damping / 8);
      if (is_little) break;
    } else {
      damping *= 5;
    }
  }
  return pose;
}

}  // namespace

double chi_squared_at(const std::vector<LandmarkMeasurement>& measurements, double x_m, double y_m,
                      double heading_rad) {
  return cost_of(measurements, {x_m, y_m, heading_rad});
}

double sigmas_from_minimum(const std::vector<LandmarkMeasurement>& measurements, const FoundMinimum& at) {
  const Model model = model_at(measurements, {at.x_m, at.y_m, at.heading_rad});
  const Eigen::LLT<Eigen::Matrix3d> cholesky(model.hessian);
  if (cholesky.info() != Eigen::Success) return -1;
  return cholesky.matrixL().solve(model.slope).norm();
}

std::vector<FoundMinimum> find_all_minima(const std::vector<LandmarkMeasurement>& measurements) {
  std::vector<FoundMinimum> found;
  // Whether a start leads to a known minimum is known only after refinement, so all are refined.
  const auto try_from = [&](const Eigen::Vector3d& start) {
    if (is_on_landmark(measurements, start)) return;
    Eigen::Vector3d pose = go_down(measurements, start);
    for (int i = 0; i < 8; ++i) {
      const Model model = model_at(measurements, pose);
      const Eigen::LLT<Eigen::Matrix3d> cholesky(model.hessian);
      if (cholesky.info() != Eigen::Success) return;
      pose -= cholesky.solve(model.slope);
    }
    const FoundMinimum m{pose.x(), pose.y(), wrapped(pose.z()), cost_of(measurements, pose)};
    constexpr double kConverged = 1e-5;  // sigmas
    const double left = sigmas_from_minimum(measurements, m);
    if (!(left >= 0 && left < kConverged) || is_on_landmark(measurements, pose)) return;
    for (const FoundMinimum& known : found) {
      constexpr double kSame = 1e-6;  // m and rad; sigmas are 1,000 times as large
      if (std::hypot(known.x_m - m.x_m, known.y_m - m.y_m) + std::abs(wrapped(known.heading_rad - m.heading_rad)) <
          kSame) {
        return;
      }
    }
    found.push_back(m);
  };
  const auto heading_by = [&](const LandmarkMeasurement& m, double x, double y) {
    return std::atan2(m.landmark_m.y() - y, m.landmark_m.x() - x) - *m.bearing_rad;
  };
  // The grid extends as far out as a range of 8 m from the room's walls may have been measured.
  for (double x = -8; x <= 8; x += 1) {
    for (double y = -8; y <= 8; y += 1) {
      for (double turn = 0.3; turn < 2 * std::numbers::pi; turn += std::numbers::pi / 2) try_from({x, y, turn});
    }
  }
  // Along each circle, with the heading that follows from each bearing there: 1 degree, and finer near each landmark.
  for (const auto& ranged : measurements) {
    if (!ranged.range_m) continue;
    std::vector<double> turns;
    for (double turn = 0; turn < 2 * std::numbers::pi; turn += std::numbers::pi / 180) turns.push_back(turn);
    for (const auto& near : measurements) {
      const Eigen::Vector2d d = near.landmark_m - ranged.landmark_m;
      if (d.norm() == 0) continue;
      for (double off = 0.02; off > 1e-5; off /= 1.5) {
        turns.push_back(std::atan2(d.y(), d.x()) + off);
        turns.push_back(std::atan2(d.y(), d.x()) - off);
      }
    }
    for (const double turn : turns) {
      const double x = ranged.landmark_m.x() + *ranged.range_m * std::cos(turn);
      const double y = ranged.landmark_m.y() + *ranged.range_m * std::sin(turn);
      for (const auto& m : measurements) {
        if (m.bearing_rad) try_from({x, y, heading_by(m, x, y)});
      }
    }
  }
  std::sort(found.begin(), found.end(),
            [](const FoundMinimum& a, const FoundMinimum& b) { return a.chi_squared < b.chi_squared; });
  return found;
}

}  // namespace twocone::localisation
