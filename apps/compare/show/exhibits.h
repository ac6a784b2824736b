// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/compare/comparison.h"

namespace twocone::compare {

/// Returns the section of the frames, inner HTML: a slider through the exhibits (report::script()) and one for the
/// blend (page_script()). Empty without exhibits. @param notes receives what could not be shown. Private to
/// apps/compare/show.
std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes);

}  // namespace twocone::compare
