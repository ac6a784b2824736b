// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

/// Finds landmarks that no map lists: first the hues that stand out, then rough sightings of each thing of such a hue,
/// and of each thing with bands.
namespace twocone::vision {

/// An image of a mirror, and where the mirror is in it.
struct MirrorImage {
  cv::Mat rgb;  ///< CV_8UC3, r g b, sRGB-coded
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double rim_radius_px = 0;  ///< > 0
};

/// Returns the vivid colours that mirrors show (HueLabels: saturation and brightness), linear rgb with a greatest
/// component of 1, by hue from red on. Hues nearer to each other than HueLabels::kHueWindow_rad are one. A colour
/// counts from a mean of kLeastHueShare of an image's mirror on, in the images that show it most.
/// @throws std::invalid_argument for an image of another type
std::vector<Eigen::Vector3d> find_hues(const std::vector<MirrorImage>& images);

/// From this number of banded landmarks on, things of vivid colours are no landmarks: bands stand in rooms that are
/// full of colours.
constexpr std::size_t kBandsAlone = 3;

/// Returns a landmark with the colour or the bands of a RoughLandmark::hue. Bands have cells of the size that
/// Bands::cell_m has by itself.
Landmark looking_like(std::size_t hue, const std::vector<Eigen::Vector3d>& colours);
/// Returns "red", or "bands.7" of a banded landmark.
std::string looks_of(const Landmark& landmark);

/// Finds things of given hues, and banded ones, in both views of a frame.
///
/// Candidates of one hue in the two views are paired where their rays meet: the nearest bearings first, each candidate
/// once. The height of the top is unknown, so that the range is that of the disparity. Things that the rim cuts, that
/// one view alone shows, or that are too far for the disparity, are left out.
class LandmarkSearch {
 public:
  /// @param colours linear rgb, with a hue each; none: banded things alone @param errors of the rig; they count where
  /// the rays of views are compared
  /// @throws std::invalid_argument for colours without hue or sizes that are not > 0
  LandmarkSearch(const Rig& rig, const std::vector<Eigen::Vector3d>& colours, cv::Size lower_size, cv::Size upper_size,
                 const BeliefErrors& errors = {});
  ~LandmarkSearch();
  LandmarkSearch(LandmarkSearch&&) noexcept;
  LandmarkSearch& operator=(LandmarkSearch&&) noexcept;

  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  /// @param motion nothing: the body stands
  [[nodiscard]] std::vector<RoughLandmark> look(const cv::Mat& lower, const cv::Mat& upper,
                                                const std::optional<FrameMotion>& motion = {}) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace twocone::vision
