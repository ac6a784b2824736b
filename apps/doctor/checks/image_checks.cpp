// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/estimation/image_as_mat.h"
#include "base/quantile.h"
#include "vision/mirror_search.h"

namespace twocone::doctor {
namespace {

// Noise moves the ends of the scale by a few grey levels.
constexpr double kBlack = 4;
constexpr double kWhite = 251;
// Below kDark, 8 bits and noise leave no hue; a lens cap gives about 0. Above kGlaring, colours are lost in white.
constexpr double kDark = 12, kDim = 40, kBright = 200, kGlaring = 245;
// The tip shows the camera's own black lens, and a window or a lamp may be white. Shares up to these are accepted.
constexpr double kMuchBlack = 0.3, kMuchWhite = 0.05, kMostlyWhite = 0.5;

// `run` warns beyond the first value. Beyond the second, the rig itself is wrong, and a calibration of small errors
// does not help.
constexpr double kRimRight_px = 1;
constexpr double kRimNear_px = 5;

// Method outline fits edges up to 8 pixels wide (vision/outline/outline_fit.h, most_blur_px). Half of that allows for
// objects that are less sharp than the rim.
constexpr double kSharp_px = 4;
constexpr double kBlurred_px = 8;
constexpr int kDirections = 180;
constexpr int kLeastDirections = kDirections / 6;
constexpr double kReach_px = 14;
constexpr double kNear_px = 3;
constexpr int kSamplesPerPixel = 4;
constexpr double kClearStep = 16;
// The edge ends where the slope is a tenth of the steepest one.
constexpr double kEdgeEnd = 0.1;

/// Returns the brightness across the rim, or an empty profile if the image does not contain all of it.
std::vector<double> profile_across(const cv::Mat& grey, const vision::RimCircle& rim, double angle_rad) {
  std::vector<double> profile;
  const int half = int(kReach_px * kSamplesPerPixel);
  for (int i = -half; i <= half; ++i) {
    const double r = rim.radius_px + double(i) / kSamplesPerPixel;
    const auto brightness = vision::bilinear<std::uint8_t>(
        grey, {rim.centre_px.x() + r * std::cos(angle_rad), rim.centre_px.y() + r * std::sin(angle_rad)});
    if (!brightness) return {};
    profile.push_back(*brightness);
  }
  return profile;
}

std::optional<double> width_of_edge(const std::vector<double>& profile) {
  const int half = kSamplesPerPixel / 2;
  const auto count = static_cast<int>(profile.size());
  // Returns the slope over one pixel.
  const auto slope = [&](int i) { return profile.data()[i + half] - profile.data()[i - half]; };
  const int middle = count / 2;
  const int near = int(kNear_px * kSamplesPerPixel);
  if (count < 2 * (near + half) + 1) return std::nullopt;
  int steepest = middle;
  for (int i = middle - near; i <= middle + near; ++i) {
    if (std::abs(slope(i)) > std::abs(slope(steepest))) steepest = i;
  }
  const double top = slope(steepest);
  const auto goes_on = [&](int i) { return i >= half && i < count - half && slope(i) / top > kEdgeEnd; };
  if (top == 0) return std::nullopt;
  int first = steepest;
  int last = steepest;
  while (goes_on(first - 1)) --first;
  while (goes_on(last + 1)) ++last;
  const double step = std::abs(profile[std::size_t(last)] - profile[std::size_t(first)]);
  if (step < kClearStep) return std::nullopt;
  return step / std::abs(top);
}

/// Returns the key of `rig:` that corresponds to the measured rim.
std::string rig_key(const vision::RimCircle& rim, const std::string& view) {
  return fmt::format("rig: {}: {{centre_px: [{:.1f}, {:.1f}], rim_radius_px: {:.1f}}}", view, rim.centre_px.x(),
                     rim.centre_px.y(), rim.radius_px);
}

/// Brightness in the mirror, or in the whole image if no circle is given.
struct Exposure {
  double mean_grey = 0;    ///< 0 to 255
  double black_share = 0;  ///< share of pixels with all channels at the lower end: no hue is left
  double white_share = 0;  ///< share of pixels with all channels at the upper end
};
/// @param rgb CV_8UC3, not empty
Exposure exposure_of(const cv::Mat& rgb, const std::optional<vision::RimCircle>& circle) {
  Exposure exposure;
  double count = 0;
  for (int row = 0; row < rgb.rows; ++row) {
    for (int column = 0; column < rgb.cols; ++column) {
      if (circle && std::hypot(column - circle->centre_px.x(), row - circle->centre_px.y()) > circle->radius_px)
        continue;
      const auto& pixel = rgb.at<cv::Vec3b>(row, column);
      const auto [least, most] = std::minmax({pixel[0], pixel[1], pixel[2]});
      ++count;
      exposure.mean_grey += 0.299 * pixel[0] + 0.587 * pixel[1] + 0.114 * pixel[2];
      exposure.black_share += most < kBlack;
      exposure.white_share += least > kWhite;
    }
  }
  if (count == 0) return exposure_of(rgb, std::nullopt);  // the circle is outside the image
  exposure.mean_grey /= count;
  exposure.black_share /= count;
  exposure.white_share /= count;
  return exposure;
}

Row judge_exposure(const Exposure& e) {
  Row row{"", "exposure",
          fmt::format("mean grey {:.0f}, {:.0f} % black, {:.0f} % white", e.mean_grey, 100 * e.black_share,
                      100 * e.white_share)};
  if (e.mean_grey < kDark) {
    row.judge(kFailed, "the image is dark: remove the lens cap, add light, or use a longer exposure");
  } else if (e.mean_grey > kGlaring || e.white_share > kMostlyWhite) {
    row.judge(kFailed, "the image is white: use a shorter exposure");
  } else if (e.mean_grey < kDim || e.black_share > kMuchBlack) {
    row.judge(kWarning, "dark: use more light, or a longer exposure or more gain in controls:");
  } else if (e.mean_grey > kBright || e.white_share > kMuchWhite) {
    row.judge(kWarning, "bright: white areas have no colour; use a shorter exposure in controls:");
  }
  return row;
}

Row judge_focus(const std::optional<double>& width_px) {
  if (!width_px) {
    return {"", "focus", "the rim has too little contrast", kNotRun, "put an object of another brightness around it"};
  }
  Row row{"", "focus", fmt::format("the rim's edge is {:.1f} px wide", *width_px)};
  if (*width_px > kSharp_px) {
    row.judge(
        *width_px > kBlurred_px ? kFailed : kWarning,
        fmt::format("turn the lens until the edge is below {:.0f} px; clean it; switch autofocus off", kSharp_px));
  }
  return row;
}

}  // namespace

std::optional<double> edge_width_px(const cv::Mat& rgb, const vision::RimCircle& rim) {
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  std::vector<double> widths;
  for (int i = 0; i < kDirections; ++i) {
    if (const auto width = width_of_edge(profile_across(grey, rim, 2 * std::numbers::pi * i / kDirections))) {
      widths.push_back(*width);
    }
  }
  if (int(widths.size()) < kLeastDirections) return std::nullopt;
  return base::quantile(widths, 0.5);
}

Row judge_mirror(const std::optional<vision::RimCircle>& found, bool may_show, const vision::RimCircle& believed,
                 const std::string& view, const std::optional<vision::RimMeasurement>& elsewhere) {
  if (elsewhere && !found) {
    const vision::RimCircle rim{elsewhere->centre_px, elsewhere->radius_px, elsewhere->support};
    return {"", "mirror",
            fmt::format("({:.1f}, {:.1f}), r {:.1f} px; far from the one in the robot file", rim.centre_px.x(),
                        rim.centre_px.y(), rim.radius_px),
            kFailed, fmt::format("{}, then twocone calibrate; or put the camera back", rig_key(rim, view))};
  }
  if (!found && !may_show) {
    return {"", "mirror", "no rim is visible near the one in the robot file", kWarning,
            fmt::format("look at an image: is the mirror in view? Then an object of another brightness around it would "
                        "show whether rig: {}: is right",
                        view)};
  }
  if (!found) {
    return {"", "mirror", "no rim near the one in the robot file", kFailed,
            fmt::format("look at an image: is the mirror in view, and is rig: {}: right?", view)};
  }
  const double off_px =
      std::max((found->centre_px - believed.centre_px).norm(), std::abs(found->radius_px - believed.radius_px));
  Row row{"", "mirror",
          fmt::format("({:.1f}, {:.1f}), r {:.1f} px; off by {:.1f} px", found->centre_px.x(), found->centre_px.y(),
                      found->radius_px, off_px)};
  if (off_px > kRimNear_px) {
    row.judge(kFailed, fmt::format("{}, or put the camera back", rig_key(*found, view)));
  } else if (off_px > kRimRight_px) {
    row.judge(kWarning, fmt::format("ranges will be wrong; {}, then twocone calibrate", rig_key(*found, view)));
  }
  return row;
}

void check_image(const std::string& part, const Image& image, const std::optional<vision::RimCircle>& believed,
                 Report& report) {
  const cv::Mat rgb = estimation::as_mat(image);
  std::optional<vision::RimCircle> found;
  if (believed) found = vision::find_rim(rgb, *believed);
  report.add(part, judge_exposure(exposure_of(rgb, found ? found : believed)));
  if (!believed) return;
  std::optional<vision::RimMeasurement> elsewhere;
  if (!found) elsewhere = vision::find_mirror(std::vector{rgb}).rim;
  report.add(part, judge_mirror(found, vision::rim_may_show(rgb, *believed), *believed, part, elsewhere));
  if (found) report.add(part, judge_focus(edge_width_px(rgb, *found)));
}

}  // namespace twocone::doctor
