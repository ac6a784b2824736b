// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace twocone::compare {

/// What the page's look has beyond the report's.
std::string_view page_style();

/// The blend's slider. Without it both pictures show through each other at a half.
std::string_view page_script();

}  // namespace twocone::compare
