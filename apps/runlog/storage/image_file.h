// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <opencv2/core/mat.hpp>

#include "apps/runlog/storage/disk.h"
#include "hal/camera.h"
#include "hal/image.h"

// The images of a run folder are PNG files.
namespace twocone::runlog {

/// Reads a PNG file of any kind as kRgb8: grey in all three channels, the upper 8 of 16 bits, no transparency. The
/// values are those in the file, whatever it says about gamma.
/// Errors: kNotFound; kBadData if it is no PNG file, damaged, truncated, or has more than 16,384 pixels a side.
Result<Image> read_image(const std::filesystem::path& file);
/// The same of a file that has been read. @param file its name, for the error
Result<Image> read_image(const std::filesystem::path& file, std::string_view bytes);

/// Reads a PNG file in the form that vision takes, CV_8UC3 r g b. The cv::Mat owns its pixels. Errors: those of
/// read_image().
Result<cv::Mat> read_rgb(const std::filesystem::path& file);
/// The same of a camera's image. Errors: also kBadData if the image does not have the camera's size.
Result<cv::Mat> read_rgb(const std::filesystem::path& file, const CameraSettings& camera);

/// Writes an image completely or not at all: with one channel if it is kGrey8, else with three. @throws DiskError, and
/// base::FormattedError if the image cannot be converted
void write_image(const std::filesystem::path& file, const Image& image);

/// Returns an image as text for a page: "data:image/jpeg;base64,...". @param quality as of to_mjpeg.
/// @throws base::FormattedError if the image cannot be converted
std::string jpeg_uri(const Image& image, int quality);

/// Writes an image of one channel with 16 bits. @param pixels rows from the top, `width_px` x `height_px`.
/// @throws DiskError
void write_grey16(const std::filesystem::path& file, int width_px, int height_px,
                  std::span<const std::uint16_t> pixels);

}  // namespace twocone::runlog
