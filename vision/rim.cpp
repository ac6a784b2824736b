// SPDX-License-Identifier: Apache-2.0
#include "vision/rim.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "base/quantile.h"
#include "vision/bilinear.h"

namespace twocone::vision {
namespace {

constexpr int kDirections = 360;
constexpr double kSearch = 0.2;  // share of the expected radius, to either side
constexpr int kSamplesPerPixel = 4;
constexpr double kMinStep = 4;     // grey levels: a smaller step is noise
constexpr double kClearStep = 12;  // grey levels: three times a noise of 4, which is strong
constexpr double kDark = 6;        // grey levels: black with such noise on it
constexpr double kInlier_px = 1.0;
constexpr double kLeastRimSupport = 1.0 / 3;
constexpr int kRimIterations = 30;
// The interpolation spreads the step from the last lit pixel over the diagonals of two pixels.
constexpr auto kSpread = std::size_t{3} * kSamplesPerPixel;

/// Brightness along one direction, outwards.
struct Profile {
  std::vector<double> grey;  ///< samples of the search and a little beyond it, as far as the image extends
  std::size_t searched = 0;  ///< number of samples that belong to the search
};

Profile profile_along(const cv::Mat& grey, const RimCircle& about, const Eigen::Vector2d& out) {
  // The search is never longer than this, whatever radius is expected.
  const double longest = 2.0 * (grey.cols + grey.rows);
  const auto search = std::size_t(std::min(2 * kSearch * about.radius_px, longest) * kSamplesPerPixel);
  std::vector<double> profile;
  // Samples behind the search show whether an image that gets dark at the very end of the search stays dark.
  for (std::size_t i = 0; i < search + 2 * kSpread; ++i) {
    const Eigen::Vector2d p = about.centre_px + out * (about.radius_px * (1 - kSearch) + double(i) / kSamplesPerPixel);
    const auto brightness = bilinear<std::uint8_t>(grey, p);
    if (!brightness) break;
    profile.push_back(*brightness);
  }
  const std::size_t searched = std::min(search, profile.size());
  return {std::move(profile), searched};
}

/// The number of samples of the search before the image gets dark and stays dark. An image may hold only the mirror and
/// its nearest surroundings, and the end of these is not the rim.
std::size_t lit(const Profile& profile) {
  const auto last = std::find_if(profile.grey.rbegin(), profile.grey.rend(), [](double grey) { return grey > kDark; });
  const auto lit = std::size_t(profile.grey.rend() - last);
  if (profile.grey.size() - lit <= kSpread) return profile.searched;
  return std::min(lit > kSpread ? lit - kSpread : 0, profile.searched);
}

/// The position of the strongest step of brightness on the way outwards, as an index into the profile's first `count`.
std::optional<double> strongest_step(const std::vector<double>& profile, std::size_t count, double least) {
  const int half = kSamplesPerPixel;  // the step over two pixels
  const int end = static_cast<int>(count) - half;
  const auto step_at = [&](int i) {
    const double* const here = profile.data() + i;
    return std::abs(here[half] - here[-half]);
  };
  double best = least;
  int best_at = -1;
  for (int i = half; i < end; ++i) {
    if (step_at(i) > best) {
      best = step_at(i);
      best_at = i;
    }
  }
  if (best_at < 0) return std::nullopt;
  // The middle of the plateau of equally strong steps.
  int last = best_at;
  while (last + 1 < end && step_at(last + 1) > 0.99 * best) ++last;
  return (best_at + last) / 2.0;
}

/// The edges that count.
enum class Edges {
  kLit,  ///< all but those where the image gets dark and stays dark
  kAll,
};

std::vector<Eigen::Vector2d> strongest_edges(const cv::Mat& grey, const RimCircle& about, Edges which,
                                             double least = kMinStep) {
  std::vector<Eigen::Vector2d> edges;
  for (int i = 0; i < kDirections; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kDirections;
    const Eigen::Vector2d out(std::cos(angle_rad), std::sin(angle_rad));
    const Profile profile = profile_along(grey, about, out);
    const auto step = strongest_step(profile.grey, which == Edges::kAll ? profile.searched : lit(profile), least);
    if (!step) continue;
    edges.emplace_back(about.centre_px + out * (about.radius_px * (1 - kSearch) + *step / kSamplesPerPixel));
  }
  return edges;
}

bool are_enough(const std::vector<Eigen::Vector2d>& edges) {
  return double(edges.size()) >= kDirections * kLeastRimSupport;
}

cv::Mat checked_grey(const cv::Mat& rgb, const RimCircle& expected) {
  if (rgb.type() != CV_8UC3) throw std::invalid_argument("find_rim: wants an image of r g b");
  if (!(expected.radius_px > 0) || !std::isfinite(expected.radius_px) || !expected.centre_px.allFinite()) {
    throw std::invalid_argument("find_rim: expected.radius_px must be > 0, and centre and radius finite");
  }
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

/// The circle that fits most of the edges.
std::optional<RimCircle> circle_of(const std::vector<Eigen::Vector2d>& edges, const RimCircle& expected) {
  if (!are_enough(edges)) return std::nullopt;
  RimCircle circle = expected;
  std::vector<double> radii;
  radii.reserve(edges.size());
  for (const auto& e : edges) radii.push_back((e - circle.centre_px).norm());
  circle.radius_px = base::median(std::move(radii));

  // Gauss-Newton on the distance to the circle, with Cauchy weights whose scale shrinks to a pixel.
  for (int iteration = 0; iteration < kRimIterations; ++iteration) {
    const double scale_px = std::max(kInlier_px, kSearch * expected.radius_px / (1 << std::min(iteration, 10)));
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& e : edges) {
      const Eigen::Vector2d from = e - circle.centre_px;
      const double distance = from.norm();
      const double residual = distance - circle.radius_px;
      const double weight = 1 / (1 + (residual / scale_px) * (residual / scale_px));
      const Eigen::Vector3d row(from.x() / distance, from.y() / distance, 1);
      normal += weight * row * row.transpose();
      right += weight * residual * row;
    }
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    circle.centre_px += step.head<2>();
    circle.radius_px += step.z();
  }
  const auto inliers = std::count_if(edges.begin(), edges.end(), [&circle](const Eigen::Vector2d& e) {
    return std::abs((e - circle.centre_px).norm() - circle.radius_px) <= kInlier_px;
  });
  circle.support = double(inliers) / kDirections;
  if (circle.support < kLeastRimSupport || !(circle.radius_px > 0)) return std::nullopt;
  return circle;
}

}  // namespace

std::optional<RimCircle> find_rim(const cv::Mat& rgb, const RimCircle& expected) {
  const cv::Mat grey = checked_grey(rgb, expected);
  const auto rim = circle_of(strongest_edges(grey, expected, Edges::kLit), expected);
  // The rim of a mirror in front of something dark is where the dark begins.
  return rim ? rim : circle_of(strongest_edges(grey, expected, Edges::kAll), expected);
}

bool rim_may_show(const cv::Mat& rgb, const RimCircle& expected) {
  return are_enough(strongest_edges(checked_grey(rgb, expected), expected, Edges::kLit, kClearStep));
}

}  // namespace twocone::vision
