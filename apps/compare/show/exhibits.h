// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/compare/comparison.h"

namespace twocone::compare {

/// The frames' section, inner HTML: a slider through the exhibits (report::script()), one through the blend
/// (page_script()). Empty without exhibits. @param notes what could not be shown is added. Private to
/// apps/compare/show.
std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes);

}  // namespace twocone::compare
