// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/foreign/stamps.h"

namespace twocone::foreign {

/// A picture of a folder, with its time.
struct StampedPicture {
  std::filesystem::path file;
  Stamp time{};
};

/// A camera's pictures in the order of their times, which rise.
struct PictureList {
  std::vector<StampedPicture> pictures;
  std::vector<std::string> events;  ///< what was passed over, a sentence each
};

/// The PNG and JPEG files of a folder.
///
/// Their times are those of `times_file`, where one is named: a line for each picture, TIME NAME with blanks between or
/// TIME,NAME, with comments (#) and one header line, as rgb.txt of the TUM RGB-D benchmark and data.csv of EuRoC have
/// it. NAME is of a file in the folder; folders before it are passed over. Without such a file the names' stems are the
/// times. A last line that was cut off, or whose picture is missing, is left out: the recording ended there.
/// @param times_file empty: the names
/// @throws files::FileError: no such folder, no pictures, a name or line that is no time, a time that does not rise, a
/// picture that is not there
PictureList list_pictures(const std::filesystem::path& folder, const std::filesystem::path& times_file, StampUnit unit);

}  // namespace twocone::foreign
