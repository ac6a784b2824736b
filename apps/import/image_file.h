// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>

namespace twocone::importer {

/// Reports an image that cannot be decoded, because it is incomplete or not an image. The message is one line.
class UnreadableImage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ImageSize {
  int width_px = 0, height_px = 0;
};

/// Checks that the file is a complete PNG or JPEG image of that size, whatever its extension.
/// @throws UnreadableImage; config::FileError for a wrong size
void check_image(const std::filesystem::path& file, ImageSize wanted);

/// Stores the image as the PNG file `to`, which must not exist. A PNG file becomes a hard link if the disk supports it,
/// otherwise a copy. A JPEG file is decoded.
/// @throws as check_image; runlog::DiskError
void store_image(const std::filesystem::path& file, ImageSize wanted, const std::filesystem::path& to);

}  // namespace twocone::importer
