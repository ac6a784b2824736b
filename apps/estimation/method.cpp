// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/method.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/yaml/names.h"
#include "base/errors.h"

namespace twocone::estimation {
namespace {

constexpr double kMsPerS = 1000;
constexpr std::string_view kNames[] = {"paper", "outline"};  // in the order of Method

}  // namespace

std::string_view to_string(Method method) { return kNames[int(method)]; }

std::vector<std::string> method_names() { return {std::begin(kNames), std::end(kNames)}; }

Method method_named(std::string_view name) {
  const auto known = std::find(std::begin(kNames), std::end(kNames), name);
  if (known != std::end(kNames)) return Method(known - std::begin(kNames));
  if (const auto present = config::present_name(config::NameOf::kMethod, name); present != name) {
    throw base::InvalidArgument("method '{}' is now named '{}'", name, present);
  }
  throw base::InvalidArgument("no method '{}'; there are: {}", name, fmt::join(method_names(), ", "));
}

Method method_of(const config::Robot& robot) {
  return robot.estimator.method.empty() ? kDefaultMethod : method_named(robot.estimator.method);
}

config::Robot with_budget(config::Robot robot, Method method, double budget_s) {
  if (!(budget_s > 0) || !std::isfinite(budget_s)) {
    throw base::InvalidArgument("the time budget is {} ms, must be > 0 ms and finite", budget_s * kMsPerS);
  }
  if (method == Method::kPaper) {
    throw base::InvalidArgument("method {} has no stages to stop at: a time budget needs method {}", to_string(method),
                                to_string(Method::kOutline));
  }
  robot.estimator.method = to_string(method);  // a file with method paper must not have the key `stage`
  robot.estimator.stage = "adaptive";
  robot.estimator.budget_s = budget_s;
  return robot;
}

std::optional<double> time_limit_of(Method method, const config::Robot& robot) {
  const bool is_adaptive = method == Method::kOutline && robot.estimator.stage == "adaptive";
  return is_adaptive ? robot.estimator.budget_s : std::nullopt;
}

}  // namespace twocone::estimation
