// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/new_scene/parts.h"

namespace twocone::new_scene {
namespace {

/// Heights at which a cell is searched for walls, as shares of the robot's height.
constexpr std::array kShares{0.03, 0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0};
/// A hull that covers so much more than its solid's cells hides floor: rectangles serve instead.
constexpr double kLoosest = 1.2;
/// Cells at a hull's slanted edges are covered in part.
constexpr double kLooseCells = 4;

/// Answers whether a solid is in a cell, from the floor to the robot's top.
class CellTest {
 public:
  CellTest(const SceneGeometry& geometry, const WorldFrame& frame, std::size_t solid)
      : geometry_(geometry), frame_(frame), solid_(solid) {
    // What is infinite or around the camera is seen from inside: a wall, a sky, a room.
    const auto& camera = geometry.camera();
    is_filled_ = geometry.solids()[solid].bounds.has_value() && !(camera && geometry.contains(solid, camera->location));
  }

  [[nodiscard]] bool operator()(double x_m, double y_m) const {
    constexpr double kSide = FloorGrid::kCell_m;
    const auto at = [&](double east, double north, double height_m) {
      return frame_.scene(x_m + kSide * east, y_m + kSide * north, height_m);
    };
    for (const double share : kShares) {
      const double height_m = share * StandardRobot::kHeight_m;
      if (is_filled_ && geometry_.contains(solid_, at(0.5, 0.5, height_m))) return true;
      // The diagonals cross every wall through the cell but one that cuts off a corner.
      if (geometry_.crosses(solid_, at(0, 0, height_m), at(1, 1, height_m))) return true;
      if (geometry_.crosses(solid_, at(0, 1, height_m), at(1, 0, height_m))) return true;
    }
    for (const double east : {0.17, 0.5, 0.83}) {
      for (const double north : {0.17, 0.5, 0.83}) {
        const Vec3 low = at(east, north, FloorGrid::kLow_m);
        if (geometry_.crosses(solid_, low, at(east, north, StandardRobot::kHeight_m))) return true;
      }
    }
    return false;
  }

 private:
  const SceneGeometry& geometry_;
  const WorldFrame& frame_;
  std::size_t solid_;
  bool is_filled_;
};

bool is_in(const config::Obstacle& obstacle, const FloorPoint& p) {
  if (const auto* disc = std::get_if<Disc>(&obstacle)) {
    return std::hypot(p.x_m - disc->centre.x_m, p.y_m - disc->centre.y_m) <= disc->radius_m;
  }
  const auto& corners = std::get<config::Polygon>(obstacle);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const FloorPoint& a = corners[i];
    const FloorPoint& b = corners[(i + 1) % corners.size()];
    if ((b.x_m - a.x_m) * (p.y_m - a.y_m) - (b.y_m - a.y_m) * (p.x_m - a.x_m) < -1e-9) return false;
  }
  return true;
}

Bounds bounds_of(const config::Obstacle& obstacle) {
  if (const auto* disc = std::get_if<Disc>(&obstacle)) {
    return {disc->centre.x_m - disc->radius_m, disc->centre.x_m + disc->radius_m, disc->centre.y_m - disc->radius_m,
            disc->centre.y_m + disc->radius_m};
  }
  const auto& corners = std::get<config::Polygon>(obstacle);
  Bounds bounds{corners[0].x_m, corners[0].x_m, corners[0].y_m, corners[0].y_m};
  for (const FloorPoint& p : corners) {
    bounds = {std::min(bounds.min_x_m, p.x_m), std::max(bounds.max_x_m, p.x_m), std::min(bounds.min_y_m, p.y_m),
              std::max(bounds.max_y_m, p.y_m)};
  }
  return bounds;
}

/// Returns whether `inner` is certainly within `outer`.
bool holds(const config::Obstacle& outer, const config::Obstacle& inner) {
  if (const auto* corners = std::get_if<config::Polygon>(&inner)) {
    return std::ranges::all_of(*corners, [&](const FloorPoint& p) { return is_in(outer, p); });
  }
  const Bounds box = bounds_of(inner);
  return is_in(outer, {box.min_x_m, box.min_y_m}) && is_in(outer, {box.max_x_m, box.min_y_m}) &&
         is_in(outer, {box.min_x_m, box.max_y_m}) && is_in(outer, {box.max_x_m, box.max_y_m});
}

double area_m2(const Bounds& bounds) { return (bounds.max_x_m - bounds.min_x_m) * (bounds.max_y_m - bounds.min_y_m); }

}  // namespace

