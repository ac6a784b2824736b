// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "apps/report/kit/figure.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/show/plane.h"
#include "apps/tradeoff/sweep.h"

/// The parts of the page with the images. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// Returns a setting with its accuracy and costs, in lines of plain text.
std::string tooltip(const SettingResult& result);

/// Returns the image as a plot for gnuplot. @param choice marked; may be null
report::Plot drawing_of(const Sweep& sweep, const Plane& plane, const Choice* choice);

/// Returns the styles that the page needs in addition to the report's.
std::string_view page_style();

/// Returns the page's script: a tooltip beside the pointer or the focus, arrow keys from point to point, sorting by a
/// click on a column head. Without it the circles' own titles are shown.
std::string_view page_script();

}  // namespace twocone::tradeoff
