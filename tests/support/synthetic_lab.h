// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/synthetic_view.h"
#include "tests/vision/lab_rig.h"
#include "vision/mirror_view.h"
#include "vision/outline_ranging.h"

/// A room with six landmarks and the lab's rig, in images with exactly known pixels (tests/support/synthetic_view.h).
namespace twocone::testing_support {

inline SyntheticLandmark landmark(double x_m, double y_m, const Eigen::Vector3d& colour, double radius_m = 0.15) {
  return {{x_m, y_m}, radius_m, 0.9, colour};
}

/// Returns the landmarks in the world frame.
inline std::vector<SyntheticLandmark> six_landmarks() {
  return {landmark(-2.45, -0.35, {0.60, 0.02, 0.02}), landmark(-1.40, 1.95, {0.02, 0.60, 0.02}),
          landmark(1.50, 1.95, {0.02, 0.02, 0.60}),   landmark(2.45, 0.30, {0.02, 0.60, 0.60}),
          landmark(1.30, -1.95, {0.60, 0.02, 0.60}),  landmark(-1.50, -1.95, {0.60, 0.60, 0.02})};
}

inline std::vector<Landmark> targets_of(const std::vector<SyntheticLandmark>& landmarks) {
  std::vector<Landmark> targets;
  for (const SyntheticLandmark& l : landmarks) {
    const std::string name = "landmark " + std::to_string(targets.size() + 1);
    targets.push_back(
        {name, {l.colour[0], l.colour[1], l.colour[2]}, l.centre_m.x(), l.centre_m.y(), l.radius_m, l.top_m});
  }
  return targets;
}

/// Both mirrors of a rig, with one background.
struct SyntheticRig {
  vision::Rig rig;
  SyntheticView lower;
  SyntheticView upper;

  explicit SyntheticRig(const vision::Rig& r, const SyntheticBackground& background = {})
      : rig(r), lower(r.lower, vision::kImage, background), upper(r.upper, vision::kImage, background) {}

  struct Pair {
    cv::Mat lower, upper;
  };
  [[nodiscard]] Pair take(const SyntheticScene& scene, const SyntheticCamera& camera, std::mt19937_64& random) const {
    Pair pair;
    pair.lower = lower.image(scene, camera, random);
    pair.upper = upper.image(scene, camera, random);
    return pair;
  }
};

}  // namespace twocone::testing_support
