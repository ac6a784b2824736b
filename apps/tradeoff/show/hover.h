// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "apps/tradeoff/show/plane.h"

namespace twocone::tradeoff {

/// Returns a setting with its accuracy and costs, in lines of plain text.
std::string tooltip(const SettingResult& result);

/// Returns the SVG of drawing_of(plane) with an invisible circle over each mark, whose <title> is its tooltip. The Tab
/// key reaches those of the frontier. Each is written as `<circle class="spot" cx= cy= data-setting="index">`.
std::string with_spots(std::string_view svg, const Sweep& sweep, const Plane& plane);

}  // namespace twocone::tradeoff
