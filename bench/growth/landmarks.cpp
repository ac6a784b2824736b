// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "bench/growth/growth.h"
#include "localisation/least_squares_fix.h"
#include "tests/support/synthetic_lab.h"
#include "vision/outline_ranging.h"

namespace twocone::bench {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace): a program of its own

constexpr std::array kSeen{3, 4, 6, 8, 12};
constexpr std::array kInFix{3, 6, 12, 25, 50, 100};
constexpr int kImagesOfOne = 5;  ///< number of poses
constexpr int kFixes = 200;

/// Returns a saturated colour of that hue, linear.
Eigen::Vector3d colour_of(double turn) {
  const auto channel = [turn](double at) {
    const double off = std::abs(std::remainder(turn - at, 1.0)) * 6;
    return 0.02 + 0.58 * std::clamp(2 - off, 0.0, 1.0);
  };
  return {channel(0), channel(1.0 / 3), channel(2.0 / 3)};
}

/// Returns landmarks round an ellipse, as in the lab, with hues round the circle; neighbours are far apart in hue.
std::vector<SyntheticLandmark> landmarks(int count) {
  std::vector<SyntheticLandmark> all;
  for (int i = 0; i < count; ++i) {
    const double turn = (i + 0.13) / count;
    const int stride = count % 5 == 0 ? 1 : 5;
    const double hue = double(i * stride % count) / count;
    all.push_back(landmark(2.4 * std::cos(2 * std::numbers::pi * turn), 2.0 * std::sin(2 * std::numbers::pi * turn),
                           colour_of(hue), 0.12));
  }
  return all;
}

/// Returns landmarks round a room, seen from (0.21, -0.34) m at 0.7 rad with errors of about a sigma: 3 mm + 2 mm/m,
/// 1.5 mrad.
std::vector<localisation::LandmarkMeasurement> sightings(int count, int variant) {
  std::vector<localisation::LandmarkMeasurement> all;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.3999632 * i;  // the golden angle avoids symmetry
    localisation::LandmarkMeasurement m;
    m.landmark_m = {2.7 * std::cos(turn), 2.2 * std::sin(turn) + 0.05 * i / count};
    const Eigen::Vector2d to = m.landmark_m - Eigen::Vector2d(0.21, -0.34);
    const double sigma_m = 0.003 + 0.002 * to.norm();
    m.range_m = to.norm() + sigma_m * std::sin(17.0 * i + 1 + variant);
    m.bearing_rad =
        std::remainder(std::atan2(to.y(), to.x()) - 0.7 - 0.0015 * std::cos(5.0 * i + variant), 2 * std::numbers::pi);
    m.covariance << sigma_m * sigma_m, 0.2 * sigma_m * 0.0015, 0.2 * sigma_m * 0.0015, 0.0015 * 0.0015;
    all.push_back(m);
  }
  return all;
}

}  // namespace

Growth grow_vision_landmarks(const Options& options) {
  const SyntheticRig rig(vision::lab_rig(), {.level = 0.45, .cells = 24, .contrast = 0.3});
  Growth growth;
  growth.title = "Landmarks, vision";
  growth.what = fmt::format(
      "Method `outline` on synthetic images of {} x {} pixels with noise of a grey level: processor time of a stereo "
      "frame, median of {}, at {} poses.",
      vision::kImage.width, vision::kImage.height, options.repeats, kImagesOfOne);
  growth.size_name = "landmarks";
  Column vision{"vision, ms", 2, {}};
  Column measured{"measured", 0, {}, false};
  for (const int count : kSeen) {
    growth.sizes.push_back(count);
    growth.labels.push_back(std::to_string(count));
    vision.repeats.emplace_back();
    measured.repeats.emplace_back();
    const auto all = landmarks(count);
    const vision::OutlineRanging ranging(rig.rig, targets_of(all), vision::kImage, vision::kImage);
    std::mt19937_64 random(1);
    for (int i = 0; i < kImagesOfOne; ++i) {
      const Eigen::Vector2d at(0.25 * std::cos(2.1 * i), 0.25 * std::sin(2.1 * i));
      const auto pair = rig.take({seen_from(all, at, 0.37 + 1.1 * i), {}, {}}, {1, 1}, random);
      std::vector<double> times_ms;
      int good = 0;
      for (int repeat = 0; repeat < options.repeats; ++repeat) {
        const double begin_s = thread_cpu_s();
        const auto answers = ranging.measure(pair.lower, pair.upper);
        times_ms.push_back(1e3 * (thread_cpu_s() - begin_s));
        good = ranged(answers);
      }
      vision.repeats.back().push_back(median(times_ms));
      measured.repeats.back().push_back(good);
    }
  }
  growth.columns = {vision, measured};
  return growth;
}

Growth grow_localisation_landmarks(const Options& options) {
  Growth growth;
  growth.title = "Landmarks, localisation";
  growth.what = fmt::format(
      "`fix_by_least_squares` with ranges and bearings: processor time of a fix, mean of {}, for {} sets of "
      "measurements.",
      kFixes, options.repeats);
  growth.size_name = "landmarks";
  Column fix{"fix, us", 1, {}};
  for (const int count : kInFix) {
    growth.sizes.push_back(count);
    growth.labels.push_back(std::to_string(count));
    fix.repeats.emplace_back();
    for (int repeat = 0; repeat < options.repeats; ++repeat) {
      const auto measurements = sightings(count, repeat);
      int good = 0;
      const double begin_s = thread_cpu_s();
      for (int i = 0; i < kFixes; ++i) {
        good += localisation::fix_by_least_squares(measurements).verdict == localisation::FixVerdict::kOk ? 1 : 0;
      }
      fix.repeats.back().push_back(1e6 * (thread_cpu_s() - begin_s) / kFixes);
      if (good != kFixes) throw std::runtime_error(fmt::format("no fix from {} landmarks", count));
    }
  }
  growth.columns = {fix};
  return growth;
}

}  // namespace twocone::bench
