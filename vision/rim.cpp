// SPDX-License-Identifier: Apache-2.0
#include "vision/rim.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "base/quantile.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

constexpr int kRimDirections = 360;
constexpr int kSamplesPerPixel = 4;
constexpr double kMinStep = 4;     // grey levels: a smaller step is noise
constexpr double kClearStep = 12;  // grey levels: three times a noise of 4, which is strong
constexpr double kDarkGrey = 6;    // grey levels: black with such noise on it
constexpr double kInlier_px = 1.0;
constexpr double kLeastRimSupport = 1.0 / 3;
constexpr int kRimIterations = 30;
// The interpolation spreads the step from the last lit pixel over the diagonals of two pixels.
constexpr auto kSpread = std::size_t{3} * kSamplesPerPixel;

/// Where a rim is searched.
struct RimSearch {
  RimCircle about;
  double share;  ///< of the radius, to either side
};

/// Brightness along one direction, outwards.
struct Profile {
  std::vector<double> grey;  ///< samples of the search and a little beyond it, as far as the image extends
  std::size_t searched = 0;  ///< number of samples that belong to the search
};

Profile profile_along(const cv::Mat& grey, const RimSearch& where, const Eigen::Vector2d& out) {
  const RimCircle& about = where.about;
  // The search is never longer than this, whatever radius is expected.
  const double longest = 2.0 * (grey.cols + grey.rows);
  const auto search = std::size_t(std::min(2 * where.share * about.radius_px, longest) * kSamplesPerPixel);
  std::vector<double> profile;
  // Samples behind the search show whether an image that gets dark at the very end of the search stays dark.
  for (std::size_t i = 0; i < search + 2 * kSpread; ++i) {
    const Eigen::Vector2d p =
        about.centre_px + out * (about.radius_px * (1 - where.share) + double(i) / kSamplesPerPixel);
    const auto brightness = bilinear<std::uint8_t>(grey, p);
    if (!brightness) break;
    profile.push_back(*brightness);
  }
  const std::size_t searched = std::min(search, profile.size());
  return {std::move(profile), searched};
}

/// Returns the number of samples of the search before the image gets dark and stays dark. An image may hold only the
/// mirror and its nearest surroundings, and the end of these is not the rim.
std::size_t lit(const Profile& profile) {
  const auto last =
      std::find_if(profile.grey.rbegin(), profile.grey.rend(), [](double grey) { return grey > kDarkGrey; });
  const auto lit = std::size_t(profile.grey.rend() - last);
  if (profile.grey.size() - lit <= kSpread) return profile.searched;
  return std::min(lit > kSpread ? lit - kSpread : 0, profile.searched);
}

/// Returns the position of the strongest step of brightness on the way outwards, as an index into the profile's first
/// `count` samples.
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
  // Take the middle of the plateau of equally strong steps.
  int last = best_at;
  while (last + 1 < end && step_at(last + 1) > 0.99 * best) ++last;
  return (best_at + last) / 2.0;
}

/// The edges that count.
enum class Edges {
  kLit,  ///< all but those where the image gets dark and stays dark
  kAll,
};

std::vector<Eigen::Vector2d> strongest_edges(const cv::Mat& grey, const RimSearch& where, Edges which,
                                             double least = kMinStep) {
  const RimCircle& about = where.about;
  std::vector<Eigen::Vector2d> edges;
  for (int i = 0; i < kRimDirections; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kRimDirections;
    const Eigen::Vector2d out(std::cos(angle_rad), std::sin(angle_rad));
    const Profile profile = profile_along(grey, where, out);
    const auto step = strongest_step(profile.grey, which == Edges::kAll ? profile.searched : lit(profile), least);
    if (!step) continue;
    edges.emplace_back(about.centre_px + out * (about.radius_px * (1 - where.share) + *step / kSamplesPerPixel));
  }
  return edges;
}

bool are_enough(const std::vector<Eigen::Vector2d>& edges) {
  return double(edges.size()) >= kRimDirections * kLeastRimSupport;
}

