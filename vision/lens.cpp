// SPDX-License-Identifier: Apache-2.0
#include "vision/lens.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <Eigen/LU>

namespace twocone::vision {
namespace {

// Newton's error after a step is of the order of the step's square. After a step of 1e-9 (relative) it is far below a
// double's rounding, 1e-16, unless the curvature of the model is some hundred times its slope.
constexpr double kLastStep = 1e-9;

void check(const LensDistortion& distortion) {
  std::string bad;
  const std::size_t terms = distortion.coefficients.size();
  if (terms != 4 && terms != 5 && terms != 8) {
    bad += fmt::format(" distortion has {} coefficients, must have 4, 5 or 8;", terms);
  }
  for (std::size_t i = 0; i < terms; ++i) {
    if (!std::isfinite(distortion.coefficients[i])) {
      bad += fmt::format(" distortion coefficient {} is {}, must be a finite number;", i, distortion.coefficients[i]);
    }
  }
  for (const int i : {0, 1}) {
    const char* const axis = i == 0 ? "x" : "y";
    if (!(distortion.focal_px[i] > 0) || !std::isfinite(distortion.focal_px[i])) {
      bad += fmt::format(" distortion focal_px {} is {}, must be > 0 px;", axis, distortion.focal_px[i]);
    }
    if (!std::isfinite(distortion.principal_px[i])) {
      bad += fmt::format(" distortion principal_px {} is {}, must be a finite number of px;", axis,
                         distortion.principal_px[i]);
    }
  }
  if (!bad.empty()) throw std::invalid_argument("Lens:" + bad);
}

}  // namespace

Lens::Lens(const LensDistortion& distortion)
    : focal_px_(distortion.focal_px.array()), principal_px_(distortion.principal_px.array()) {
  check(distortion);
  std::copy(distortion.coefficients.begin(), distortion.coefficients.end(), k_.begin());
}

bool Lens::is_neutral() const {
  return std::all_of(k_.begin(), k_.end(), [](double k) { return k == 0; });
}

std::optional<Lens::Bent> Lens::bend(const Eigen::Vector2d& straight) const {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = k_;
  const double x = straight.x();
  const double y = straight.y();
  const double rr = x * x + y * y;
  const double above = 1 + rr * (k1 + rr * (k2 + rr * k3));
  const double below = 1 + rr * (k4 + rr * (k5 + rr * k6));
  if (!(below > 0) || !std::isfinite(above)) return std::nullopt;
  const double scale = above / below;
  // d scale / d rr
  const double growth = (k1 + rr * (2 * k2 + 3 * rr * k3) - scale * (k4 + rr * (2 * k5 + 3 * rr * k6))) / below;

  Bent bent;
  bent.at = {x * scale + 2 * p1 * x * y + p2 * (rr + 2 * x * x), y * scale + p1 * (rr + 2 * y * y) + 2 * p2 * x * y};
  const double mixed = 2 * x * y * growth + 2 * p1 * x + 2 * p2 * y;
  bent.jacobian << scale + 2 * x * x * growth + 2 * p1 * y + 6 * p2 * x, mixed,  //
      mixed, scale + 2 * y * y * growth + 6 * p1 * y + 2 * p2 * x;
  // At a fold the sign of the determinant changes; radially beyond it, the sign of the trace changes too.
  if (!(bent.jacobian.determinant() > 0) || !(bent.jacobian.trace() > 0)) return std::nullopt;
  return bent;
}

std::optional<Eigen::Vector2d> Lens::distort(const Eigen::Vector2d& pinhole_px) const {
  const auto answer = distort_with_jacobian(pinhole_px);
  return answer ? std::optional(answer->pixel_px) : std::nullopt;
}

std::optional<PixelWithJacobian<2>> Lens::distort_with_jacobian(const Eigen::Vector2d& pinhole_px) const {
  const auto bent = bend(((pinhole_px.array() - principal_px_) / focal_px_).matrix());
  if (!bent) return std::nullopt;
  PixelWithJacobian<2> answer{(principal_px_ + focal_px_ * bent->at.array()).matrix(), bent->jacobian};
  answer.jacobian(0, 1) *= focal_px_.x() / focal_px_.y();
  answer.jacobian(1, 0) *= focal_px_.y() / focal_px_.x();
  return answer;
}

std::optional<Eigen::Vector2d> Lens::undistort(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d wanted = ((pixel.array() - principal_px_) / focal_px_).matrix();
  if (!wanted.allFinite()) return std::nullopt;
  Eigen::Vector2d straight = wanted;
  auto bent = bend(straight);
  // The start may lie beyond the fold although the answer does not: move it towards the middle.
  for (int i = 0; !bent && i < kSteps; ++i) bent = bend(straight *= 0.75);

  for (int i = 0; bent && i < kSteps; ++i) {
    Eigen::Vector2d step = bent->jacobian.inverse() * (wanted - bent->at);
    if (!step.allFinite()) return std::nullopt;
    const bool is_last = step.norm() <= kLastStep * (wanted.norm() + straight.norm());
    if (is_last) return (principal_px_ + focal_px_ * (straight + step).array()).matrix();
    auto next = bend(straight + step);
    for (int halving = 0; !next && halving < kSteps; ++halving) next = bend(straight + (step /= 2));
    straight += step;
    bent = next;
  }
  return std::nullopt;
}

}  // namespace twocone::vision