FloorGrid::FloorGrid(const SceneGeometry& geometry, const WorldFrame& frame, const FloorPoint& centre,
                     const std::vector<std::size_t>& landmarks)
    : low_{centre.x_m - kCells * kCell_m / 2, centre.y_m - kCells * kCell_m / 2},
      floorless_(kCells, kCells, CV_8U, cv::Scalar(0)),
      occupied_(kCells, kCells, CV_8U, cv::Scalar(0)) {
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const FloorPoint p = middle_of(row, column);
      const auto met = geometry.nearest(frame.scene(p.x_m, p.y_m, kLow_m), {0, -1, 0}, 2 * kLow_m / frame.unit_m);
      if (!met) floorless_.at<uchar>(row, column) = 255;
    }
  }
  for (std::size_t solid = 0; solid < geometry.solids().size(); ++solid) {
    if (std::ranges::find(landmarks, solid) == landmarks.end()) add_solid(geometry, frame, solid);
  }
  for (const auto& cylinder : geometry.cylinders()) {
    if (std::ranges::find(landmarks, cylinder.solid) == landmarks.end()) continue;
    mark(Disc{{cylinder.base.x * frame.unit_m, cylinder.base.z * frame.unit_m}, cylinder.radius * frame.unit_m});
  }
  // Nothing is known of what is beyond the grid.
  cv::Mat free = (occupied_ | floorless_) == 0;
  cv::copyMakeBorder(free, free, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(free, clearance_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  clearance_ = clearance_(cv::Rect(1, 1, kCells, kCells)).clone();
}

void FloorGrid::add_solid(const SceneGeometry& geometry, const WorldFrame& frame, std::size_t solid) {
  const auto& [kind, place, bounds] = geometry.solids()[solid];
  const std::string what = fmt::format("{}, {}", kind, place);
  cv::Rect box(0, 0, kCells, kCells);
  if (bounds) {
    const auto z_m = [&](double y) { return (y - frame.floor) * frame.unit_m; };
    if (z_m(bounds->high.y) <= kLow_m || z_m(bounds->low.y) >= StandardRobot::kHeight_m) return;
    const auto cell = [](double value, double low) {
      return int(std::floor(std::clamp((value - low) / kCell_m, -1.0, kCells + 1.0)));
    };
    const cv::Point from(cell(bounds->low.x * frame.unit_m, low_.x_m), cell(bounds->low.z * frame.unit_m, low_.y_m));
    const cv::Point to(cell(bounds->high.x * frame.unit_m, low_.x_m), cell(bounds->high.z * frame.unit_m, low_.y_m));
    box &= cv::Rect(from, to + cv::Point(1, 1));
    if (box.empty()) return;
    for (const auto& cylinder : geometry.cylinders()) {
      if (cylinder.solid != solid) continue;
      obstacles_.push_back(
          {Disc{{cylinder.base.x * frame.unit_m, cylinder.base.z * frame.unit_m}, cylinder.radius * frame.unit_m},
           what});
      mark(obstacles_.back().obstacle);
      return;
    }
  }
  cv::Mat cells(box.size(), CV_8U, cv::Scalar(0));
  // The samples of a cell could miss what is thinner than it.
  const bool is_small = bounds && (bounds->high.x - bounds->low.x) * frame.unit_m <= 2 * kCell_m &&
                        (bounds->high.z - bounds->low.z) * frame.unit_m <= 2 * kCell_m;
  const CellTest is_there(geometry, frame, solid);
  for (int row = 0; row < box.height; ++row) {
    for (int column = 0; column < box.width; ++column) {
      if (is_small || is_there(x_m(box.x + column), y_m(box.y + row))) cells.at<uchar>(row, column) = 255;
    }
  }
  add_cells(cells, box, what);
}

/// Fills the holes of a shape in which no robot fits: that of a torus, but not the inside of a room.
void FloorGrid::fill_small_holes(cv::Mat& cells) {
  cv::Mat outside;
  cv::copyMakeBorder(cells == 0, outside, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::Mat depth;
  cv::distanceTransform(outside, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat labels;
  const int count = cv::connectedComponents(outside, labels, 4, CV_32S);
  for (int label = 1; label < count; ++label) {
    if (label == labels.at<int>(0, 0)) continue;
    const cv::Mat hole = labels == label;
    double most = 0;
    cv::minMaxLoc(depth, nullptr, &most, nullptr, nullptr, hole);
    if (most * kCell_m > StandardRobot::kRadius_m) continue;
    cells.setTo(255, hole(cv::Rect(1, 1, cells.cols, cells.rows)));
  }
}

void FloorGrid::add_cells(cv::Mat cells, const cv::Rect& box, const std::string& what) {
  fill_small_holes(cells);
  cv::Mat labels;
  const int count = cv::connectedComponents(cells, labels, 8, CV_32S);
  for (int label = 1; label < count; ++label) {
    const cv::Mat part = labels == label;
    std::vector<cv::Point> corners;
    std::vector<cv::Point> hull;
    for (int row = 0; row < part.rows; ++row) {
      for (int column = 0; column < part.cols; ++column) {
        if (part.at<uchar>(row, column) == 0) continue;
        for (const cv::Point& corner : {cv::Point(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
          corners.push_back(corner + cv::Point(box.x + column, box.y + row));
        }
      }
    }
    cv::convexHull(corners, hull, false);
    std::vector<FoundObstacle> found;
    if (cv::contourArea(hull) <= kLoosest * cv::countNonZero(part) + kLooseCells) {
      config::Polygon polygon;
      for (const cv::Point& p : hull) polygon.push_back({x_m(p.x), y_m(p.y)});
      found.push_back({std::move(polygon), what});
    } else {
      found = rectangles_of(part.clone(), box.tl(), what);
    }
    for (FoundObstacle& obstacle : found) {
      mark(obstacle.obstacle);
      obstacles_.push_back(std::move(obstacle));
    }
  }
}

void FloorGrid::mark(const config::Obstacle& obstacle) {
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      if (is_in(obstacle, middle_of(row, column))) occupied_.at<uchar>(row, column) = 255;
    }
  }
}

std::vector<FoundObstacle> FloorGrid::rectangles_of(cv::Mat cells, const cv::Point& corner,
                                                    const std::string& what) const {
  std::vector<FoundObstacle> result;
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.cols; ++column) {
      if (cells.at<uchar>(row, column) == 0) continue;
      int width = 1;
      while (column + width < cells.cols && cells.at<uchar>(row, column + width) != 0) ++width;
      int height = 1;
      while (row + height < cells.rows && cv::countNonZero(cells(cv::Rect(column, row + height, width, 1))) == width) {
        ++height;
      }
      cells(cv::Rect(column, row, width, height)) = cv::Scalar(0);
      const double west = x_m(corner.x + column), east = x_m(corner.x + column + width);
      const double south = y_m(corner.y + row), north = y_m(corner.y + row + height);
      result.push_back({config::Polygon{{west, south}, {east, south}, {east, north}, {west, north}}, what});
    }
  }
  return result;
}

double FloorGrid::clearance_m(int row, int column) const {
  // From the middle of a cell to the edge of the other.
  return std::max(0.0, kCell_m * (double(clearance_.at<float>(row, column)) - 0.5));
}

double FloorGrid::clearance_m(const FloorPoint& point) const {
  const int row = int(std::floor((point.y_m - low_.y_m) / kCell_m));
  const int column = int(std::floor((point.x_m - low_.x_m) / kCell_m));
  if (row < 0 || column < 0 || row >= kCells || column >= kCells) return 0;
  return clearance_m(row, column);
}

cv::Mat FloorGrid::reachable_from(const FloorPoint& start) const {
  const cv::Mat wide = clearance_ > StandardRobot::kRadius_m / kCell_m + 0.5;
  cv::Mat labels;
  cv::connectedComponents(wide, labels, 4, CV_32S);
  const int row = int(std::floor((start.y_m - low_.y_m) / kCell_m));
  const int column = int(std::floor((start.x_m - low_.x_m) / kCell_m));
  return (labels == labels.at<int>(row, column)) & wide;
}

Bounds FloorGrid::bounds_of(const cv::Mat& mask, double margin_m) const {
  const cv::Rect box = cv::boundingRect(mask);
  return {std::max(x_m(0), x_m(box.x) - margin_m), std::min(x_m(kCells), x_m(box.x + box.width) + margin_m),
          std::max(y_m(0), y_m(box.y) - margin_m), std::min(y_m(kCells), y_m(box.y + box.height) + margin_m)};
}

/// Clears the cells outside of a rectangle.
void FloorGrid::keep_within(cv::Mat& cells, const Bounds& bounds) const {
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const FloorPoint p = middle_of(row, column);
      const bool is_near =
          p.x_m > bounds.min_x_m && p.x_m < bounds.max_x_m && p.y_m > bounds.min_y_m && p.y_m < bounds.max_y_m;
      if (!is_near) cells.at<uchar>(row, column) = 0;
    }
  }
}

