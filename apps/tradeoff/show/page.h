// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/show/plane.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns a setting with its accuracy and costs, in lines of plain text.
std::string tooltip(const SettingResult& result);

/// Returns the SVG of drawing_of(plane) with an invisible circle over each mark, whose <title> is its tooltip. The Tab
/// key reaches those of the frontier. Each is written as `<circle class="spot" cx= cy= data-setting="index">`.
std::string with_spots(std::string_view svg, const Sweep& sweep, const Plane& plane);

/// An image for the page.
struct PageImage {
  std::string id;       ///< in the page's HTML
  std::string caption;  ///< plain text
  std::string svg;      ///< stand-alone, with spots
};

/// Returns index.html: one page that needs no other file. It is UTF-8 and well-formed XML. @param choice shown with its
/// reason; may be null
std::string page(const Sweep& sweep, const std::vector<PageImage>& images, const Choice* choice);

}  // namespace twocone::tradeoff
