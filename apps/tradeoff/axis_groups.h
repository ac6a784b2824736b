// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// The place of a setting on an axis. Places sort as conclusions.h states (levels: by Level, then by enough_m). The
/// first number is the size, for an axis that has one (pixels of an image, landmarks, frames, ...).
using AxisPlace = std::pair<double, double>;
AxisPlace axis_place(const Setting& setting, Axis axis);

/// Settings that differ in `axis` only, each group by rising place. Only settings that answer often enough
/// (kLeastAnswered) are included. The pointers refer to `sweep`.
using AxisGroup = std::map<AxisPlace, const SettingResult*>;
std::vector<AxisGroup> axis_groups(const Sweep& sweep, Axis axis);

}  // namespace twocone::tradeoff
