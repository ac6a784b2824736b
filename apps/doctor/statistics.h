// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/quantile.h"

namespace twocone::doctor {

inline double median(const std::vector<double>& values) { return base::quantile(values, 0.5); }
inline double greatest(const std::vector<double>& values) { return base::quantile(values, 1); }

}  // namespace twocone::doctor
