// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>

namespace twocone::foreign {

/// A picture whose pixels cannot be had: half-written, or none at all. One line.
class BadPicture : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct PictureSize {
  int width_px = 0, height_px = 0;
};

/// A whole PNG or JPEG picture of that size, whatever its name ends in.
/// @throws BadPicture; files::FileError for another size, which no decoding mends
void check_picture(const std::filesystem::path& file, PictureSize wanted);

/// Stores the picture as the PNG file `to`, which is not there yet: a PNG file as a hard link where the disk can have
/// it, else a copy; a JPEG file decoded. @throws as check_picture; runs::DiskError
void store_picture(const std::filesystem::path& file, PictureSize wanted, const std::filesystem::path& to);

}  // namespace twocone::foreign
