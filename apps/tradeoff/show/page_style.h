// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::tradeoff {

/// Returns the styles that the page needs in addition to the report's.
std::string_view page_style();

/// Returns the page's script: a tooltip beside the pointer or the focus, arrow keys from point to point, sorting by a
/// click on a column head. Without it the circles' own titles are shown.
std::string_view page_script();

}  // namespace twocone::tradeoff
