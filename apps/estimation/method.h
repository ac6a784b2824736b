// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/robot_file.h"

namespace twocone::estimation {

/// The method that makes ranges and fixes from a stereo frame.
enum class Method {
  kPaper,    ///< Burbridge & Spacek 2006, sections 3.2 and 3.3: the baseline
  kOutline,  ///< vision/outline_ranging.h, localisation/least_squares_fix.h and, for the estimate, pose_filter.h
};
/// The method that is used if none is given.
constexpr Method kDefaultMethod = Method::kOutline;
/// Returns the names that the command accepts: paper, outline.
std::vector<std::string> method_names();
std::string_view to_string(Method method);
/// Returns the method of that name. @throws std::invalid_argument that lists the methods
Method method_named(std::string_view name);

/// Returns the method in `robot.estimator`, or kDefaultMethod.
Method method_of(const config::Robot& robot);

/// Returns `robot` for a run with a time budget for each frame. Stage `adaptive` of method `outline` replaces the
/// settings of the robot file.
/// @param method the requested method
/// @throws std::invalid_argument for method paper, which has no stages at which it could stop, and unless the time
/// budget is > 0 and finite
config::Robot with_budget(config::Robot robot, Method method, double budget_s);

/// Returns the time budget for answers of `method`, or nothing if there is none.
std::optional<double> time_limit_of(Method method, const config::Robot& robot);

}  // namespace twocone::estimation