cv::Mat checked_grey(const cv::Mat& rgb, const RimCircle& expected, double search_share) {
  if (rgb.type() != CV_8UC3) throw std::invalid_argument("find_rim: the image must be of type CV_8UC3 (r g b)");
  if (!(expected.radius_px > 0) || !std::isfinite(expected.radius_px) || !expected.centre_px.allFinite()) {
    throw std::invalid_argument("find_rim: expected.radius_px must be > 0, and centre and radius finite");
  }
  if (!(search_share > 0 && search_share < 1)) {
    throw std::invalid_argument("find_rim: search_share must be > 0 and < 1");
  }
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

/// Fits a circle to most of the edges.
std::optional<RimCircle> circle_of(const std::vector<Eigen::Vector2d>& edges, const RimSearch& where) {
  const RimCircle& expected = where.about;
  if (!are_enough(edges)) return std::nullopt;
  RimCircle circle = expected;
  std::vector<double> radii;
  radii.reserve(edges.size());
  for (const auto& e : edges) radii.push_back((e - circle.centre_px).norm());
  circle.radius_px = base::median(std::move(radii));

  // Gauss-Newton on the distance to the circle, with Cauchy weights whose scale shrinks to a pixel.
  for (int iteration = 0; iteration < kRimIterations; ++iteration) {
    const double scale_px = std::max(kInlier_px, where.share * expected.radius_px / (1 << std::min(iteration, 10)));
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
  circle.support = double(inliers) / kRimDirections;
  if (circle.support < kLeastRimSupport || !(circle.radius_px > 0)) return std::nullopt;
  return circle;
}

// Distances from the rim: of the samples for the level of each side, and of the window summed for the edge.
constexpr double kLevelFrom_px = 1.5;
constexpr double kLevelTo_px = 4.0;  // a simulated image ends 6 px behind the rim
constexpr double kEdge_px = 2.0;
constexpr double kSample_px = 0.125;
constexpr double kLeastRimContrast = 0.05;  // share of white, linear light
constexpr int kCircleIterations = 20;

/// Measures the radius of the edge in one direction.
std::optional<double> edge_radius(const cv::Mat& grey, const RimCircle& circle, const Eigen::Vector2d& out) {
  double inside = 0;
  double outside = 0;
  double edge = 0;
  int level_samples = 0;
  int edge_samples = 0;
  for (int sample = 0; (sample + 0.5) * kSample_px < kLevelTo_px; ++sample) {
    const double r = (sample + 0.5) * kSample_px;
    const auto before = bilinear<float>(grey, circle.centre_px + out * (circle.radius_px - r));
    const auto behind = bilinear<float>(grey, circle.centre_px + out * (circle.radius_px + r));
    if (!before || !behind) return std::nullopt;
    if (r < kEdge_px) {
      edge += *before + *behind;
      ++edge_samples;
    }
    if (r < kLevelFrom_px) continue;
    // Only pixels that were not recorded are fully black.
    if (*behind <= 0) return std::nullopt;
    inside += *before;
    outside += *behind;
    ++level_samples;
  }
  inside /= level_samples;
  outside /= level_samples;
  if (std::abs(inside - outside) < kLeastRimContrast) return std::nullopt;
  const double share = (edge / edge_samples / 2 - outside) / (inside - outside);  // share of the window on the mirror
  if (!(share > 0.05 && share < 0.95)) return std::nullopt;
  return circle.radius_px + (2 * share - 1) * kEdge_px;
}

struct Edge {
  Eigen::Vector2d out;
  double radius_px;
};

std::vector<Edge> edges_about(const cv::Mat& grey, const RimCircle& circle, int directions) {
  std::vector<Edge> edges;
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi * i / directions;
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
    if (const auto radius = edge_radius(grey, circle, out)) edges.push_back({out, *radius});
  }
  return edges;
}

}  // namespace

