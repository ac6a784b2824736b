// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::compare {

/// Returns the styles that the page needs in addition to the report's.
std::string_view page_style();

/// Returns the script of the blend's slider. Without it the real image lies half transparent over the simulated one.
std::string_view page_script();

}  // namespace twocone::compare
