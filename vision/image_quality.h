// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

/// Measures the differences between the images of two cameras that do not come from the scene: noise, colour and
/// brightness, sharpness. All images are CV_8UC3, r g b, sRGB-coded; light is linear, 0 to 1 (full scale). The scene
/// need not be known, but it must have plain areas (noise, transfer) and sharp edges (sharpness).
/// Every function throws std::invalid_argument for another type of image and for an invalid region.
namespace twocone::vision {

/// The ring of the image that is measured: the mirror without its rim and without the camera's own reflection at the
/// tip.
struct ImageRegion {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;  ///< of the rim, > 0
  double inner = 0.1;    ///< share of the radius, 0 to 1
  double outer = 0.97;   ///< share of the radius, above `inner`
};

// Noise ---------------------------------------------------------------------------------------------------------------

/// The noise's variance in linear light by level, for one image or for many. Its size does not grow with their number.
struct NoiseSamples {
  static constexpr std::size_t kBins = 16;    ///< of level, equally wide in sRGB code; all channels together
  static constexpr std::size_t kBlocks = 16;  ///< image i of many is in block i modulo kBlocks
  struct Bin {
    double tiles = 0;     ///< number of tiles that were measured
    double level = 0;     ///< linear light, summed over the tiles
    double variance = 0;  ///< in linear light, summed over the tiles, minus that of rounding to 8 bits: may be below 0
  };
  std::array<std::array<Bin, kBins>, kBlocks> blocks{};
  std::size_t images = 0;

  /// Adds `later` as if its images had come after these.
  void merge(const NoiseSamples& later);
};

/// Measures the noise of one image: in tiles of 5 x 5 px and in each channel, the scatter in linear light about a plane
/// (22 degrees of freedom). Tiles with edges or texture are left out. These are steep tiles (the scatter of Gaussian
/// noise does not depend on the slope) and tiles that scatter more than 95 % of plain ones would; the mean is corrected
/// for the latter (chi square). A level is left out as a whole if less than three fifths of its tiles are plain, or if
/// it is within 3 sigma of 0 or of full scale. The noise is taken as white; noise that a camera has smoothed over more
/// than 5 px is not seen.
NoiseSamples noise_samples(const cv::Mat& rgb, const ImageRegion& region);

/// variance(L) = shot L + read^2, L linear light: the noise model of the simulator's camera stage.
struct NoiseModel {
  double shot = 0;  ///< 1 / full well in electrons, >= 0
  double sigma_shot = 0;
  double read = 0;  ///< standard deviation, of full scale, >= 0
  double sigma_read = 0;
  double noise_grey = 0;  ///< standard deviation in grey levels at light kNoiseLevel, a mid grey (code 124)
  double sigma_noise_grey = 0;

  /// Returns the full well for the simulator's camera; 0: no noise. It is at most 1e6, because `read` must still be
  /// expressed in electrons.
  [[nodiscard]] double full_well_electrons() const;
  [[nodiscard]] double read_noise_electrons() const { return read * full_well_electrons(); }
};
constexpr double kNoiseLevel = 0.2;
/// Error that weak texture and shading of a plain area may cause, hidden by 8 bits: in grey levels, and as a share of
/// the noise. It is part of every sigma, and it is the same in two images of one area. The tests ImageNoise.* check it.
constexpr double kNoiseFloor_grey = 0.1;
constexpr double kNoiseShare = 0.01;

/// Fits the model by least squares, weighted by the variance of a variance. Each sigma is the larger of two: that of
/// the jackknife over blocks of images, and that of Gaussian noise in that many tiles (so one image has a sigma too).
/// Returns nothing where no level could be measured.
std::optional<NoiseModel> fit_noise(const NoiseSamples& samples);

// Colour and brightness -----------------------------------------------------------------------------------------------

/// real = simulated * exp(log_gain) * (1 - vignetting rho^2) in linear light. rho is the distance from the image's
/// middle, 1 at the corner pixels' centres.
struct Transfer {
  std::array<double, 3> log_gain{};    ///< of r, g, b
  double vignetting = 0;               ///< below 0: brighter outwards
  std::array<std::size_t, 3> tiles{};  ///< number of tiles on which each channel was measured
};

/// Measures the transfer between two images of the same scene, which may be shifted by a few pixels. It uses
/// tiles of 8 x 8 px that are plain in both images and neither dark nor near full scale. The limit near full scale is
/// applied to the level that the fit expects, because noise must not select tiles. Tiles that disagree, as where a
/// landmark has moved, get weight 0 (Tukey). The gain is that at rho = 0. Equal images give exactly 0. Returns nothing
/// where a channel has fewer than 30 such tiles.
/// @throws std::invalid_argument also where sizes differ
std::optional<Transfer> transfer(const cv::Mat& simulated_rgb, const cv::Mat& real_rgb, const ImageRegion& region);

// Sharpness -----------------------------------------------------------------------------------------------------------

/// Measures the standard deviation (px) of the spread of edges, including the pixel's own square (1/12 px^2): about
/// 0.25 px for an ideal image sampled at points, 0.4 px for pixels that hold the mean over their square. It is the
/// median over strong single edges.
///
/// With the image smoothed by two Gaussians of variance a < b, an edge of spread v has steepnesses of ratio
/// R^2 = (b + v) / (a + v), so v = (b - R^2 a) / (R^2 - 1) (Zhuo and Sim 2011). This is exact for Gaussian spread; a
/// disc of radius r adds r^2 / 4, and somewhat less from 2 px on. Returns nothing where there are fewer than 30 edges.
std::optional<double> blur_px(const cv::Mat& rgb, const ImageRegion& region);

/// Returns the simulator's `defocus_px` that changes one spread into the other. It inverts the answer of blur_px() for
/// such a disc, so a disc's flat top causes no error. 0 where `real_blur_px` is not the greater; at most 10.
double defocus_radius_px(double simulated_blur_px, double real_blur_px);

}  // namespace twocone::vision
