// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/outline_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

namespace twocone::vision {
namespace {

using Unknowns = Eigen::Matrix<double, 6, 1>;

// These four values are tuned by hand on synthetic images; no test fixes them.
constexpr double kLeastEdgeSamples = 8;
constexpr int kFitIterations = 12;
constexpr double kHuber = 3;        // larger residuals, in standard deviations, get less weight
constexpr double kMostStep_px = 3;  // one step is at most half of it; a total of four times as much is a failure

// The scores of this number of neighbours along a side, or the arc, are taken as correlated: neighbours share the
// colours that they are compared with, and a textured background moves a dozen of them together. The edges between
// bands have no background. Tuned by hand on designed rooms with printed walls; outline_statistics_test.cpp and
// banded_landmarks_test.cpp limit the error that results but do not fix them.
struct Lags {
  std::size_t side, arc;
};
constexpr Lags kLags{8, 2};
constexpr Lags kBandLags{2, 1};

/// Returns the share of a rim's bend that counts where it is blurred: the bend of a rim that is no wider than its blur
/// is no parabola over that width. Measured in blurred synthetic images; outline_ranging_test.cpp, DefocusMovesNoEdge,
/// limits the error that results but does not fix it.
double bend_share(double rim_px, double blur_px) { return std::clamp((rim_px / blur_px - 1.2) / 1.2, 0.0, 1.0); }

}  // namespace

std::optional<OutlineFit> fit_outline(const EdgeSamples& read, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits) {
  std::array<int, 3> all{};
  std::array<int, 3> usable{};
  for (const EdgeSample& s : read.edge_samples) {
    ++all[s.part];
    if (s.is_usable) ++usable[s.part];
  }
  if (usable[0] + usable[1] + usable[2] < kLeastEdgeSamples || (cylinder.bands && all[Outline::kArc] == 0)) {
    return std::nullopt;
  }
  const auto share = [&](Outline::Part part) { return all[part] > 0 ? double(usable[part]) / all[part] : 0.0; };

  // The unknowns are range and bearing, both in pixels at the near point, the blur, and, where they are in doubt, the
  // width's relative error, the lean, and the height. Without these, sides that contradict the believed rig would move
  // the top, and heights of bands that contradict their size would move them all.
  const Eigen::Vector3d doubts(cylinder.width_doubt, cylinder.lean_doubt_rad, cylinder.height_doubt_m);
  const bool has_doubt = !doubts.isZero(0);
  // Without a doubt, an unknown stays 0.
  constexpr double kCertain = 1e12;
  const Eigen::Vector3d prior = (doubts.array() > 0).select(doubts.array().square().inverse(), kCertain);
  const double rim_px = outline.vertices[Outline::kSideSegments].chord_px;
  const double range_px = outline.near.by_range_pxpm.norm();
  const double bearing_px = outline.near.by_bearing_pxprad.norm();
  Unknowns unknown;
  unknown << 0, 0, limits.least_blur_px, 0, 0, 0;
  OutlineFit fit;
  Eigen::Matrix<double, 6, 6> normal;

  /// How far the outline moves outwards by a unit of range, of bearing and of blur, and how far it and the opposite
  /// side have moved. Range, width and height move both sides outwards, bearing and lean one outwards and the other
  /// inwards. The straight edge that cuts a pixel into the same areas as a bent one lies inside it by the mean of a
  /// parabola, which grows with the square of the blur.
  struct Motion {
    double range_part, bearing_part, blur_part, out_px, opposite_px;
  };
  const auto motion_of = [&](const EdgeSample& s) -> Motion {
    const double range_part = s.by_range_pxpm / range_px;
    const double bearing_part = s.by_bearing_pxprad / bearing_px;
    const double both_px = range_part * unknown[0] + s.by_width_px * unknown[3] + s.by_height_pxpm * unknown[5];
    const double apart_px = bearing_part * unknown[1] + s.by_lean_px * unknown[4];
    const double blur = unknown[2];
    const double bend_px = bend_share(rim_px, blur) * s.bend_px;
    return {range_part, bearing_part, -2 * bend_px * blur, both_px + apart_px - bend_px * (blur * blur - 1),
            both_px - apart_px};
  };
  struct Model {
    double value, by_out, by_opposite, by_blur;
  };
  const auto model = [&](const EdgeSample& s, const EdgePixel& p, const Motion& moved) -> Model {
    const double width = unknown[2];
    const double inside = p.inside_px + moved.out_px;
    const Coverage c = coverage(inside, s.wide * width, s.narrow * width);
    Model m{c.value, c.slope, 0, c.slope * (moved.blur_part - inside / width)};
    if (s.width_px < 8 * width) {  // the opposite side may cross this pixel too
      const double far_inside = s.width_px - p.inside_px + moved.opposite_px;
      const Coverage far = coverage(far_inside, s.wide * width, s.narrow * width);
      m.value += far.value - 1;
      m.by_opposite = far.slope;
      m.by_blur -= far.slope * far_inside / width;
    }
    return m;
  };
  // The variance of coverage for a noise of one grey level: that of the pixel and that of the colours compared with it.
  const auto grey_variance_of = [](const EdgeSample& s, const EdgePixel& p, double inner) {
    return p.variance * (1 + inner * inner * s.inside_noise + (1 - inner) * (1 - inner) * s.outside_noise);
  };
  const auto variance_of = [&](const EdgeSample& s, const EdgePixel& p, double c) {
    const double inner = std::clamp(c, 0.0, 1.0);
    return s.doubt + noise.code_variance * grey_variance_of(s, p, inner) +
           noise.sampling * std::max(inner * (1 - inner), 0.02);
  };

  for (int iteration = 0; iteration < kFitIterations; ++iteration) {
    // The lower half of the normal equations, and their right side.
    double n00 = 0, n10 = 0, n11 = 0, n20 = 0, n21 = 0, n22 = 0, r0 = 0, r1 = 0, r2 = 0;
    Eigen::Matrix3d doubts_by_others = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d doubts_normal = prior.asDiagonal();
    Eigen::Vector3d doubts_right = -(prior.array() * unknown.tail<3>().array());
    for (const EdgeSample& s : read.edge_samples) {
      if (!s.is_usable) continue;
      const Motion moved = motion_of(s);
      for (int i = s.first; i < s.first + s.count; ++i) {
        const EdgePixel& p = read.pixels[std::size_t(i)];
        if (s.width_px >= 8 * unknown[2] &&
            std::abs(p.inside_px + moved.out_px) >= (s.wide + s.narrow) / 2 * unknown[2])
          continue;
        const Model m = model(s, p, moved);
        const double variance = variance_of(s, p, m.value);
        const double residual = p.coverage - m.value;
        double weight = 1 / variance;
        const double squared = residual * residual * weight;
        if (squared > kHuber * kHuber) weight *= kHuber / std::sqrt(squared);
        const double by_range = moved.range_part * (m.by_out + m.by_opposite);
        const double by_bearing = moved.bearing_part * (m.by_out - m.by_opposite);
        n00 += weight * by_range * by_range;
        n10 += weight * by_bearing * by_range;
        n11 += weight * by_bearing * by_bearing;
        n20 += weight * m.by_blur * by_range;
        n21 += weight * m.by_blur * by_bearing;
        n22 += weight * m.by_blur * m.by_blur;
        r0 += weight * residual * by_range;
        r1 += weight * residual * by_bearing;
        r2 += weight * residual * m.by_blur;
        if (!has_doubt) continue;
        const double both = m.by_out + m.by_opposite;
        const Eigen::Vector3d by_doubts(s.by_width_px * both, s.by_lean_px * (m.by_out - m.by_opposite),
                                        s.by_height_pxpm * both);
        doubts_by_others += weight * by_doubts * Eigen::RowVector3d(by_range, by_bearing, m.by_blur);
        doubts_normal += weight * by_doubts * by_doubts.transpose();
        doubts_right += weight * residual * by_doubts;
      }
    }
    normal.topLeftCorner<3, 3>() << n00, n10, n20, n10, n11, n21, n20, n21, n22;
    normal.bottomLeftCorner<3, 3>() = doubts_by_others;
    normal.topRightCorner<3, 3>() = doubts_by_others.transpose();
    normal.bottomRightCorner<3, 3>() = doubts_normal;
    Unknowns right;
    right << r0, r1, r2, doubts_right;
    // Only the data determine the blur. This term, of a standard deviation of 0.5 px, limits its steps: otherwise it
    // would diverge where few pixels lie on the edge. Tuned by hand on synthetic images; no test fixes it.
    constexpr double kBlurInformation = 1 / (0.5 * 0.5);
    normal(2, 2) += kBlurInformation;
    const Unknowns step = normal.ldlt().solve(right);
    if (!step.allFinite()) return std::nullopt;
    const double length = step.head<2>().norm();
    const double share_of_step = length > kMostStep_px / 2 ? kMostStep_px / 2 / length : 1;
    unknown += share_of_step * step;
    unknown[2] = std::clamp(unknown[2], limits.least_blur_px, limits.most_blur_px);
    if (unknown.head<2>().norm() > 4 * kMostStep_px) return std::nullopt;
    if (length < limits.converged_px) break;
  }

  // Scores of the edge samples at the answer.
  std::array<double, 3> side_score{};
  std::array<double, 3> side_information{};
  std::array<double, 3> side_widening{};  // sum of by_width_px times the information
  std::array<double, 3> side_width{};     // sum of width_px times the information
  // The equations' right side for rows whose bearing differs by their distance from the near point's. The answer is the
  // row that the fitted bearing is of: where the sides may lean, they do so, and the bearing changes less.
  Unknowns by_rows = Unknowns::Zero();
  const double near_row = outline.near.pixel_px.y();
  const Lags& lags = cylinder.bands ? kBandLags : kLags;
  std::array<double, kLags.side> earlier{};  // scores of the samples before, the nearest first
  Outline::Part part = Outline::kLeft;
  int arc_samples = 0;
  for (const EdgeSample& s : read.edge_samples) {
    if (!s.is_usable || s.part != part) earlier.fill(0);
    part = s.part;
    if (!s.is_usable) continue;
    const Motion moved = motion_of(s);
    double score = 0;
    double information = 0;
    for (int i = s.first; i < s.first + s.count; ++i) {
      const EdgePixel& p = read.pixels[std::size_t(i)];
      const Model m = model(s, p, moved);
      if (m.by_out == 0) continue;
      const double inner = std::clamp(m.value, 0.0, 1.0);
      const double residual = p.coverage - m.value;
      const double sigma = std::sqrt(variance_of(s, p, m.value));
      const double bounded = std::clamp(residual / sigma, -kHuber, kHuber);
      score += m.by_out * bounded / sigma;
      information += m.by_out * m.by_out / (sigma * sigma);
      const double both = m.by_out + m.by_opposite;
      const double apart = m.by_out - m.by_opposite;
      Unknowns by;
      by << moved.range_part * both, moved.bearing_part * apart, m.by_blur, s.by_width_px * both, s.by_lean_px * apart,
          s.by_height_pxpm * both;
      by_rows += moved.bearing_part * apart * (double(s.row) - near_row) / (sigma * sigma) * by;
      fit.edges.residual += residual * residual;
      fit.edges.grey += grey_variance_of(s, p, inner);
      fit.edges.spread += inner * (1 - inner);
      const double measured = std::clamp(double(p.coverage), 0.0, 1.0);
      fit.edges.mixed += measured * (1 - measured);
    }
    Scores& scores = s.part == Outline::kArc ? fit.arc_scores : fit.side_scores;
    const auto reach = std::ptrdiff_t(s.part == Outline::kArc ? lags.arc : lags.side);
    scores.found += score * (score + 2 * std::accumulate(earlier.begin(), earlier.begin() + reach, 0.0));
    scores.expected += information;
    if (s.part == Outline::kArc) ++arc_samples;
    std::rotate(earlier.begin(), earlier.end() - 1, earlier.end());
    earlier.front() = score;
    fit.length_px += 1 / s.wide;
    side_score[s.part] += score;
    side_information[s.part] += information;
    side_widening[s.part] += information * s.by_width_px;
    side_width[s.part] += information * s.width_px;
  }
  if (!(fit.arc_scores.expected + fit.side_scores.expected > 0)) return std::nullopt;
  // The fit makes the sum of the arc's scores zero, which reduces the sum of their products. This corrects for it.
  fit.arc_scores.found /= std::max(0.2, 1 - (2.0 * double(lags.arc) + 1) / std::max(arc_samples, 1));
  // Eliminate the blur, which moves no edge, but for a thin landmark it is correlated with the width, and the width.
  const Eigen::Matrix2d pixels = normal.topLeftCorner<2, 2>() - normal.topRightCorner<2, 4>() *
                                                                    normal.bottomRightCorner<4, 4>().inverse() *
                                                                    normal.bottomLeftCorner<4, 2>();
  fit.exposed_row = near_row + normal.ldlt().solve(by_rows)[1];
  const Eigen::Vector2d scale(range_px, bearing_px);
  fit.information = scale.asDiagonal() * pixels * scale.asDiagonal();
  fit.cylinder = cylinder;
  fit.step = {unknown.x() / range_px, unknown.y() / bearing_px};
  fit.cylinder.range_m += fit.step.x();
  fit.cylinder.bearing_rad += fit.step.y();
  if (cylinder.height_doubt_m > 0) {
    fit.height_step_m = unknown[5];
    fit.cylinder.top_m += fit.height_step_m;
    const Eigen::Matrix<double, 6, 6> covariance = normal.inverse();
    const Eigen::Vector3d to_si(1 / range_px, 1 / bearing_px, 1);
    const std::array kept{0, 1, 5};
    fit.with_height = to_si.asDiagonal() * Eigen::Matrix3d(covariance(kept, kept)) * to_si.asDiagonal();
  }
  fit.edges.code_variance = read.code_variance;
  fit.outline = outline;
  fit.edges.blur = unknown[2];
  fit.left_support = share(Outline::kLeft);
  fit.arc_support = share(Outline::kArc);
  fit.right_support = share(Outline::kRight);
  if (side_information[Outline::kLeft] > 0 && side_information[Outline::kRight] > 0) {
    for (const Outline::Part side : {Outline::kLeft, Outline::kRight}) {
      fit.narrowness_px -= (side_score[side] + unknown[3] * side_widening[side]) / side_information[side];
      fit.mean_width_px += side_width[side] / side_information[side] / 2;
    }
    fit.sigma_narrowness_px = std::sqrt(1 / side_information[Outline::kLeft] + 1 / side_information[Outline::kRight]);
  }
  return fit;
}

}  // namespace twocone::vision
