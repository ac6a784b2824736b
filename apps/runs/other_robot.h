// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace twocone::runs {

/// A new run folder with what `from` recorded (images, wheel angles, truth), as the robot of another file would have
/// it: for localise() to range and fix with that file's `rig:` and wheels, after a calibration say. `from` stays as it
/// is.
///
/// Images are hard links where the disk supports them, otherwise copies. The odometry is computed again from the
/// recorded angles. run.yaml is `from`'s with the other robot in it, and an event that says so; the map is still
/// `from`'s, so a file that names a map with other landmarks or bounds is refused.
/// @param from also a run that was cut off
/// @param robot_file of the same cameras' sizes and the same start, or it cannot have been that robot
/// @param to a folder without a run; `replace`: one that is there goes (replace_run.h). A failure leaves none
/// @throws config::FileError (a file that cannot be read, another robot altogether), DiskError
void copy_run_for_robot(const std::filesystem::path& from, const std::filesystem::path& robot_file,
                        const std::filesystem::path& to, bool replace = false);

}  // namespace twocone::runs
