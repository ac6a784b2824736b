// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace twocone {

/// The derivative of N numbers by the *shared errors*: the errors of what the robot believes (rig, map, wheels), which
/// are the same in every frame. They are independent and have variance 1, so a column is the effect of one sigma of one
/// error. No columns: all that is believed is exact. Matrices that are used together have the same columns.
template <int N>
using BySharedErrors = Eigen::Matrix<double, N, Eigen::Dynamic>;

}  // namespace twocone
