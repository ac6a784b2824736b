// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <map>
#include <utility>
#include <vector>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Where a setting stands on an axis: sorts as conclusions.h says (levels: by Level, then by enough_m). First: the size
/// of an axis that has one (pixels of a picture, landmarks, frames, ...).
using AxisPlace = std::pair<double, double>;
AxisPlace axis_place(const Setting& setting, Axis axis);

/// Settings that differ in nothing but `axis`, each group by rising place. Of those only that answer often enough
/// (kLeastAnswered). The pointers are into `sweep`.
using AxisGroup = std::map<AxisPlace, const SettingResult*>;
std::vector<AxisGroup> axis_groups(const Sweep& sweep, Axis axis);

}  // namespace twocone::tradeoff
