// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "hal/image.h"
#include "hal/result.h"

/// Functions that show a scene without a run, by POV-Ray.
namespace twocone::sim_povray {

/// An image of the whole scene from straight above, for reports: an orthographic view of a world rectangle, with world
/// x to the right and y up, from `height_m` above the floor. Objects above that height are not seen.
struct OverheadView {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;
  double height_m = 2.0;
  int width_px = 1000;  ///< the height follows from the rectangle
};
/// Returns the height of the view's image. @throws std::invalid_argument naming every bad argument
int checked_height_px(const OverheadView& view, double unit_m);
/// Renders the overhead view. The robot stands where the scene shows it; the scene needs no name comments.
/// Errors: as Simulation::open and Frame::image.
/// @param scene_paths as PlaceSettings
/// @throws std::invalid_argument naming every bad argument
Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render, const std::vector<std::filesystem::path>& scene_paths = {});

/// Position of a camera over the floor, as the scene shows it.
struct ShownCamera {
  double x_m = 0, y_m = 0;
  /// Direction of the image's x axis in the world; empty if that axis is not level within a degree.
  std::optional<double> x_axis_rad{};
};
/// Returns the position of a camera of the robot that SessionSettings::name selects. POV-Ray evaluates the camera's
/// statement without rendering an image. Ends early when stop is requested.
/// Errors: as Simulation::open and Povray::render; kRefused, with the reason, if the statement cannot be evaluated (the
/// camera is of another kind, takes its vectors from another camera, or its statement holds a directive).
Result<ShownCamera> shown_camera(const PlaceSettings& place, const std::string& robot_name,
                                 const std::string& camera_name, const std::stop_token& stop);

}  // namespace twocone::sim_povray
