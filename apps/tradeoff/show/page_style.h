// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::tradeoff {

/// What the page's look has beyond the report's.
std::string_view page_style();

/// The page's script: a tooltip beside pointer or focus, arrow keys from point to point, sorting by a click on a head.
/// Without it the circles' own titles are shown.
std::string_view page_script();

}  // namespace twocone::tradeoff