RimCircle rim_in_image(const MirrorView& view) {
  const MirrorViewSettings& s = view.settings();
  if (!s.distortion) return {s.centre_px, s.rim_radius_px, 0};
  constexpr int kPoints = 90;
  std::vector<Eigen::Vector2d> points_px;
  for (int i = 0; i < kPoints; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kPoints;
    const Eigen::Vector2d out(std::cos(angle_rad), std::sin(angle_rad));
    if (const auto point_px = view.distort_px(s.centre_px + s.rim_radius_px * out)) points_px.push_back(*point_px);
  }
  if (points_px.size() < kPoints / 2) return {s.centre_px, s.rim_radius_px, 0};
  // Least squares for |p|^2 = 2 c p + q, with the centre c and q = r^2 - |c|^2.
  Eigen::MatrixX3d equations(points_px.size(), 3);
  Eigen::VectorXd squares(points_px.size());
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    const Eigen::Vector2d p_px = points_px[std::size_t(i)] - s.centre_px;
    equations.row(i) << 2 * p_px.x(), 2 * p_px.y(), 1;
    squares[i] = p_px.squaredNorm();
  }
  const Eigen::Vector3d fit = equations.colPivHouseholderQr().solve(squares);
  const Eigen::Vector2d centre_px = fit.head<2>();
  return {s.centre_px + centre_px, std::sqrt(fit.z() + centre_px.squaredNorm()), 0};
}

std::optional<RimCircle> find_rim(const cv::Mat& rgb, const RimCircle& expected, double search_share) {
  const cv::Mat grey = checked_grey(rgb, expected, search_share);
  const RimSearch where{expected, search_share};
  const auto rim = circle_of(strongest_edges(grey, where, Edges::kLit), where);
  // In front of a dark background, the rim of a mirror is where the dark begins.
  return rim ? rim : circle_of(strongest_edges(grey, where, Edges::kAll), where);
}

bool rim_may_show(const cv::Mat& rgb, const RimCircle& expected) {
  return are_enough(
      strongest_edges(checked_grey(rgb, expected, kRimSearch), {expected, kRimSearch}, Edges::kLit, kClearStep));
}

cv::Mat median_image(std::span<const cv::Mat> images) {
  if (images.empty()) throw std::invalid_argument("median_image: at least one image is needed");
  const cv::Size size = images.front().size();
  for (const cv::Mat& image : images) {
    if (image.type() != CV_8UC3 || image.size() != size)
      throw std::invalid_argument("median_image: the images must be of type CV_8UC3 (r g b) and of one size");
  }
  cv::Mat median(size, CV_8UC3);
  std::vector<const std::uint8_t*> rows(images.size());
  std::vector<std::uint8_t> values(images.size());
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  for (int row = 0; row < size.height; ++row) {
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = images[i].ptr<std::uint8_t>(row);
    auto* const out = median.ptr<std::uint8_t>(row);
    for (int k = 0; k < 3 * size.width; ++k) {
      for (std::size_t i = 0; i < rows.size(); ++i) values[i] = rows[i][k];
      std::nth_element(values.begin(), middle, values.end());
      out[k] = *middle;
    }
  }
  return median;
}

std::optional<RimMeasurement> measure_rim(const cv::Mat& rgb, const RimCircle& expected, double search_share) {
  auto circle = find_rim(rgb, expected, search_share);
  if (!circle) return std::nullopt;
  // Coded values would move an edge by a quarter of a pixel.
  const cv::Mat grey = linear_grey(rgb);
  const int directions = std::max(8, static_cast<int>(2 * std::numbers::pi * circle->radius_px));
  std::vector<Edge> edges;
  RimMeasurement rim;
  Eigen::Matrix3d normal;
  double weights = 0;
  for (int iteration = 0; iteration < kCircleIterations; ++iteration) {
    edges = edges_about(grey, *circle, directions);
    if (double(edges.size()) < kLeastRimSupport * directions) return std::nullopt;
    std::vector<double> off;
    off.reserve(edges.size());
    for (const Edge& e : edges) off.push_back(std::abs(e.radius_px - circle->radius_px));
    const double scale = std::max(0.02, base::robust_sigma(std::move(off)));
    normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double squares = 0;
    weights = 0;
    for (const Edge& e : edges) {
      const double residual = e.radius_px - circle->radius_px;
      const double weight = std::abs(residual) < 3 * scale ? 1 : 0;
      const Eigen::Vector3d row(e.out.x(), e.out.y(), 1);
      normal += weight * row * row.transpose();
      right += weight * residual * row;
      squares += weight * residual * residual;
      weights += weight;
    }
    if (!(weights > kLeastRimSupport * directions)) return std::nullopt;
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    circle->centre_px += step.head<2>();
    circle->radius_px += step.z();
    rim.scatter_px = std::sqrt(squares / weights);
    if (step.norm() < 1e-4) break;
  }
  // Factor 2: directions are a pixel apart and share pixels with their neighbours.
  const Eigen::Matrix3d covariance = 2 * rim.scatter_px * rim.scatter_px * normal.inverse();
  rim.centre_px = circle->centre_px;
  rim.radius_px = circle->radius_px;
  rim.sigma_centre_px = std::max(kLeastRimSigma_px, std::sqrt(std::max(covariance(0, 0), covariance(1, 1))));
  rim.sigma_radius_px = std::max(kLeastRimSigma_px, std::sqrt(covariance(2, 2)));
  rim.support = weights / directions;
  return rim;
}

