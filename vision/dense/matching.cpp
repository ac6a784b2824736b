// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/matching.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vision/dense/panorama.h"

namespace twocone::vision {
namespace {

using Byte = std::uint8_t;

constexpr int kHalfSeam = kSeam / 2;
// Window of the local mean and deviation, in halved pixels: azimuths, slopes.
const cv::Size kLocalWindow(9, 5);
// A deviation of a halved image that noise alone has is 1/2 at most; well above it, the cost no longer depends on it.
constexpr double kPlainDeviation = 1.5;
constexpr float kUnit = 32;   // of the normalised image, as a byte
constexpr int kTruncated = 63;  // costs of one pixel are cut there: occlusions and highlights
// Costs of a cell are the sum of 3 x 3 pixels / 4, so at most 141.
constexpr Byte kOutside = 170;
constexpr Byte kStep = 5;    // P1 of the paper
constexpr Byte kJump = 40;   // P2; with kStep, sums stay below 256
constexpr Byte kUnreached = 250 - kStep;
static_assert(kOutside + kJump + kStep < 256);

/// Returns the image at half the resolution, less its local mean and over its local deviation.
cv::Mat normalised(const cv::Mat& panorama) {
  cv::Mat half;
  cv::resize(panorama, half, {panorama.cols / 2, panorama.rows / 2}, 0, 0, cv::INTER_AREA);
  cv::Mat mean;
  cv::Mat square;
  cv::blur(half, mean, kLocalWindow);
  cv::sqrBoxFilter(half, square, CV_32F, kLocalWindow);
  cv::Mat bytes(half.size(), CV_8U);
  for (int row = 0; row < half.rows; ++row) {
    const auto* in = half.ptr<float>(row);
    const auto* m = mean.ptr<float>(row);
    const auto* s = square.ptr<float>(row);
    auto* out = bytes.ptr<Byte>(row);
    constexpr auto kFloor = static_cast<float>(kPlainDeviation * kPlainDeviation);
    for (int i = 0; i < half.cols; ++i) {
      const float variance = std::max(0.F, s[i] - m[i] * m[i]) + kFloor;
      const float value = 128 + kUnit * (in[i] - m[i]) / std::sqrt(variance);
      out[i] = static_cast<Byte>(std::clamp(value, 0.F, 255.F));
    }
  }
  return bytes;
}

/// Returns where all four pixels of a halved one are shown.
cv::Mat halved_shown(const cv::Mat& shown) {
  cv::Mat half;
  cv::resize(shown, half, {shown.cols / 2, shown.rows / 2}, 0, 0, cv::INTER_AREA);
  return half == 255;
}

/// The cells of one azimuth: slopes x disparities, disparities contiguous.
class Matcher {
 public:
  Matcher(const PanoramaPair& pair, int greatest_px)
      : lower_(normalised(pair.lower)),
        upper_(normalised(pair.upper)),
        lower_shown_(halved_shown(pair.lower_shown)),
        upper_hidden_(~halved_shown(pair.upper_shown) & kTruncated),
        azimuths_(lower_.rows),
        slopes_(lower_.cols),
        disparities_(std::min(slopes_, greatest_px / 2 + 2)),
        stride_((disparities_ + 2 + 15) / 16 * 16) {
    cv::flip(upper_, upper_, 1);  // so that disparities ascend along the columns
    cv::flip(upper_hidden_, upper_hidden_, 1);
  }

  MatchedDisparities run() {
    const std::size_t cells = std::size_t(slopes_) * std::size_t(stride_);
    costs_.assign(cells * std::size_t(azimuths_), kOutside);
    fill_costs();
    ascending_.assign(cells * std::size_t(azimuths_), 0);
    for (int azimuth = 0; azimuth < azimuths_ - kHalfSeam; ++azimuth) across(azimuth, azimuth - 1, ascending_);
    const int inner = azimuths_ - 2 * kHalfSeam;
    MatchedDisparities matched{cv::Mat(inner, slopes_, CV_32F, cv::Scalar(0)),
                               cv::Mat(inner, slopes_, CV_8U, cv::Scalar(0)),
                               cv::Mat(inner, slopes_, CV_8U, cv::Scalar(0))};
    std::array<std::vector<Byte>, 2> descending{std::vector<Byte>(cells), std::vector<Byte>(cells)};
    sums_.assign(cells, 0);
    outwards_.assign(cells, 0);
    inwards_.assign(cells, 0);
    for (int azimuth = azimuths_ - 1; azimuth >= kHalfSeam; --azimuth) {
      step_all(cost(azimuth), azimuth == azimuths_ - 1 ? nullptr : descending[0].data(), descending[1].data());
      std::swap(descending[0], descending[1]);
      if (azimuth >= azimuths_ - kHalfSeam) continue;
      along(azimuth);
      const Byte* const up = &ascending_[cells * std::size_t(azimuth)];
      for (std::size_t k = 0; k < cells; ++k) {
        sums_[k] = static_cast<std::uint16_t>(up[k] + descending[0][k] + outwards_[k] + inwards_[k]);
      }
      choose(azimuth - kHalfSeam, matched);
    }
    return matched;
  }

