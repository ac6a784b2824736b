// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/mirror_view.h"

/// Makes images of upright cylinders in a mirror without POV-Ray. The coverage of each pixel is exact, so an edge's
/// position is known far more accurately than any method under test can find it. This is fast enough for thousands of
/// images.
namespace twocone::testing_support {

/// An upright cylinder on the floor, body frame.
struct SyntheticLandmark {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double radius_m = 0;                               ///< > 0
  double top_m = 0;                                  ///< over the floor; a view may look up or down at it
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();  ///< linear rgb, 0 to 1
};

/// A flat upright strip that hides the objects behind it, as a mast does: at a right angle to its bearing, from floor
/// to sky.
struct SyntheticStrip {
  double bearing_rad = 0;   ///< body frame
  double distance_m = 0;    ///< from the body's origin, > 0
  double half_width_m = 0;  ///< > 0
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
};

/// The background, infinitely far away; a function of the ray's bearing and elevation, linear grey:
///
///     level (1 + swing cos(bearing - swing_bearing)) + rise tan(elevation), times (1 - contrast) in every other
///     cell of a chequer of `cells` pairs round the horizon, whose cells are square where the elevation is low.
struct SyntheticBackground {
  double level = 0.55;
  double swing = 0;
  double swing_bearing_rad = 0;
  double rise = 0;
  int cells = 0;        ///< 0: no chequer
  double contrast = 0;  ///< 0 to 1
};

/// A landmark's brightness: colour times ambient + diffuse max(0, cos(bearing of the normal - light_bearing)); that of
/// its top, where a view looks down at it: colour times top.
struct SyntheticShading {
  double ambient = 0.7;
  double diffuse = 0.3;
  double light_bearing_rad = 0;
  double top = 0.85;
};

struct SyntheticScene {
  std::vector<SyntheticLandmark> landmarks;  ///< those nearer to the body's origin hide the others
  std::vector<SyntheticStrip> strips;
  SyntheticShading shading;
};

/// Returns the landmarks in the frame of a body at that pose.
std::vector<SyntheticLandmark> seen_from(const std::vector<SyntheticLandmark>& in_world, const Eigen::Vector2d& body_m,
                                         double heading_rad);

/// The camera's model: it clips `gain` times the light at 1, codes it by sRGB, adds noise and rounds to 8 bits.
struct SyntheticCamera {
  double gain = 1;
  double noise_grey_levels = 0;  ///< standard deviation, of each of r, g and b, after coding
};

/// One mirror with its camera and background, and the data that are the same in every image of it.
///
/// Coverage: a pixel that an outline may cross is cut into cells of a quarter of a pixel or less. In each cell, the
/// outline is approximated by the straight line that follows from the distances of rays to it, shifted by the effect of
/// its curvature. The sides have two lines, so a landmark narrower than a cell is correct too. The error is below
/// 1/512 of a pixel for outlines whose radius of curvature is at least a pixel (Coverage.IsThatOfManySamples). Within
/// kTipZone_px of the tip, where all bearings meet, 32 x 32 samples are taken instead. Shading and background are
/// sampled at the cells' middles; in pixels without cells once, a chequer 4 x 4 times. Beyond the rim all is black, and
/// pixels on the rim are mixtures.
class SyntheticView {
 public:
  static constexpr double kTipZone_px = 3;

  /// @throws std::invalid_argument for a size that is not positive
  SyntheticView(const vision::MirrorView& view, const cv::Size& size, const SyntheticBackground& background = {});

  /// Returns the mean light of each pixel: CV_32FC3, linear r g b, 1 is full scale.
  /// @throws std::invalid_argument for a landmark or strip outside its domain, and for one that extends over the mirror
  [[nodiscard]] cv::Mat light(const SyntheticScene& scene) const;

  /// Returns the share of each pixel that shows landmark `k`, without hidden parts: CV_32F.
  [[nodiscard]] cv::Mat coverage(const SyntheticScene& scene, std::size_t k) const;

  /// Returns the image, CV_8UC3, r g b, sRGB-coded. The noise is Gaussian, cut off at 4.3 times its deviation.
  [[nodiscard]] cv::Mat image(const SyntheticScene& scene, const SyntheticCamera& camera,
                              std::mt19937_64& random) const;

  /// A ray in plan view: from `from_m`, along the unit vector `along`, rising by `climb` metres per metre.
  struct PlanRay {
    Eigen::Vector2d from_m;
    double from_up_m;
    Eigen::Vector2d along;
    double climb;
  };

 private:
  struct Surface;
  [[nodiscard]] std::vector<Surface> surfaces_of(const SyntheticScene& scene) const;
  [[nodiscard]] std::optional<PlanRay> ray_at(double column, double row) const;
  [[nodiscard]] double background_at(const PlanRay& ray) const;
  void fill_background();
  void paint(const std::vector<Surface>& surfaces, cv::Mat& light) const;
  void paint_pixel(const std::vector<const Surface*>& crossing, int column, int row, cv::Vec3f& pixel) const;
  void paint_tip_pixel(const std::vector<Surface>& surfaces, std::size_t tip_pixel, cv::Vec3f& pixel) const;

  vision::MirrorView view_;   ///< the view given to the constructor
  vision::MirrorView wider_;  ///< the same cone and lens with a wider rim, for rays just beyond it
  cv::Size size_;
  SyntheticBackground background_;
  Eigen::Vector2d centre_px_;       ///< of the tip in the camera's image
  cv::Mat empty_;                   ///< CV_32FC3: the image without landmarks
  std::vector<std::int8_t> kind_;   ///< of each pixel: outside, inside, on the rim, at the tip
  std::vector<PlanRay> centres_;    ///< of each pixel
  std::vector<PlanRay> corners_;    ///< (width + 1) x (height + 1)
  std::vector<float> breadth_rad_;  ///< of each pixel: an upper bound of half the range of bearings that it spans
  std::vector<PlanRay> tip_rays_;   ///< of the pixels at the tip, sample by sample
};

}  // namespace twocone::testing_support
