// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::report {

/// The page's style sheet.
std::string_view style();

/// The page's script: the slider through the frames. Without it the first frame is shown.
std::string_view script();

}  // namespace twocone::report
