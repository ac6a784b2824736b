// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/srgb.h"
#include "tests/vision/lab_rig.h"
#include "vision/image_quality.h"

/// Images whose noise, gain and blur are known.
namespace twocone::vision::image_quality_test {

inline ImageRegion lab_region() { return {.centre_px = {319.5, 239.5}, .radius_px = 236}; }

/// Linear light of a simple mirror image: a plain half and a chequered half, with radial objects that are brighter on
/// one side, anti-aliased. `moved_rad` moves one of these objects. It is much faster than a SyntheticView.
inline cv::Mat lab_light(double shift_px = 0, double moved_rad = 0) {
  struct Thing {
    double bearing_rad, half_rad;
    cv::Vec3f colour;
  };
  const std::array<Thing, 5> things{{{0.4 + moved_rad, 0.12, {0.8F, 0.03F, 0.03F}},
                                     {1.3, 0.2, {0.03F, 0.8F, 0.03F}},
                                     {2.5, 0.25, {0.1F, 0.1F, 0.6F}},
                                     {-0.7, 0.2, {0.1F, 0.1F, 0.1F}},
                                     {-1.6, 0.3, {0.2F, 0.2F, 0.2F}}}};
  cv::Mat_<cv::Vec3f> light(480, 640);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      const double x = column - 319.7 - shift_px;
      const double y = row - 239.2 + shift_px / 3;
      const double radius = std::hypot(x, y);
      const double bearing = std::atan2(y, x);
      double wall = 0.45 + 0.15 * std::cos(bearing - 0.3) + 0.1 * radius / 236;
      const auto cell = std::lround(std::floor(bearing * 9) + std::floor(radius / 23));
      if (bearing < 0 && cell % 2 == 0) wall *= 0.7;
      cv::Vec3f seen = cv::Vec3f::all(float(wall));
      for (const Thing& thing : things) {
        const double off_rad = std::abs(std::remainder(bearing - thing.bearing_rad, 2 * std::numbers::pi));
        const double inside_px =
            std::min(radius * std::sin(std::clamp(thing.half_rad - off_rad, -1.5, 1.5)), 200 - radius);
        const auto share = float(std::clamp(0.5 + inside_px, 0., 1.));
        const auto shade = float(1 - off_rad * off_rad);
        seen = seen * (1 - share) + thing.colour * (share * shade);
      }
      light(row, column) = seen;
    }
  }
  return light;
}

/// That light of the room at rest.
inline const cv::Mat& room() {
  static const cv::Mat kLight = lab_light();
  return kLight;
}

struct Camera {
  double gain = 1;
  double vignetting = 0;
  double shot = 0;  ///< 1 / full well
  double read = 0;
  double defocus_px = 0;
};

/// Each pixel's share of a disc, from 16 x 16 points of the pixel, as the simulator's camera counts them.
inline cv::Mat disc(double radius_px) {
  const int reach = int(std::ceil(radius_px));
  cv::Mat kernel = cv::Mat::zeros(2 * reach + 1, 2 * reach + 1, CV_32F);
  for (int y = 0; y < kernel.rows * 16; ++y) {
    for (int x = 0; x < kernel.cols * 16; ++x) {
      const double from_middle_px = std::hypot((x + 0.5) / 16 - 0.5 - reach, (y + 0.5) / 16 - 0.5 - reach);
      if (from_middle_px <= radius_px) kernel.at<float>(y / 16, x / 16) += 1;
    }
  }
  return kernel / cv::sum(kernel)[0];
}

/// The image that the camera makes of light. As in the simulator's camera stage, noise is in linear light.
inline cv::Mat taken(const cv::Mat& light, const Camera& camera, std::uint64_t seed) {
  cv::Mat_<cv::Vec3f> seen = light.clone();
  if (camera.defocus_px > 0) cv::filter2D(seen, seen, -1, disc(camera.defocus_px));
  cv::Mat_<cv::Vec3f> normal(seen.size());
  cv::RNG random(seed);
  random.fill(normal, cv::RNG::NORMAL, 0, 1);
  cv::Mat_<cv::Vec3b> rgb(seen.size());
  const cv::Point2d middle((seen.cols - 1) / 2., (seen.rows - 1) / 2.);
  for (int row = 0; row < seen.rows; ++row) {
    for (int column = 0; column < seen.cols; ++column) {
      const double rho = std::hypot(column - middle.x, row - middle.y) / std::hypot(middle.x, middle.y);
      for (int i = 0; i < 3; ++i) {
        const double mean = seen(row, column)[i] * camera.gain * (1 - camera.vignetting * rho * rho);
        const double sigma = std::sqrt(camera.shot * mean + camera.read * camera.read);
        const double value = std::clamp(mean + sigma * normal(row, column)[i], 0., 1.);
        rgb(row, column)[i] = std::uint8_t(std::lround(testing_support::coded(value)));
      }
    }
  }
  return rgb;
}

/// Linear light per grey level at light 0.2, code 123.6: 2.4 / 1.055 ((123.6 / 255 + 0.055) / 1.055)^1.4 / 255.
constexpr double kLightPerGrey = 0.003490;

}  // namespace twocone::vision::image_quality_test
