// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/new_scene/new_scene.h"
#include "drivers/sim_povray/scene_geometry.h"

/// The steps of find_room(), private to this folder.
namespace twocone::new_scene {

using sim_povray::Bounds3;
using sim_povray::SceneGeometry;
using sim_povray::Vec3;

/// A robot finds its place by three landmarks; with two there are two places.
constexpr std::size_t kFewestLandmarks = 3;

/// Finds the horizontal surface that fills most of the image of the scene's own camera. Without a camera that is
/// understood, it is the one that is seen most from above. @param geometry in POV-Ray units @throws NoPlace
Floor find_floor(const SceneGeometry& geometry, const RoomSettings& settings);

/// What is above a floor, as a grid of square cells.
class FloorPlan {
 public:
  static constexpr double kCell_m = 0.05;
  static constexpr int kCells = 180;  ///< along each side: 9 m
  /// What is lower is driven over: carpets, tiles, the discs under landmarks.
  static constexpr double kLow_m = 0.02;

  /// @param landmarks of the scene; they are not free, but no obstacles of the map either
  FloorPlan(const SceneGeometry& geometry, const FloorPoint& centre, const std::vector<FoundLandmark>& landmarks);

  [[nodiscard]] const sim_povray::FloorGrid& grid() const { return grid_; }
  /// Distance from the middle of the cell at a point to the nearest cell that is not free; 0 outside of the grid.
  [[nodiscard]] double clearance_m(const FloorPoint& point) const;
  /// The cells where the robot's axis can be and that are connected with `start`.
  [[nodiscard]] cv::Mat1b reachable_from(const FloorPoint& start) const;
  /// The rectangle around the cells of a mask, `margin_m` larger, within the grid.
  [[nodiscard]] Bounds bounds_of(const cv::Mat1b& mask, double margin_m) const;
  /// Returns obstacles that lie in the rectangle at least in part, the floor's edges among them.
  [[nodiscard]] std::vector<FoundObstacle> obstacles_in(const Bounds& bounds) const;

 private:
  /// @param covered cells of the obstacles up to now
  void add(const cv::Mat1b& cells, cv::Mat1b& covered, const std::string& what);
  [[nodiscard]] std::vector<FoundObstacle> rectangles_of(cv::Mat1b cells, const std::string& what) const;
  [[nodiscard]] cv::Point cell_at(const FloorPoint& point) const;
  [[nodiscard]] double x_m(int column) const { return grid_.corner.x_m + kCell_m * column; }
  [[nodiscard]] double y_m(int row) const { return grid_.corner.y_m + kCell_m * row; }

  sim_povray::FloorGrid grid_;
  cv::Mat1b floorless_;                   // 255: there is no floor
  cv::Mat1b occupied_;                    // 255: an object or a landmark is there
  cv::Mat1f clearance_;                   // to the next cell that is not free, in cells
  std::vector<FoundObstacle> obstacles_;  // of objects
};

/// Returns the scene's cylinders that vision can use, on the floor and within the grid.
std::vector<FoundLandmark> scene_landmarks(const SceneGeometry& geometry, const FloorPoint& centre,
                                           std::vector<std::string>& warnings);
/// Returns whether the robot at `from` sees the landmark's top in both mirrors.
bool sees(const SceneGeometry& geometry, const FloorPoint& from, const Landmark& landmark);
/// Returns landmarks to be added around the start, in hues that are not among the scene's; as many as have room.
std::vector<FoundLandmark> added_landmarks(const SceneGeometry& geometry, const FloorPlan& plan,
                                           const FloorPoint& start, const std::vector<FoundLandmark>& present,
                                           std::vector<std::string>& warnings);

}  // namespace twocone::new_scene
