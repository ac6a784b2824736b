// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "apps/tradeoff/show/plane.h"

namespace twocone::tradeoff {

/// What a setting is, buys and costs, in lines of plain text.
std::string tooltip(const SettingResult& result);

/// The SVG of drawing_of(plane) with an unseen circle over each mark, whose <title> is its tooltip; those of the
/// frontier can be reached by the Tab key. Written as `<circle class="spot" cx= cy= data-setting="index">`.
std::string with_spots(std::string_view svg, const Sweep& sweep, const Plane& plane);

}  // namespace twocone::tradeoff
