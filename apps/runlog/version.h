// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace twocone::runlog {

std::string version();   ///< of twocone, "0.1.0"
std::string commit();    ///< of the source at build time, with "+" if it had changes; "unknown" outside a repository
std::string compiler();  ///< with version and build type, "GNU 12.2.0 Release"

}  // namespace twocone::runlog
