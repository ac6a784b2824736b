// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vision/dense/panorama.h"
#include "vision/dense/row_kernels.h"

namespace twocone::vision {
namespace {

// A window reaches this far to either side: 19 slopes x 3 azimuths. Wider ones hold more of what is beside a thing.
// These and the numbers below were tuned by hand in rooms full of texture (bench/dense.cpp); no test fixes them.
constexpr int kSlopeReach = 9;
constexpr int kAzimuthReach = 1;
// Disparities that differ by more from what a window expects belong to other surfaces.
constexpr float kSame_px = 4;
// Likewise for the choice of what it expects. A level surface's disparity changes by no more than kMostSlant_px per
// slope where it can be matched; that of the floor does by 0.8 px.
constexpr float kOther_px = 3;
constexpr float kMostSlant_px = 2;
// A correction of one round is at most this.
constexpr float kMost_px = 1;
// The gain of the upper view over the lower one is 1 within this standard deviation, unless the images say otherwise.
constexpr float kGainSigma = 0.3F;
// Variance of a central difference of pixels whose noise has the variance 1.
constexpr float kGradientNoise = 0.5F;
// Error of a disparity by interpolation, blur and what windows mix.
constexpr float kFloor_px = 0.05F;
// The two views show a pixel's azimuth alike to so many pixels of the image: interpolation makes stairs of edges that
// are nearly along the radius, and they seem to have texture.
constexpr float kAcross_px = 0.35F;
// Where the gradient across is less than twice that along the radius, this matters little.
constexpr float kIsotropic = 4;
// Residuals that are no noise are alike over so many pixels of a window.
constexpr float kAlike = 8;
// Share of the variance of a window's disparities that is counted as variance of their mean: at an edge, a window holds
// disparities of both sides.
constexpr float kSpread = 1.0F;
// Fewer pixels are no window.
constexpr float kLeastPixels = 8;

/// Rows of what both views show of each pixel and its match.
class MatchedRows {
 public:
  MatchedRows(const PanoramaPair& pair, const cv::Mat& matched)
      : pair_(pair), matched_(matched), width_(pair.upper.cols), gradient_(std::size_t(width_)) {
    for (auto& row : rows_) {
      for (auto& values : row) values.assign(std::size_t(width_) + 2 * MatchedRow::kMargin, 0);
    }
  }

  /// Fills the row of an azimuth. It stays until 2 kAzimuthReach + 1 others have been filled.
  void fill(int azimuth, const cv::Mat& disparity) {
    const auto* upper = pair_.upper.ptr<float>(azimuth);
    const auto* shown = pair_.upper_shown.ptr<std::uint8_t>(azimuth);
    const auto* matched = matched_.ptr<std::uint8_t>(azimuth);
    const auto* d = disparity.ptr<float>(azimuth);
    for (int i = 1; i + 1 < width_; ++i) gradient_[std::size_t(i)] = (upper[i + 1] - upper[i - 1]) / 2;
    gradient_.front() = gradient_[1];
    gradient_.back() = gradient_[std::size_t(width_) - 2];
    auto& [u, g, r, of_match, weight] = rows_[std::size_t(azimuth) % rows_.size()];
    for (int i = 0; i < width_; ++i) {
      const float at = std::clamp(static_cast<float>(i) - d[i], 0.F, static_cast<float>(width_) - 1.001F);
      const int first = static_cast<int>(at);
      const float share = at - static_cast<float>(first);
      const std::size_t k = std::size_t(i) + MatchedRow::kMargin;
      of_match[k] = d[i];
      u[k] = upper[first] + share * (upper[first + 1] - upper[first]);
      g[k] =
          gradient_[std::size_t(first)] + share * (gradient_[std::size_t(first) + 1] - gradient_[std::size_t(first)]);
      const int level = pair_.blur->level(i, first);
      r[k] = pair_.lower[std::size_t(level)].at<float>(azimuth, i) - u[k];
      weight[k] = matched[i] != 0 && shown[first] != 0 ? 1.F : 0.F;
    }
  }

  [[nodiscard]] MatchedRow row(int azimuth) const {
    const auto& [u, g, r, d, weight] = rows_[std::size_t(azimuth) % rows_.size()];
    constexpr std::size_t kMargin = MatchedRow::kMargin;
    return {&u[kMargin], &g[kMargin], &r[kMargin], &d[kMargin], &weight[kMargin]};
  }

