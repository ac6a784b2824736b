// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace twocone::sim_povray {

/// Length of the history of poses that a world stores, in addition to its last step.
constexpr double kMaxStampLate_s = 0.5;

/// Deviations of a simulated camera from an ideal one. Zero or empty: the effect is off and costs no time.
struct CameraEffects {
  double gain = 1;                  ///< exposure and gain: factor on linear light, > 0
  double full_well_electrons = 0;   ///< shot noise: electrons of a full-scale pixel, >= 0
  double read_noise_electrons = 0;  ///< standard deviation, >= 0; needs full_well_electrons
  double vignetting = 0;            ///< share of light lost in the corners, 0 to 1; grows as the radius squared
  double defocus_px = 0;            ///< radius of the circle of confusion, >= 0
  double exposure_time_s = 0;       ///< shutter time, >= 0: motion blur
  double readout_s = 0;             ///< from the first row's exposure to the last row's, >= 0: rolling shutter
  int shutter_samples = 8;          ///< renderings per image with motion blur or rolling shutter, 2 to 64
  /// k1 k2 p1 p2 [k3] of OpenCV's lens model about the image's centre, with focal length distortion_focal_px; empty: no
  /// distortion.
  std::vector<double> distortion{};
  double distortion_focal_px = 0;  ///< > 0 if there is a distortion
  double drop_probability = 0;     ///< that a frame is lost, 0 to < 1
  double late_probability = 0;     ///< that a frame arrives one period late, 0 to < 1
  /// Delay of the stamp against the exposure: the image is older than its stamp states, and nothing reports this to the
  /// program. In one camera of a pair it acts as a hidden skew, in both as a latency. 0 to kMaxStampLate_s; 0: none.
  double stamp_late_s = 0;

  friend bool operator==(const CameraEffects&, const CameraEffects&) = default;
};

/// Settings of a camera of the scene in addition to CameraSettings.
struct ViewSettings {
  std::string camera_name;  ///< `lower`, `upper`: its `//*PMName`, without the robot's name
  /// Rays per pixel side, 1 to 9, on a regular grid, wherever a pixel differs from its neighbours by more than 0.03
  /// (POV-Ray's +AM1 +A0.03 +R). 1: one ray through the pixel's centre, no anti-aliasing. Cost at 640 x 480: 0.3 s for
  /// 1, 1 s for 3.
  int antialias = 1;
  CameraEffects effects{};
};

/// @throws std::invalid_argument naming every bad field
void check(const ViewSettings& settings);

}  // namespace twocone::sim_povray
