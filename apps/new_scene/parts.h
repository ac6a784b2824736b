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

/// Where the floor is and how large the scene is meant.
struct Floor {
  double y = 0;       ///< in POV-Ray units
  std::string place;  ///< "plane, FILE:LINE"
  double unit_m = 0;
  std::string why_unit;
  FloorPoint centre;  ///< of the part that the scene's camera shows
};
/// Finds the horizontal surface that fills most of the image of the scene's own camera. Without a camera that is
/// understood, it is the one that is seen most from above. @throws NoPlace
Floor find_floor(const SceneGeometry& geometry, const RoomSettings& settings);

/// Converts between the world and the scene.
struct WorldFrame {
  double unit_m;
  double floor;

  [[nodiscard]] Vec3 scene(double x_m, double y_m, double z_m) const {
    return {x_m / unit_m, floor + z_m / unit_m, y_m / unit_m};
  }
};

/// What is above a floor, as a grid of square cells.
class FloorGrid {
 public:
  static constexpr double kCell_m = 0.05;
  static constexpr int kCells = 180;  ///< along each side: 9 m
  /// What is lower is driven over: carpets, tiles, the discs under landmarks.
  static constexpr double kLow_m = 0.02;

  /// @param landmarks solids that are not free, but no obstacles of the map either
  FloorGrid(const SceneGeometry& geometry, const WorldFrame& frame, const FloorPoint& centre,
            const std::vector<std::size_t>& landmarks);

  /// Distance from the middle of a cell, or from a point, to the nearest cell that is not free; 0 outside of the grid.
  [[nodiscard]] double clearance_m(int row, int column) const;
  [[nodiscard]] double clearance_m(const FloorPoint& point) const;
  [[nodiscard]] FloorPoint middle_of(int row, int column) const { return {x_m(column + 0.5), y_m(row + 0.5)}; }

  /// The cells where the robot's axis can be and that are connected with `start`.
  [[nodiscard]] cv::Mat reachable_from(const FloorPoint& start) const;
  /// The rectangle around the cells of a mask, `margin_m` larger, within the grid.
  [[nodiscard]] Bounds bounds_of(const cv::Mat& mask, double margin_m) const;
  /// Returns obstacles that lie in the rectangle at least in part, the floor's edges among them.
  [[nodiscard]] std::vector<FoundObstacle> obstacles_in(const Bounds& bounds) const;

 private:
  void add_solid(const SceneGeometry& geometry, const WorldFrame& frame, std::size_t solid);
  /// @param box of cells that `cells` covers
  void keep_within(cv::Mat& cells, const Bounds& bounds) const;
  static void fill_small_holes(cv::Mat& cells);
  void add_cells(cv::Mat cells, const cv::Rect& box, const std::string& what);
  void mark(const config::Obstacle& obstacle);
  [[nodiscard]] std::vector<FoundObstacle> rectangles_of(cv::Mat cells, const cv::Point& corner,
                                                         const std::string& what) const;
  [[nodiscard]] double x_m(double column) const { return low_.x_m + kCell_m * column; }
  [[nodiscard]] double y_m(double row) const { return low_.y_m + kCell_m * row; }

  FloorPoint low_;                        // corner of the grid
  cv::Mat floorless_;                     // 8-bit, 255: there is no floor
  cv::Mat occupied_;                      // 8-bit, 255: a solid or a landmark is there
  cv::Mat clearance_;                     // to the next cell that is not free, in cells
  std::vector<FoundObstacle> obstacles_;  // of solids
};

/// Returns the scene's cylinders that vision can use, on the floor and within the grid.
std::vector<FoundLandmark> scene_landmarks(const SceneGeometry& geometry, const WorldFrame& frame,
                                           const FloorPoint& centre, std::vector<std::size_t>& solids,
                                           std::vector<std::string>& warnings);
/// Returns whether the robot at `from` sees the landmark's top in both mirrors.
bool sees(const SceneGeometry& geometry, const WorldFrame& frame, const FloorPoint& from, const Landmark& landmark);
/// Returns landmarks to be added around the start, in hues that are not among the scene's; as many as have room.
std::vector<FoundLandmark> added_landmarks(const SceneGeometry& geometry, const WorldFrame& frame,
                                           const FloorGrid& grid, const FloorPoint& start,
                                           const std::vector<FoundLandmark>& present,
                                           std::vector<std::string>& warnings);

}  // namespace twocone::new_scene