std::vector<FoundObstacle> FloorGrid::obstacles_in(const Bounds& bounds) const {
  std::vector<FoundObstacle> all = obstacles_;
  // The floor's edges: cells without floor that no solid covers.
  cv::Mat edges = floorless_ & (occupied_ == 0);
  keep_within(edges, bounds);
  std::ranges::move(rectangles_of(edges, {0, 0}, "no floor"), std::back_inserter(all));
  std::erase_if(all, [&](const FoundObstacle& found) {
    const Bounds box = new_scene::bounds_of(found.obstacle);
    return box.max_x_m <= bounds.min_x_m || box.min_x_m >= bounds.max_x_m || box.max_y_m <= bounds.min_y_m ||
           box.min_y_m >= bounds.max_y_m;
  });
  std::ranges::stable_sort(all, std::ranges::greater{},
                           [](const FoundObstacle& found) { return area_m2(new_scene::bounds_of(found.obstacle)); });
  std::vector<FoundObstacle> result;
  for (FoundObstacle& found : all) {
    const bool is_covered = std::ranges::any_of(
        result, [&](const FoundObstacle& larger) { return holds(larger.obstacle, found.obstacle); });
    if (!is_covered) result.push_back(std::move(found));
  }
  // A robot's way is checked against each of them.
  constexpr std::size_t kMost = 200;
  if (result.size() <= kMost) return result;
  cv::Mat all_cells = occupied_ | floorless_;
  keep_within(all_cells, bounds);
  return rectangles_of(all_cells, {0, 0}, "several things");
}

}  // namespace twocone::new_scene
