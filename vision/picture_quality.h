// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

/// How a camera's pictures differ from another's, apart from what they show: noise, colour and brightness, sharpness.
/// All pictures are CV_8UC3, r g b, sRGB-coded; light is linear, 0 to 1 (full scale). Nothing needs to be known about
/// the scene, but it must have plain places (noise, transfer) and sharp edges (sharpness).
/// Every function throws std::invalid_argument for another type of picture and for a region that is none.
namespace twocone::vision {

/// The ring of the picture to look at: the mirror without its rim, and without the camera's own image about the tip.
struct PictureRegion {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;  ///< of the rim, > 0
  double inner = 0.1;    ///< share of the radius, 0 to 1
  double outer = 0.97;   ///< share of the radius, above `inner`
};

// Noise ---------------------------------------------------------------------------------------------------------------

/// The noise's variance in linear light by level, of one picture or of many; its size does not grow with the pictures.
struct NoiseSamples {
  static constexpr std::size_t kBins = 16;    ///< of level, equally wide in sRGB code; all channels together
  static constexpr std::size_t kBlocks = 16;  ///< picture i of many is in block i modulo kBlocks
  struct Bin {
    double tiles = 0;     ///< places that were measured
    double level = 0;     ///< linear light, summed over them
    double variance = 0;  ///< in linear light, summed over them; rounding to 8 bits taken off, so it may be below 0
  };
  std::array<std::array<Bin, kBins>, kBlocks> blocks{};
  std::size_t pictures = 0;

  /// As if `later`'s pictures had come after these.
  void merge(const NoiseSamples& later);
};

/// Of one picture: in tiles of 5 x 5 px and each channel, the scatter in linear light about a plane (22 degrees of
/// freedom). Tiles with edges or texture are left out: those that are steep, which Gaussian noise's scatter does not
/// depend on, and those that scatter more than 95 % of plain ones would, for which the mean is corrected (chi square);
/// a level of which less than three fifths are plain is left out altogether. So are levels within 3 sigma of 0 and full
/// scale. White noise; what a camera has smoothed over more than 5 px is not seen.
NoiseSamples noise_samples(const cv::Mat& rgb, const PictureRegion& region);

/// variance(L) = shot L + read^2, L linear light: the camera stage of the simulator.
struct NoiseModel {
  double shot = 0;  ///< 1 / full well in electrons, >= 0
  double sigma_shot = 0;
  double read = 0;  ///< standard deviation, of full scale, >= 0
  double sigma_read = 0;
  double noise_grey = 0;  ///< standard deviation in grey levels at light kNoiseLevel, a mid grey (code 124)
  double sigma_noise_grey = 0;

  /// As the simulator's camera wants it; 0: no noise. Not above 1e6, so that there is something to tell `read` by.
  [[nodiscard]] double full_well_electrons() const;
  [[nodiscard]] double read_noise_electrons() const { return read * full_well_electrons(); }
};
constexpr double kNoiseLevel = 0.2;
/// What a plain place's own weak texture and shading may add, and 8 bits hide: in grey levels, and as a share of the
/// noise. Part of every sigma; the same in two pictures of one place. PictureNoise.* hold it.
constexpr double kNoiseFloor_grey = 0.1;
constexpr double kNoiseShare = 0.01;

/// Least squares, weighted by the variance of a variance. Sigmas: the jackknife over blocks of pictures, or what
/// Gaussian noise in that many tiles would give if that is more (so also for one picture).
/// Nothing where no level could be measured.
std::optional<NoiseModel> fit_noise(const NoiseSamples& samples);

// Colour and brightness -----------------------------------------------------------------------------------------------

/// real = simulated * exp(log_gain) * (1 - vignetting rho^2) in linear light, rho from the picture's middle, 1 at the
/// corner pixels' centres.
struct Transfer {
  std::array<double, 3> log_gain{};    ///< of r, g, b
  double vignetting = 0;               ///< below 0: brighter outwards
  std::array<std::size_t, 3> tiles{};  ///< that each channel was measured on
};

/// Of two pictures of the same place that need not match by a few pixels: over tiles of 8 x 8 px that are plain in
/// both, neither dark nor near full scale (judged by what the fit expects of them, so that noise selects nothing);
/// those that do not agree, as where a landmark has moved, are weighed down to nothing (Tukey).
/// The gain is that at rho = 0. Equal pictures: exactly 0. Nothing where a channel has fewer than 30 such tiles.
/// @throws std::invalid_argument also where sizes differ
std::optional<Transfer> transfer(const cv::Mat& simulated_rgb, const cv::Mat& real_rgb, const PictureRegion& region);

// Sharpness -----------------------------------------------------------------------------------------------------------

/// Standard deviation (px) by which edges are spread, the pixel's own square (1/12 px^2) counted: about 0.25 px
/// for points of an ideal picture, 0.4 px for pixels that hold the mean over their square. The median over strong
/// single edges.
///
/// With the picture smoothed by two Gaussians of variance a < b, an edge of spread v has steepnesses of ratio
/// R^2 = (b + v) / (a + v), so v = (b - R^2 a) / (R^2 - 1) (Zhuo and Sim 2011). Exact for Gaussian spread; a disc of
/// radius r adds r^2 / 4, from 2 px on somewhat less. Nothing where there are fewer than 30 edges.
std::optional<double> blur_px(const cv::Mat& rgb, const PictureRegion& region);

/// The simulator's `defocus_px` that takes one spread to the other: what blur_px() answers for such a disc is computed,
/// so that a disc's flat top is no error. 0 where `real_blur_px` is not the greater; at most 10.
double defocus_radius_px(double simulated_blur_px, double real_blur_px);

}  // namespace twocone::vision
