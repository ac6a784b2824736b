// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vision/dense/panorama.h"

namespace twocone::vision {
namespace {

// Slopes, azimuths.
const cv::Size kWindow(9, 7);
constexpr int kRounds = 3;
// A correction of one round is at most this.
constexpr float kMost_px = 1;
// The gain of the upper view over the lower one is 1 within this standard deviation, unless the images say otherwise.
constexpr float kGainSigma = 0.3F;
// Variance of a central difference of pixels whose noise has the variance 1.
constexpr float kGradientNoise = 0.5F;
// Error of a disparity by interpolation, blur and what windows mix.
constexpr float kFloor_px = 0.05F;

cv::Mat gradient_of(const cv::Mat& panorama) {
  cv::Mat gradient;
  const cv::Mat kernel = (cv::Mat_<float>(1, 3) << -0.5F, 0, 0.5F);
  cv::filter2D(panorama, gradient, CV_32F, kernel, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return gradient;
}

cv::Mat summed(const cv::Mat& values) {
  cv::Mat sum;
  cv::boxFilter(values, sum, CV_32F, kWindow, {-1, -1}, false);
  return sum;
}

/// WindowSums over windows of weight, upper u, gradient g, residual r, and their products.
struct WindowSums {
  cv::Mat n, u, g, r, uu, ug, gg, ur, gr, rr;
};

}  // namespace

RefinedDisparities refine(const PanoramaPair& pair, const cv::Mat& start_px, const cv::Mat& is_matched,
                          const std::vector<float>& widths_px) {
  const cv::Size size = pair.lower.size();
  cv::Mat disparity = with_seam(start_px);
  const cv::Mat matched = with_seam(is_matched);
  const cv::Mat gradient = gradient_of(pair.upper);
  cv::Mat columns(size, CV_32F);
  cv::Mat rows(size, CV_32F);
  for (int a = 0; a < size.height; ++a) rows.row(a).setTo(a);
  cv::Mat weight(size, CV_32F);
  cv::Mat warped;
  cv::Mat slope;
  cv::Mat sigma(size, CV_32F, cv::Scalar(std::numeric_limits<float>::infinity()));
  cv::Mat texture(size, CV_32F, cv::Scalar(0));
  cv::Mat misfit(size, CV_32F, cv::Scalar(0));
  std::vector<cv::Mat> products(9);
  for (cv::Mat& product : products) product.create(size, CV_32F);
  for (int round = 0; round < kRounds; ++round) {
    for (int a = 0; a < size.height; ++a) {
      const auto* d = disparity.ptr<float>(a);
      const auto* m = matched.ptr<std::uint8_t>(a);
      const auto* shown = pair.upper_shown.ptr<std::uint8_t>(a);
      auto* column = columns.ptr<float>(a);
      auto* w = weight.ptr<float>(a);
      for (int i = 0; i < size.width; ++i) {
        column[i] = std::clamp(static_cast<float>(i) - d[i], 0.F, static_cast<float>(size.width - 1));
        w[i] = m[i] != 0 && shown[static_cast<int>(column[i])] != 0 ? 1.F : 0.F;
      }
    }
    cv::remap(pair.upper, warped, columns, rows, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::remap(gradient, slope, columns, rows, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    for (int a = 0; a < size.height; ++a) {
      const auto* l = pair.lower.ptr<float>(a);
      const auto* up = warped.ptr<float>(a);
      const auto* gr = slope.ptr<float>(a);
      const auto* w = weight.ptr<float>(a);
      std::array<float*, 9> p{};
      for (std::size_t k = 0; k < p.size(); ++k) p[k] = products[k].ptr<float>(a);
      for (int i = 0; i < size.width; ++i) {
        // Differences of one level keep the digits of sums of squares.
        const float u = w[i] * up[i];
        const float g = w[i] * gr[i];
        const float r = w[i] * (l[i] - up[i]);
        p[0][i] = u;
        p[1][i] = g;
        p[2][i] = r;
        p[3][i] = u * u;
        p[4][i] = u * g;
        p[5][i] = g * g;
        p[6][i] = u * r;
        p[7][i] = g * r;
        p[8][i] = r * r;
      }
    }
    const WindowSums sums{summed(weight),      summed(products[0]), summed(products[1]), summed(products[2]),
                    summed(products[3]), summed(products[4]), summed(products[5]), summed(products[6]),
                    summed(products[7]), summed(products[8])};
    const bool is_last = round + 1 == kRounds;
    for (int a = 0; a < size.height; ++a) {
      auto* d = disparity.ptr<float>(a);
      for (int i = 0; i < size.width; ++i) {
        const float n = sums.n.at<float>(a, i);
        if (n < 8) continue;
        const auto centred = [&](const cv::Mat& xy, const cv::Mat& x, const cv::Mat& y) {
          return xy.at<float>(a, i) - x.at<float>(a, i) * y.at<float>(a, i) / n;
        };
        const float uu = centred(sums.uu, sums.u, sums.u) + 1 / (kGainSigma * kGainSigma);
        const float ug = centred(sums.ug, sums.u, sums.g);
        const float gg = centred(sums.gg, sums.g, sums.g);
        const float ur = centred(sums.ur, sums.u, sums.r);
        const float gr = centred(sums.gr, sums.g, sums.r);
        const float rr = centred(sums.rr, sums.r, sums.r);
        const float width = std::min(1.F, widths_px[std::size_t(i)]);
        // Without what a gain explains.
        const float net = gg - ug * ug / uu;
        const float pull = gr - ur * ug / uu;
        const float noise = kGradientNoise * n;
        const float signal = net - noise;
        if (!is_last) {
          if (net > 0) d[i] -= std::clamp(pull / (net + noise), -kMost_px, kMost_px);
          continue;
        }
        const float residual = std::max(0.F, rr - ur * ur / uu - (net > 0 ? pull * pull / net : 0)) / n;
        const float gain = 1 + ur / uu;
        const float expected = 1 + gain * gain;
        misfit.at<float>(a, i) = residual / expected;
        texture.at<float>(a, i) = net / noise;
        if (signal > 0) {
          sigma.at<float>(a, i) = std::sqrt(std::max(expected, residual) / (signal * width) + kFloor_px * kFloor_px);
        }
      }
    }
  }
  return {without_seam(disparity), without_seam(sigma), without_seam(texture), without_seam(misfit)};
}

}  // namespace twocone::vision
