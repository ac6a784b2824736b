// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "tests/support/synthetic_view.h"
#include "vision/bands/band_code.h"
#include "vision/ranging.h"

/// Banded pipes in images with exactly known pixels (tests/support/synthetic_view.h).
namespace twocone::testing_support {

constexpr double kLine_m = 0.898;
constexpr double kPipeRadius_m = 0.055;
constexpr double kLight = 0.7;
constexpr double kDark = 0.04;

inline Landmark banded(int number, const Eigen::Vector2d& place_m, double cell_m = Bands{}.cell_m) {
  return {.name = "bands." + std::to_string(number),
          .x_m = place_m.x(),
          .y_m = place_m.y(),
          .radius_m = kPipeRadius_m,
          .top_m = kLine_m,
          .bands = Bands{number, cell_m}};
}

/// A banded pipe: one cylinder within the other, each lower one a hair nearer, so that it hides the one above below its
/// own top.
inline std::vector<SyntheticLandmark> pipe_of(const Landmark& landmark) {
  std::vector<SyntheticLandmark> cylinders;
  const double cell_m = landmark.bands->cell_m;
  const double top_m = landmark.top_m + double(vision::kCellsOverLine) * cell_m;
  const vision::BandCells cells = vision::band_cells(landmark.bands->number);
  const Eigen::Vector2d towards = -vision::place_m(landmark).normalized();
  for (std::size_t k = 0; k <= vision::kBandCells; ++k) {
    const double grey = k == vision::kBandCells ? 0.3 : cells[k] ? kLight : kDark;
    if (k > 0 && k < vision::kBandCells && cells[k] == cells[k - 1]) continue;
    cylinders.push_back({vision::place_m(landmark) + 1e-8 * double(k) * towards, landmark.radius_m,
                         top_m - double(k) * cell_m, Eigen::Vector3d::Constant(grey)});
  }
  return cylinders;
}

inline SyntheticScene scene_of(const std::vector<Landmark>& landmarks) {
  SyntheticScene scene;
  for (const Landmark& landmark : landmarks) {
    const auto pipe = pipe_of(landmark);
    scene.landmarks.insert(scene.landmarks.end(), pipe.begin(), pipe.end());
  }
  return scene;
}

}  // namespace twocone::testing_support