 private:
  const PanoramaPair& pair_;
  const cv::Mat& matched_;
  int width_;
  std::vector<float> gradient_;
  std::array<std::array<std::vector<float>, 5>, 2 * kAzimuthReach + 1> rows_;
};

/// Returns the mean, over the window of each pixel, of the squared gradient from azimuth to azimuth.
cv::Mat squares_across(const cv::Mat& panorama) {
  cv::Mat gradient;
  cv::Sobel(panorama, gradient, CV_32F, 0, 1, 1, 0.5);
  cv::Mat squares;
  cv::boxFilter(gradient.mul(gradient), squares, CV_32F, {2 * kSlopeReach + 1, 2 * kAzimuthReach + 1});
  return squares;
}

/// What the window of a pixel says.
struct Fit {
  float mean_px;        ///< of the window's disparities, less what the middle's lets expect
  float spread_px2;     ///< their variance
  float correction_px;  ///< of that mean
  float net;            ///< sum of squared gradients without what a gain explains
  float residual;       ///< variance that the fit leaves
  float gain;
  float whole;  ///< variance of the lower view
};

Fit fit(const WindowSums& sums, std::size_t i) {
  const auto at = [&](WindowSums::Sum sum) { return sums.of[sum][i]; };
  const float n = at(WindowSums::kN);
  constexpr float kGainWeight = 1 / (kGainSigma * kGainSigma);
  const float uu = at(WindowSums::kUu);
  const float ug = at(WindowSums::kUg);
  const float gg = at(WindowSums::kGg);
  const float ur = at(WindowSums::kUr);
  const float gr = at(WindowSums::kGr);
  const float rr = at(WindowSums::kRr);
  const float net = std::max(0.F, gg - ug * ug / (uu + kGainWeight));
  const float pull = gr - ur * ug / (uu + kGainWeight);
  const float damped = net + kGradientNoise * n;
  const float mean = at(WindowSums::kD) / n;
  return {mean,
          std::max(0.F, at(WindowSums::kDd) / n - mean * mean),
          -std::clamp(pull / damped, -kMost_px, kMost_px),
          net,
          std::max(0.F, rr - ur * ur / (uu + kGainWeight) - (net > 0 ? pull * pull / net : 0)) / n,
          1 + ur / (uu + kGainWeight),
          (rr + 2 * ur + uu) / n};
}

}  // namespace

RefinedDisparities refine(const PanoramaPair& pair, const cv::Mat& start_px, const cv::Mat& is_matched,
                          const std::vector<float>& widths_px, int rounds) {
  const cv::Size size = pair.upper.size();
  cv::Mat disparity = with_seam(start_px);
  const cv::Mat matched = with_seam(is_matched);
  cv::Mat sigma(size, CV_32F, cv::Scalar(std::numeric_limits<float>::infinity()));
  cv::Mat texture(size, CV_32F, cv::Scalar(0));
  cv::Mat misfit(size, CV_32F, cv::Scalar(0));
  const cv::Mat across = squares_across(pair.lower.front());
  MatchedRows rows(pair, matched);
  WindowSums sums{std::size_t(size.width)};
  std::vector<float> level(std::size_t(size.width) + MatchedRow::kMargin);
  for (int i = 0; i < size.width; ++i) {
    const double from_horizon = i - pair.floor->horizon;
    level[std::size_t(i)] = std::abs(from_horizon) < 1 ? 0 : static_cast<float>(1 / from_horizon);
  }
  std::vector<MatchedRow> window;
  for (int round = 0; round < rounds; ++round) {
    const bool is_last = round + 1 == rounds;
    cv::Mat corrected = disparity.clone();
    int filled = 0;
    for (int a = 0; a < size.height; ++a) {
      for (; filled <= std::min(a + kAzimuthReach, size.height - 1); ++filled) rows.fill(filled, disparity);
      window.clear();
      for (int k = std::max(0, a - kAzimuthReach); k <= std::min(a + kAzimuthReach, size.height - 1); ++k) {
        window.push_back(rows.row(k));
      }
      sum_windows(window, rows.row(a).disparity, {level.data(), kMostSlant_px, kOther_px}, std::size_t(size.width),
                  std::size_t(kSlopeReach), kSame_px, sums);
      auto* d = corrected.ptr<float>(a);
      for (int i = 0; i < size.width; ++i) {
        const float n = sums.of[WindowSums::kN][std::size_t(i)];
        if (n < kLeastPixels) continue;
        const Fit of = fit(sums, std::size_t(i));
        d[i] += of.mean_px + of.correction_px;
        if (!is_last) continue;
        const float noise = kGradientNoise * n;
        const float expected = 1 + of.gain * of.gain;
        const float width_px = widths_px[std::size_t(i)];
        const float steep = of.net / n;  // squared gradient along the radius
        const float off_across = kAcross_px * kAcross_px *
                                 std::max(0.F, across.at<float>(a, i) / (width_px * width_px) - kIsotropic * steep);
        texture.at<float>(a, i) = of.net / noise;
        // What the fit leaves of the lower view's variance that is not noise.
        misfit.at<float>(a, i) = std::max(0.F, of.residual - expected) / std::max(of.whole - 1, 1 / n);
        if (of.net > noise) {
          const float variance = expected + kAlike * (std::max(0.F, of.residual - expected) + off_across);
          sigma.at<float>(a, i) =
              std::sqrt(variance / ((of.net - noise) * std::min(1.F, width_px)) + kFloor_px * kFloor_px +
                        of.correction_px * of.correction_px + kSpread * of.spread_px2);
        }
      }
    }
    disparity = corrected;
  }
  return {without_seam(disparity), without_seam(sigma), without_seam(texture), without_seam(misfit)};
}

}  // namespace twocone::vision