 private:
  [[nodiscard]] Byte* cost(int azimuth) {
    return &costs_[std::size_t(azimuth) * std::size_t(slopes_) * std::size_t(stride_)];
  }

  /// Costs of single pixels of one azimuth: slopes x stride.
  void raw_costs(int azimuth, std::vector<Byte>& raw) const {
    const auto* lower = lower_.ptr<Byte>(azimuth);
    const auto* shown = lower_shown_.ptr<Byte>(azimuth);
    const auto* upper = upper_.ptr<Byte>(azimuth);
    const auto* hidden = upper_hidden_.ptr<Byte>(azimuth);
    for (int i = 0; i < slopes_; ++i) {
      Byte* const out = &raw[std::size_t(i) * std::size_t(stride_)];
      const int count = std::min(i + 1, disparities_);
      if (shown[i] == 0) {
        std::fill_n(out, stride_, Byte(kTruncated));
        continue;
      }
      const Byte value = lower[i];
      const Byte* const other = upper + (slopes_ - 1 - i);
      const Byte* const unseen = hidden + (slopes_ - 1 - i);
      for (int d = 0; d < count; ++d) {
        const Byte high = std::max(value, other[d]);
        const Byte low = std::min(value, other[d]);
        const auto difference = static_cast<Byte>(high - low);
        out[d] = std::max(std::min(difference, Byte(kTruncated)), unseen[d]);
      }
      std::fill(out + count, out + stride_, Byte(kTruncated));
    }
  }

  /// Sums the costs of 3 x 3 pixels with the same disparity.
  void fill_costs() {
    const std::size_t cells = std::size_t(slopes_) * std::size_t(stride_);
    std::array<std::vector<Byte>, 3> raw;
    raw.fill(std::vector<Byte>(cells));
    std::vector<Byte> across(cells);
    raw_costs(0, raw[0]);
    raw_costs(0, raw[1]);
    for (int azimuth = 0; azimuth < azimuths_; ++azimuth) {
      raw_costs(std::min(azimuth + 1, azimuths_ - 1), raw[2]);
      for (std::size_t k = 0; k < cells; ++k) {
        across[k] = static_cast<Byte>(raw[0][k] + raw[1][k] + raw[2][k]);  // at most 189
      }
      Byte* const out = cost(azimuth);
      for (int i = 0; i < slopes_; ++i) {
        const Byte* const before = &across[std::size_t(std::max(i - 1, 0)) * std::size_t(stride_)];
        const Byte* const here = &across[std::size_t(i) * std::size_t(stride_)];
        const Byte* const after = &across[std::size_t(std::min(i + 1, slopes_ - 1)) * std::size_t(stride_)];
        Byte* const sum = out + std::size_t(i) * std::size_t(stride_);
        const int count = std::min(i + 1, disparities_);
        for (int d = 0; d < count; ++d) {
          sum[d] = static_cast<Byte>(static_cast<std::uint16_t>(before[d] + here[d] + after[d]) >> 2);
        }
      }
      std::rotate(raw.begin(), raw.begin() + 1, raw.end());
    }
  }

  /// One step of a path: the costs of a slope's disparities, given those of the path's previous pixel.
  void step(const Byte* costs, const Byte* previous, Byte* out) const {
    Byte least = 255;
    for (int d = 0; d < disparities_; ++d) least = std::min(least, previous[d]);
    const auto jump = static_cast<Byte>(least + kJump);
    // The first and the last disparity have one neighbour.
    const auto one = [&](int d, Byte below, Byte above) {
      const Byte best = std::min(std::min(previous[d], jump),
                                 std::min(static_cast<Byte>(below + kStep), static_cast<Byte>(above + kStep)));
      return static_cast<Byte>(costs[d] + best - least);
    };
    if (disparities_ == 1) {
      out[0] = one(0, kUnreached, kUnreached);
      return;
    }
    out[0] = one(0, kUnreached, previous[1]);
    for (int d = 1; d < disparities_ - 1; ++d) {
      const Byte best = std::min(std::min(previous[d], jump), std::min(static_cast<Byte>(previous[d - 1] + kStep),
                                                                       static_cast<Byte>(previous[d + 1] + kStep)));
      out[d] = static_cast<Byte>(costs[d] + best - least);
    }
    out[disparities_ - 1] = one(disparities_ - 1, previous[disparities_ - 2], kUnreached);
  }

