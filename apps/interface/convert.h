// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "localisation/fix.h"
#include "twocone/types.h"

/// Converts the layers' types to those of the public interface.
namespace twocone::interface {

inline PoseCovariance to_array(const Eigen::Matrix3d& covariance) {
  PoseCovariance values{};
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data()) = covariance;
  return values;
}

inline PoseAnswer to_answer(const localisation::Fix& fix) {
  // The public enumeration lists the same verdicts in the same order.
  static_assert(int(FixVerdict::kOk) == int(localisation::FixVerdict::kOk) &&
                int(FixVerdict::kOutOfBounds) == int(localisation::FixVerdict::kOutOfBounds));
  PoseAnswer answer;
  answer.verdict = FixVerdict(int(fix.verdict));
  const bool is_given = fix.position_m && fix.heading_rad && !fix.other_position_m &&
                        fix.verdict != localisation::FixVerdict::kOutOfBounds;
  if (!is_given) return answer;
  answer.pose = Pose{fix.position_m->x(), fix.position_m->y(), *fix.heading_rad};
  if (fix.covariance) answer.covariance = to_array(*fix.covariance);
  return answer;
}

}  // namespace twocone::interface
