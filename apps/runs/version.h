// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace twocone::runs {

std::string version();  ///< of twocone, "0.1.0"
std::string commit();  ///< of its source when it was built, with "+" if it held changes; "unknown" outside a repository
std::string compiler();  ///< with version and kind of build, "GNU 12.2.0 Release"

}  // namespace twocone::runs