  /// The same for all slopes of an azimuth. @param previous null: the path begins here
  void step_all(const Byte* costs, const Byte* previous, Byte* out) const {
    const std::size_t cells = std::size_t(slopes_) * std::size_t(stride_);
    if (previous == nullptr) {
      std::copy_n(costs, cells, out);
      return;
    }
    for (int i = 0; i < slopes_; ++i) {
      const std::size_t at = std::size_t(i) * std::size_t(stride_);
      step(costs + at, previous + at, out + at);
    }
  }

  void across(int azimuth, int previous, std::vector<Byte>& paths) {
    const std::size_t cells = std::size_t(slopes_) * std::size_t(stride_);
    step_all(cost(azimuth), previous < 0 ? nullptr : &paths[cells * std::size_t(previous)],
             &paths[cells * std::size_t(azimuth)]);
  }

  /// The two paths along the radius.
  void along(int azimuth) {
    const Byte* const costs = cost(azimuth);
    const auto at = [this](int i) { return std::size_t(i) * std::size_t(stride_); };
    std::copy_n(costs, stride_, outwards_.data());
    for (int i = 1; i < slopes_; ++i) step(costs + at(i), &outwards_[at(i - 1)], &outwards_[at(i)]);
    std::copy_n(costs + at(slopes_ - 1), stride_, &inwards_[at(slopes_ - 1)]);
    for (int i = slopes_ - 2; i >= 0; --i) step(costs + at(i), &inwards_[at(i + 1)], &inwards_[at(i)]);
  }

  /// Chooses the disparities of an azimuth from `sums_`.
  void choose(int azimuth, MatchedDisparities& matched) {
    // Of the upper view's pixels, by slopes_ - 1 - slope.
    std::vector<std::uint16_t> least(std::size_t(slopes_), std::numeric_limits<std::uint16_t>::max());
    std::vector<std::uint16_t> least_at(std::size_t(slopes_), 0);
    std::vector<int> chosen(std::size_t(slopes_), 0);
    auto* disparity = matched.disparity_px.ptr<float>(azimuth);
    auto* unchecked = matched.is_unchecked.ptr<Byte>(azimuth);
    auto* repeated = matched.is_repeated.ptr<Byte>(azimuth);
    for (int i = 0; i < slopes_; ++i) {
      const std::uint16_t* const sum = &sums_[std::size_t(i) * std::size_t(stride_)];
      const int count = std::min(i + 1, disparities_);
      std::uint16_t* const of_upper = &least[std::size_t(slopes_ - 1 - i)];
      std::uint16_t* const at_upper = &least_at[std::size_t(slopes_ - 1 - i)];
      std::uint16_t best = sum[0];
      for (int d = 0; d < count; ++d) best = std::min(best, sum[d]);
      for (int d = 0; d < count; ++d) {
        const bool is_less = sum[d] < of_upper[d];
        of_upper[d] = is_less ? sum[d] : of_upper[d];
        at_upper[d] = is_less ? static_cast<std::uint16_t>(d) : at_upper[d];
      }
      const int d = static_cast<int>(std::find(sum, sum + count, best) - sum);
      chosen[std::size_t(i)] = d;
      float exact = static_cast<float>(d);
      if (d > 0 && d + 1 < count) {
        const float curvature = static_cast<float>(sum[d - 1] + sum[d + 1] - 2 * best);
        if (curvature > 0) exact += 0.5F * static_cast<float>(sum[d - 1] - sum[d + 1]) / curvature;
      }
      disparity[i] = 2 * exact;
      constexpr int kApart = 3;
      std::uint16_t second = std::numeric_limits<std::uint16_t>::max();
      for (int k = 0; k <= d - kApart; ++k) second = std::min(second, sum[k]);
      for (int k = d + kApart; k < count; ++k) second = std::min(second, sum[k]);
      repeated[i] = second < best + kUnique + best / 32 ? 255 : 0;
    }
    for (int i = 0; i < slopes_; ++i) {
      const int d = chosen[std::size_t(i)];
      const int back = least_at[std::size_t(slopes_ - 1 - i + d)];
      unchecked[i] = std::abs(back - d) > 1 ? 255 : 0;
    }
  }

  static constexpr int kUnique = 6;

  cv::Mat lower_, upper_, lower_shown_, upper_hidden_;
  int azimuths_, slopes_, disparities_, stride_;
  std::vector<Byte> costs_, ascending_, outwards_, inwards_;
  std::vector<std::uint16_t> sums_;
};

}  // namespace

MatchedDisparities match(const PanoramaPair& pair, int greatest_px) { return Matcher(pair, greatest_px).run(); }

}  // namespace twocone::vision
