// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/robot_file.h"

namespace twocone::files {

/// The same robot with the pictures of its pair `k` times as wide and high, > 0: their sizes, rounded to whole pixels,
/// and with them all that is counted in pixels of theirs, in `rig:` and in the cameras' effects. A place c goes to
/// (c + 0.5) k - 0.5.
Robot scaled(Robot robot, double k);

}  // namespace twocone::files
