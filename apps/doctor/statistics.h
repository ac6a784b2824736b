// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/runs/quantile.h"

namespace twocone::doctor {

using runs::quantile;

inline double median(const std::vector<double>& values) { return quantile(values, 0.5); }
inline double greatest(const std::vector<double>& values) { return quantile(values, 1); }

}  // namespace twocone::doctor
