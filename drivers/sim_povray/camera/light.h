// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include <boost/random/normal_distribution.hpp>

#include "hal/image.h"

/// Images in linear light, in which shutter samples add up and lenses blur, and the effects of a lens and a sensor on
/// them. Each effect of the lens at its neutral value changes no value by more than rounding.
namespace twocone::sim_povray {

/// Linear RGB, interleaved, rows from the top; 1 is full scale. Values may exceed 1 until they are coded again.
struct Light {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> values;
};

/// A part of a row's light: that of one image.
struct ImageShare {
  int image;  ///< index
  float share;
};

/// Returns the weighted mean light of images of sRGB code values (IEC 61966-2-1), row by row. @param row_shares for
/// each row, of sum 1
[[nodiscard]] Light mean_light(const std::vector<const Image*>& images,
                               const std::vector<std::vector<ImageShare>>& row_shares);
/// Returns a kRgb8 image of the sRGB code values that are nearest in code values; light outside 0 to 1 is clipped.
/// Inverts mean_light() of one image.
[[nodiscard]] Image to_image(const Light& light);

/// A point seen through OpenCV's lens model, in units of the focal length from the image's centre, x right, y down:
///   r^2 = x^2 + y^2,  s = 1 + k1 r^2 + k2 r^4 + k3 r^6
///   x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y
struct LensPoint {
  double x = 0;
  double y = 0;
};
/// Returns the ideal point that is seen at `seen`, to 1e-9 focal lengths; not a number if Newton's method finds none on
/// the near side of the fold (beyond which the model would show the image a second time, inside out).
/// @param k k1 k2 p1 p2 [k3]; empty: the point is returned unchanged
[[nodiscard]] LensPoint undistort(const std::vector<double>& k, const LensPoint& seen);

/// Returns the image through that lens: bilinear between the ideal image's pixels, black where the ideal image has
/// none.
/// @param focal_px > 0
[[nodiscard]] Light distorted(const Light& ideal, const std::vector<double>& k, double focal_px);

/// Spreads each point evenly over a disc; beyond the image's edge its last pixels are repeated. The disc's share in a
/// pixel is counted on a grid of 16 x 16, so a radius of up to half a pixel changes nothing.
[[nodiscard]] Light defocused(const Light& sharp, double radius_px);

/// Multiplies by 1 - vignetting (r / r_corner)^2, r from the image's centre, r_corner to the corner pixel's centre.
void vignette(Light& light, double vignetting);

/// Multiplies red, green and blue by a factor each. @param gains three
void multiply_channels(Light& light, std::span<const double> gains);
/// Multiplies each row by a factor of its own. @param gains one for each row
void multiply_rows(Light& light, std::span<const float> gains);

/// Purposes of a camera's random engines. The numbers are part of every result's seed: never reuse one. The numbers of
/// the world's own engines are below 101.
enum class CameraPurpose : std::uint32_t {
  kShotNoise = 101,
  kReadNoise = 102,
  kDrop = 103,
  kLate = 104,
  kFlicker = 105
};

[[nodiscard]] std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera,
                                            std::uint64_t step);

/// Standard normal deviates, identical with every standard library, unlike std::normal_distribution (libstdc++'s also
/// takes twice as long as a ziggurat). Boost's distribution is a ziggurat with constant tables.
class Normal {
 public:
  explicit Normal(std::mt19937_64 engine) : engine_(engine) {}
  double operator()() { return distribution_(engine_); }

 private:
  std::mt19937_64 engine_;
  boost::random::normal_distribution<double> distribution_;
};

/// Changes light to light + sqrt(light / full_well) z: Poisson's variance of light * full_well electrons. Draws one z
/// for each value, whatever the value is. @param full_well_electrons 0: infinitely many, no noise
void add_shot_noise(Light& light, double full_well_electrons, Normal normal);
/// Changes light to light + sigma z, except for pixels without any light. Those are the pixels beside the mirror that
/// are not rendered; their black shows programs that nothing was recorded there. @param sigma of full scale
void add_read_noise(Light& light, double sigma, Normal normal);

}  // namespace twocone::sim_povray
