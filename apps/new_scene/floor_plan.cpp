// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/new_scene/parts.h"

namespace twocone::new_scene {
namespace {

/// Without a camera, the open is far above everything that a robot could meet.
constexpr double kHigh_m = 1e4;

}  // namespace

FloorPlan::FloorPlan(const SceneGeometry& geometry, const FloorPoint& centre,
                     const std::vector<FoundLandmark>& landmarks)
    : grid_{{centre.x_m - kCells * kCell_m / 2, centre.y_m - kCells * kCell_m / 2}, kCell_m, kCells, kCells},
      floorless_(kCells, kCells, uchar{0}),
      occupied_(kCells, kCells, uchar{0}) {
  for (std::size_t i = 0; i < grid_.size(); ++i) {
    const FloorPoint p = grid_.centre(i);
    if (!geometry.cast({p.x_m, p.y_m, kLow_m}, {0, 0, -1}, 2 * kLow_m)) floorless_.data[i] = 255;
  }
  const auto camera = geometry.camera();
  const Vec3 air = camera ? camera->location : Vec3{centre.x_m, centre.y_m, kHigh_m};
  struct Found {
    int object;
    cv::Mat1b cells;
    int count;
  };
  std::vector<Found> all;
  for (int object = 0; object < int(geometry.objects().size()); ++object) {
    if (!geometry.objects()[std::size_t(object)].is_still) continue;
    std::vector<std::uint8_t> bytes = geometry.cells_of(object, grid_, kLow_m, StandardRobot::kHeight_m, air);
    const cv::Mat1b cells(kCells, kCells, bytes.data());
    if (std::ranges::find(landmarks, object, &FoundLandmark::object) != landmarks.end()) {
      occupied_ |= cells;
    } else if (const int count = cv::countNonZero(cells); count > 0) {
      all.push_back({object, cells.clone(), count});
    }
  }
  // What is within the cells of a larger object is no obstacle of its own.
  std::ranges::stable_sort(all, std::ranges::greater{}, &Found::count);
  cv::Mat1b covered(kCells, kCells, uchar{0});
  for (const Found& found : all) {
    const sim_povray::SceneObject& object = geometry.objects()[std::size_t(found.object)];
    add(found.cells, covered, fmt::format("{}, {}", object.kind, object.place()));
  }
  // Nothing is known of what is beyond the grid.
  cv::Mat free = (occupied_ | floorless_) == 0;
  cv::copyMakeBorder(free, free, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(free, clearance_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  clearance_ = clearance_(cv::Rect(1, 1, kCells, kCells)).clone();
}

void FloorPlan::add(const cv::Mat1b& cells, cv::Mat1b& covered, const std::string& what) {
  cv::Mat1i labels;
  const int count = cv::connectedComponents(cells, labels, 8);
  for (int label = 1; label < count; ++label) {
    const cv::Mat1b part(labels == label);
    if (cv::countNonZero(part & ~covered) == 0) continue;
    covered |= part;
    std::vector<cv::Point> places, hull;
    cv::findNonZero(part, places);
    cv::convexHull(places, hull);
    cv::Mat1b within(kCells, kCells, uchar{0});
    cv::fillConvexPoly(within, hull, cv::Scalar(255));
    // A hull hides floor if the robot's axis could be in it; rectangles serve instead.
    cv::Mat1f away;
    cv::distanceTransform(part == 0, away, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    double most = 0;
    cv::minMaxLoc(away, nullptr, &most, nullptr, nullptr, within);
    if (kCell_m * (most - 0.5) > StandardRobot::kRadius_m) {
      occupied_ |= part;
      std::ranges::move(rectangles_of(part.clone(), what), std::back_inserter(obstacles_));
      continue;
    }
    occupied_ |= within;
    std::vector<cv::Point> corners;
    for (const cv::Point& place : places) {
      for (const cv::Point& corner : {cv::Point(0, 0), {1, 0}, {1, 1}, {0, 1}}) corners.push_back(place + corner);
    }
    cv::convexHull(corners, hull);
    FoundObstacle& obstacle = obstacles_.emplace_back(FoundObstacle{{}, what});
    for (const cv::Point& p : hull) obstacle.corners.push_back({x_m(p.x), y_m(p.y)});
  }
}

std::vector<FoundObstacle> FloorPlan::rectangles_of(cv::Mat1b cells, const std::string& what) const {
  std::vector<FoundObstacle> result;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      if (cells(row, column) == 0) continue;
      int width = 1;
      while (column + width < kCells && cells(row, column + width) != 0) ++width;
      int height = 1;
      while (row + height < kCells && cv::countNonZero(cells(cv::Rect(column, row + height, width, 1))) == width) {
        ++height;
      }
      cells(cv::Rect(column, row, width, height)) = 0;
      const double west = x_m(column), east = x_m(column + width);
      const double south = y_m(row), north = y_m(row + height);
      result.push_back({{{west, south}, {east, south}, {east, north}, {west, north}}, what});
    }
  }
  return result;
}

cv::Point FloorPlan::cell_at(const FloorPoint& point) const {
  return {int(std::floor((point.x_m - grid_.corner.x_m) / kCell_m)),
          int(std::floor((point.y_m - grid_.corner.y_m) / kCell_m))};
}

double FloorPlan::clearance_m(const FloorPoint& point) const {
  const cv::Point cell = cell_at(point);
  if (!cv::Rect(0, 0, kCells, kCells).contains(cell)) return 0;
  // From the middle of a cell to the edge of the other.
  return std::max(0.0, kCell_m * (double(clearance_(cell)) - 0.5));
}

cv::Mat1b FloorPlan::reachable_from(const FloorPoint& start) const {
  const cv::Mat1b wide(clearance_ > StandardRobot::kRadius_m / kCell_m + 0.5);
  cv::Mat1i labels;
  cv::connectedComponents(wide, labels, 4);
  return cv::Mat1b((labels == labels(cell_at(start))) & wide);
}

Bounds FloorPlan::bounds_of(const cv::Mat1b& mask, double margin_m) const {
  const cv::Rect box = cv::boundingRect(mask);
  return {std::max(x_m(0), x_m(box.x) - margin_m), std::min(x_m(kCells), x_m(box.x + box.width) + margin_m),
          std::max(y_m(0), y_m(box.y) - margin_m), std::min(y_m(kCells), y_m(box.y + box.height) + margin_m)};
}

std::vector<FoundObstacle> FloorPlan::obstacles_in(const Bounds& bounds) const {
  const auto within = [&](cv::Mat1b cells) {
    for (std::size_t i = 0; i < grid_.size(); ++i) {
      const FloorPoint p = grid_.centre(i);
      const bool is_near =
          p.x_m > bounds.min_x_m && p.x_m < bounds.max_x_m && p.y_m > bounds.min_y_m && p.y_m < bounds.max_y_m;
      if (!is_near) cells.data[i] = 0;
    }
    return cells;
  };
  std::vector<FoundObstacle> result = obstacles_;
  std::erase_if(result, [&](const FoundObstacle& found) {
    const auto are_all = [&](auto is_beyond) { return std::ranges::all_of(found.corners, is_beyond); };
    return are_all([&](const FloorPoint& p) { return p.x_m <= bounds.min_x_m; }) ||
           are_all([&](const FloorPoint& p) { return p.x_m >= bounds.max_x_m; }) ||
           are_all([&](const FloorPoint& p) { return p.y_m <= bounds.min_y_m; }) ||
           are_all([&](const FloorPoint& p) { return p.y_m >= bounds.max_y_m; });
  });
  // The floor's edges: cells without floor that no object covers.
  std::ranges::move(rectangles_of(within(cv::Mat1b(floorless_ & (occupied_ == 0))), "no floor"),
                    std::back_inserter(result));
  // A robot's way is checked against each of them.
  constexpr std::size_t kMost = 200;
  if (result.size() <= kMost) return result;
  return rectangles_of(within(cv::Mat1b(occupied_ | floorless_)), "several things");
}

}  // namespace twocone::new_scene