std::optional<TipMeasurement> measure_tip(std::span<const cv::Mat> images, const Eigen::Vector2d& expected_px,
                                          double reach_px) {
  constexpr double kNearest_px = 8;  // nearer to the tip, a gradient's window extends to the tip's other side
  constexpr double kLeastGradient = 0.04;
  constexpr std::size_t kLeastEdges = 100;
  if (!(reach_px > kNearest_px)) throw std::invalid_argument("measure_tip: reach_px must be > 8");
  struct Line {
    Eigen::Vector2d at;
    Eigen::Vector2d normal;
  };
  std::vector<Line> lines;
  for (const cv::Mat& image : images) {
    if (image.type() != CV_8UC3) throw std::invalid_argument("measure_tip: the images must be of type CV_8UC3 (r g b)");
    const cv::Mat grey = linear_grey(image);
    cv::Mat dx;
    cv::Mat dy;
    cv::Scharr(grey, dx, CV_32F, 1, 0, 1.0 / 32);
    cv::Scharr(grey, dy, CV_32F, 0, 1, 1.0 / 32);
    const double far_px = reach_px + kNearest_px;
    for (int row = std::max(1, static_cast<int>(expected_px.y() - far_px));
         row < std::min(grey.rows - 1, static_cast<int>(expected_px.y() + far_px)); ++row) {
      for (int column = std::max(1, static_cast<int>(expected_px.x() - far_px));
           column < std::min(grey.cols - 1, static_cast<int>(expected_px.x() + far_px)); ++column) {
        const Eigen::Vector2d gradient(dx.at<float>(row, column), dy.at<float>(row, column));
        if (gradient.norm() >= kLeastGradient) lines.push_back({{double(column), double(row)}, gradient.normalized()});
      }
    }
  }
  TipMeasurement tip{expected_px, 0, 0};
  double scale = 0.5;  // limit of the sine of a line's angle off the radius; it shrinks to 0.15
  for (int iteration = 0; iteration < kCircleIterations; ++iteration) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double squares = 0;
    tip.edges = 0;
    for (const Line& line : lines) {
      const Eigen::Vector2d from = line.at - tip.centre_px;
      const double radius = from.norm();
      if (radius < kNearest_px || radius > reach_px) continue;
      const double sine = line.normal.dot(from) / radius;
      if (std::abs(sine) > scale) continue;
      normal += line.normal * line.normal.transpose() / (radius * radius);
      right += line.normal * sine / radius;
      squares += sine * sine;
      ++tip.edges;
    }
    if (tip.edges < kLeastEdges) return std::nullopt;
    tip.centre_px += normal.ldlt().solve(right);
    // Factor 10: pixels of one edge are not independent; an edge is some three pixels wide, and images are much alike.
    const Eigen::Matrix2d covariance = 10 * squares / double(tip.edges) * normal.inverse();
    tip.sigma_px = std::max(kLeastTipSigma_px, std::sqrt(std::max(covariance(0, 0), covariance(1, 1))));
    scale = std::max(0.15, 0.8 * scale);
  }
  if ((tip.centre_px - expected_px).norm() > reach_px) return std::nullopt;
  return tip;
}

}  // namespace twocone::vision
