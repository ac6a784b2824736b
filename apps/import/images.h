// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/import/stamps.h"
#include "base/errors.h"

namespace twocone::importer {

/// An image file and its time.
struct StampedImage {
  std::filesystem::path file;
  Stamp time{};
};

/// The images of a camera, with strictly increasing times.
struct ImageList {
  std::vector<StampedImage> images;
  std::vector<std::string> events;  ///< what was left out, one sentence each
};

/// Lists the PNG and JPEG files of a folder.
///
/// Their times are in `times_file` if it is given. It has a line for each image, TIME NAME separated by blanks or
/// TIME,NAME, and may have comments (#) and one header line. Examples are rgb.txt of the TUM RGB-D benchmark and
/// data.csv of EuRoC. NAME is a file in the folder, and folders in NAME are ignored. Without `times_file`, the stem of
/// each file name is its time. If the last line is incomplete or its image is missing, the line is left out, because
/// the recording ended there.
/// @param times_file empty: the names are the times
/// @throws config::FileError: no such folder, no images, a name or line without a valid time, a time that does not
/// increase, a missing image
ImageList list_images(const std::filesystem::path& folder, const std::filesystem::path& times_file, StampUnit unit);

/// Reports an image that cannot be decoded, because it is incomplete or not an image. The message is one line.
struct UnreadableImage : base::FormattedError {
  using Formatted::Formatted;
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
