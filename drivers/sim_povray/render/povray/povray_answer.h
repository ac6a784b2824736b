// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "hal/image.h"
#include "hal/result.h"

/// Reads POV-Ray's output, and makes the error if there is no image.
namespace twocone::sim_povray {

/// Parses a binary PPM with 8 bits a channel, and nothing after it, as kRgb8. Errors: kBadData.
Result<Image> parse_ppm(std::string_view bytes);

/// An image to measure by: linear light, 16 bits a channel, red, green and blue in turn, rows from the top.
struct DeepImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint16_t> levels;  ///< width_px * height_px * 3; 65535 is 1
};
/// Parses a binary PPM with 16 bits a channel, big-endian as POV-Ray writes them. Errors: kBadData.
Result<DeepImage> parse_deep_ppm(std::string_view bytes);

/// Returns the job's image. Errors: kBadData (no whole image, or one of another size).
ImageResult image_from(std::string_view ppm, const RenderJob& job);
Result<DeepImage> deep_image_from(std::string_view ppm, const RenderJob& job);

/// Returns the message in POV-Ray's standard error that states why it stopped, with lines that it folded at 80 columns
/// unfolded, as `FILE:LINE: POV-Ray: TEXT`; without a position it is `SCENE: POV-Ray: TEXT`. Empty if there is none.
/// @param scene_path replaces the name under which POV-Ray was given the scene
std::string povray_complaint(const std::string& errors, const std::string& scene_path);

/// Returns the message about a file that is not found, if there is one, as `Cannot find file 'F', ...`.
std::string missing_file(const std::string& errors);

/// Returns the error of a process that ended without an image: kDisconnected (it crashed), kRefused (POV-Ray reports an
/// error: file and line).
/// @param wait_status as waitpid() returns it
Error exit_error(const std::string& label, int wait_status, const std::string& errors, const std::string& scene_path);
Error timeout_error(const std::string& label, std::chrono::nanoseconds timeout);
/// @param what the state that POV-Ray had not reached: "started", "finished"
Error closed_error(const std::string& label, const char* what);

}  // namespace twocone::sim_povray
