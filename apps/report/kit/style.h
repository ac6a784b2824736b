// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::report {

/// Returns the page's style sheet.
std::string_view style();

/// Returns the page's script, which moves the slider through the frames. Without it the page shows the first frame.
std::string_view script();

}  // namespace twocone::report
