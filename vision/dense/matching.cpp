// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/matching.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "vision/dense/panorama.h"
#include "vision/dense/row_kernels.h"

namespace twocone::vision {
namespace {

using Byte = std::uint8_t;

constexpr int kHalfSeam = kSeam / 2;
// Window of the local mean and deviation, in halved pixels: slopes, azimuths. This and the numbers below were tuned by
// hand in rooms full of texture (bench/dense.cpp); no test fixes them.
const cv::Size kLocalWindow(11, 5);
// A deviation of a halved image that noise alone has is 1/2 at most; well above it, the cost no longer depends on it.
constexpr double kPlainDeviation = 1.5;
constexpr float kUnit = 28;     // of the normalised image, as a byte
constexpr int kTruncated = 63;  // costs of one pixel are cut there: occlusions and highlights
// Costs of a cell are the sum of 3 x 3 pixels / 4, so at most 141.
constexpr Byte kOutside = 170;
constexpr Byte kStep = 5;   // P1 of the paper
constexpr Byte kJump = 60;  // P2
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

/// Returns the upper view as it would be if its floor had the slopes that the lower view sees it at.
cv::Mat with_floor_of_lower(const cv::Mat& upper, const FloorLine& floor) {
  // The upper view spreads the floor over more slopes, which the lower view sees as one.
  const double spread = 1 - floor.per_slope;
  const int mean_of = std::max(1, static_cast<int>(std::lround(spread)));
  cv::Mat blurred;
  cv::blur(upper, blurred, {mean_of, 1});
  // An even window's mean is that of half a slope before its anchor.
  const double anchor = mean_of % 2 == 0 ? 0.5 : 0;
  const cv::Matx23d from_lower(spread, 0, anchor - floor.disparity_px(0), 0, 1, 0);
  cv::Mat warped;
  cv::warpAffine(blurred, warped, from_lower, upper.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return warped;
}

/// The cells of one azimuth: slopes x disparities, disparities contiguous.
class Matcher {
 public:
  Matcher(const PanoramaPair& pair, int greatest_px)
      : blur_(*pair.blur),
        upper_(normalised(pair.upper)),
        lower_shown_(halved_shown(pair.lower_shown)),
        upper_hidden_(~halved_shown(pair.upper_shown) & kTruncated),
        azimuths_(upper_.rows),
        slopes_(upper_.cols),
        disparities_(std::clamp(greatest_px / 2 + 2, 2, slopes_)),
        stride_((disparities_ + 2 + 15) / 16 * 16) {
    for (const cv::Mat& level : pair.lower) lower_.push_back(normalised(level));
    for (int i = 0; i < slopes_; ++i) {
      for (int d = 0; d < std::min(i + 1, disparities_); ++d) {
        const int level = blur_.level(2 * i, 2 * (i - d));
        if (d == 0 || runs_.back().level != level) runs_.push_back({i, d, d, level});
        ++runs_.back().end;
      }
    }
    if (pair.floor->is_shown()) {
      floor_ = normalised(with_floor_of_lower(pair.upper, *pair.floor));
      spread_ = static_cast<float>(1 - pair.floor->per_slope);
      for (int i = 0; i < slopes_; ++i) {
        floor_px_.push_back(static_cast<float>(pair.floor->disparity_px(2 * i + 0.5) / 2));
      }
    }
    cv::flip(upper_, upper_, 1);  // so that disparities ascend along the columns
    cv::flip(upper_hidden_, upper_hidden_, 1);
  }

  MatchedDisparities run() {
    const std::size_t cells = std::size_t(slopes_) * std::size_t(stride_);
    costs_.assign(cells * std::size_t(azimuths_), kOutside);
    fill_costs();
    ascending_.assign(cells * std::size_t(azimuths_), 0);
    for (int azimuth = 0; azimuth < azimuths_ - kHalfSeam; ++azimuth) {
      Byte* const path = &ascending_[cells * std::size_t(azimuth)];
      step_all(cost(azimuth), azimuth == 0 ? nullptr : path - cells, path);
    }
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
      add_four(up, descending[0].data(), outwards_.data(), inwards_.data(), cells, sums_.data());
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
    const auto* shown = lower_shown_.ptr<Byte>(azimuth);
    const auto* upper = upper_.ptr<Byte>(azimuth);
    const auto* hidden = upper_hidden_.ptr<Byte>(azimuth);
    std::ranges::fill(raw, Byte(kTruncated));
    for (const auto& [i, begin, end, level] : runs_) {
      if (shown[i] == 0) continue;
      const Byte value = lower_[std::size_t(level)].at<Byte>(azimuth, i);
      const int first = slopes_ - 1 - i + begin;
      Byte* const out = &raw[std::size_t(i) * std::size_t(stride_) + std::size_t(begin)];
      difference_costs(value, upper + first, hidden + first, std::size_t(end - begin), kTruncated, out);
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
    std::array<std::vector<std::uint16_t>, 3> raw_floor;
    if (!floor_.empty()) {
      raw_floor.fill(std::vector<std::uint16_t>(std::size_t(slopes_) * (2 * kFloorReach + 1)));
      raw_floor_costs(0, raw_floor[0]);
      raw_floor_costs(0, raw_floor[1]);
    }
    for (int azimuth = 0; azimuth < azimuths_; ++azimuth) {
      raw_costs(std::min(azimuth + 1, azimuths_ - 1), raw[2]);
      add_three(raw[0].data(), raw[1].data(), raw[2].data(), cells, across.data());  // at most 189
      Byte* const out = cost(azimuth);
      for (int i = 0; i < slopes_; ++i) {
        const Byte* const before = &across[std::size_t(std::max(i - 1, 0)) * std::size_t(stride_)];
        const Byte* const here = &across[std::size_t(i) * std::size_t(stride_)];
        const Byte* const after = &across[std::size_t(std::min(i + 1, slopes_ - 1)) * std::size_t(stride_)];
        Byte* const sum = out + std::size_t(i) * std::size_t(stride_);
        const int count = std::min(i + 1, disparities_);
        quarter_of_three(before, here, after, std::size_t(count), sum);
      }
      if (!floor_.empty()) {
        raw_floor_costs(std::min(azimuth + 1, azimuths_ - 1), raw_floor[2]);
        lower_by_floor(azimuth, raw_floor, out);
        std::rotate(raw_floor.begin(), raw_floor.begin() + 1, raw_floor.end());
      }
      std::rotate(raw.begin(), raw.begin() + 1, raw.end());
    }
  }

  /// Costs of single pixels of one azimuth whose disparity differs from the floor's by -kFloorReach to kFloorReach:
  /// slopes x (2 kFloorReach + 1).
  void raw_floor_costs(int azimuth, std::vector<std::uint16_t>& raw) const {
    const auto* row = floor_.ptr<Byte>(azimuth);
    std::size_t k = 0;
    for (int i = 0; i < slopes_; ++i) {
      const float floor_px = floor_px_[std::size_t(i)];
      const int nearest = static_cast<int>(std::lround(floor_px));
      for (int off = -kFloorReach; off <= kFloorReach; ++off, ++k) {
        // Where the warped view shows what the upper view has at that disparity.
        const float at = static_cast<float>(i) - (static_cast<float>(nearest + off) - floor_px) / spread_;
        const int first = std::clamp(static_cast<int>(at), 0, slopes_ - 2);
        const float share = at - static_cast<float>(first);
        const float value = static_cast<float>(row[first]) + share * static_cast<float>(row[first + 1] - row[first]);
        const int upper = std::clamp(i - nearest - off, 0, slopes_ - 1);
        const auto& lower = lower_[std::size_t(blur_.level(2 * i, 2 * upper))];
        const float difference = std::abs(static_cast<float>(lower.at<Byte>(azimuth, i)) - value);
        raw[k] = static_cast<std::uint16_t>(std::min(difference, static_cast<float>(kTruncated)));
      }
    }
  }

  /// Lowers the costs of an azimuth's cells near the floor's disparity to those of windows that follow the floor.
  /// @param raw of the azimuth before, the azimuth, and the one after
  void lower_by_floor(int azimuth, const std::array<std::vector<std::uint16_t>, 3>& raw, Byte* cells) const {
    constexpr std::size_t kOffs = 2 * kFloorReach + 1;
    for (int i = 1; i + 1 < slopes_ && floor_px_[std::size_t(i)] >= 1; ++i) {
      if (lower_shown_.at<Byte>(azimuth, i) == 0) continue;
      const int nearest = static_cast<int>(std::lround(floor_px_[std::size_t(i)]));
      for (std::size_t off = 0; off < kOffs; ++off) {
        const int d = nearest - kFloorReach + static_cast<int>(off);
        if (d < 0 || d >= std::min(i + 1, disparities_)) continue;
        if (upper_hidden_.at<Byte>(azimuth, slopes_ - 1 - (i - d)) != 0) continue;
        int sum = 0;
        for (const std::vector<std::uint16_t>& one : raw) {
          const std::size_t at = std::size_t(i) * kOffs + off;
          sum += one[at - kOffs] + one[at] + one[at + kOffs];
        }
        Byte& cell = cells[std::size_t(i) * std::size_t(stride_) + std::size_t(d)];
        cell = std::min(cell, static_cast<Byte>(sum / 4));
      }
    }
  }

  void step(const Byte* costs, const Byte* previous, Byte* out) const {
    path_step(costs, previous, std::size_t(disparities_), {kStep, kJump}, out);
  }

  /// One step of the paths of an azimuth's slopes. @param previous null: the path begins here
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

  /// The two paths along the radius.
  void along(int azimuth) {
    const Byte* const costs = cost(azimuth);
    const auto at = [this](int i) { return std::size_t(i) * std::size_t(stride_); };
    std::copy_n(costs, stride_, outwards_.data());
    for (int i = 1; i < slopes_; ++i) step(costs + at(i), &outwards_[at(i - 1)], &outwards_[at(i)]);
    std::copy_n(costs + at(slopes_ - 1), stride_, &inwards_[at(slopes_ - 1)]);
    for (int i = slopes_ - 2; i >= 0; --i) step(costs + at(i), &inwards_[at(i + 1)], &inwards_[at(i)]);
  }

  /// Returns where the lower view repeats along the radius, as a blind or a fence does, by slope: some shift of what is
  /// around a pixel matches it as well as no shift, beyond shifts that do not.
  [[nodiscard]] std::vector<Byte> repeats(int azimuth) const {
    const auto* const values = lower_[0].ptr<Byte>(azimuth);
    const auto window_sums = [this](const auto& of) {
      std::vector<int> sums(std::size_t(slopes_), 0);
      int sum = 0;
      for (int i = 0; i < slopes_ + kAlong; ++i) {
        if (i < slopes_) sum += of(i);
        if (i > 2 * kAlong) sum -= of(i - 2 * kAlong - 1);
        if (i >= kAlong) sums[std::size_t(i - kAlong)] = sum;
      }
      return sums;
    };
    const std::vector<int> deviations = window_sums([&](int i) { return std::abs(values[i] - 128); });
    std::vector<Byte> has_left(std::size_t(slopes_), 0);
    std::vector<Byte> found(std::size_t(slopes_), 0);
    for (int shift = 1; shift <= kLongestPeriod; ++shift) {
      const std::vector<int> differences = window_sums([&](int i) {
        const int shifted = i + shift < slopes_ ? i + shift : std::max(0, i - shift);
        return std::abs(values[i] - values[shifted]);
      });
      for (std::size_t i = 0; i < std::size_t(slopes_); ++i) {
        if (10 * differences[i] >= kUnlike * deviations[i]) has_left[i] = 1;
        if (has_left[i] != 0 && 10 * differences[i] < kAlike * deviations[i]) found[i] = 255;
      }
    }
    return found;
  }

  /// Chooses the disparities of an azimuth from `sums_`.
  void choose(int azimuth, MatchedDisparities& matched) {
    const std::vector<Byte> is_repeated = repeats(azimuth + kHalfSeam);
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
      repeated[i] = is_repeated[std::size_t(i)];
    }
    for (int i = 0; i < slopes_; ++i) {
      const int d = chosen[std::size_t(i)];
      const int of_upper = slopes_ - 1 - i + d;
      const int back = least_at[std::size_t(of_upper)];
      unchecked[i] = std::abs(back - d) > kChecked ? 255 : 0;
    }
  }

  static constexpr int kAlong = 8;           ///< reach of a window along the radius
  static constexpr int kLongestPeriod = 14;  ///< halved pixels
  // Differences of a window from its shifted one, in tenths of its deviation, that are of another texture, and of none.
  static constexpr int kUnlike = 8;
  static constexpr int kAlike = 5;
  static constexpr int kChecked = 2;     ///< halved pixels by which the upper view's own match may differ
  static constexpr int kFloorReach = 2;  ///< halved pixels by which a tilted robot or a low thing moves the floor

  const AcrossBlur& blur_;
  std::vector<cv::Mat> lower_;  ///< by level
  /// Disparities of a slope that need the same level. The level grows with the disparity.
  struct Run {
    int slope, begin, end, level;
  };
  std::vector<Run> runs_;
  cv::Mat upper_, lower_shown_, upper_hidden_;
  cv::Mat floor_;                ///< the upper view with the floor of the lower one; empty: no floor is shown
  std::vector<float> floor_px_;  ///< the floor's disparity by slope
  float spread_ = 1;             ///< slopes of the upper view for each slope of the lower one, on the floor
  int azimuths_, slopes_, disparities_, stride_;
  std::vector<Byte> costs_, ascending_, outwards_, inwards_;
  std::vector<std::uint16_t> sums_;
};

// Variance, in pixels, of what a resampled pixel has seen: its own square, and those that the interpolation mixes.
constexpr double kPixelVariance = 1.0 / 12 + 1.0 / 6;

}  // namespace

AcrossBlur::AcrossBlur(const std::vector<float>& lower_px, const std::vector<float>& upper_px)
    : levels_(static_cast<int>(lower_px.size()), static_cast<int>(upper_px.size()), CV_8U, cv::Scalar(0)) {
  for (int i = 0; i < levels_.rows; ++i) {
    for (int k = 0; k < levels_.cols; ++k) {
      const auto inverse = [](float width_px) { return 1 / (double(width_px) * width_px); };
      const double variance = kPixelVariance * (inverse(upper_px[std::size_t(k)]) - inverse(lower_px[std::size_t(i)]));
      const double sigma = std::sqrt(std::max(0.0, variance));
      const auto nearest = std::ranges::min_element(kLevels, {}, [sigma](double at) { return std::abs(at - sigma); });
      levels_.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(nearest - kLevels.begin());
    }
  }
}

std::vector<cv::Mat> AcrossBlur::blurred(const cv::Mat& panorama) {
  std::vector<cv::Mat> levels{panorama};
  for (std::size_t k = 1; k < kLevels.size(); ++k) {
    const double more = std::sqrt(kLevels[k] * kLevels[k] - kLevels[k - 1] * kLevels[k - 1]);
    cv::Mat blurred;
    const int half = static_cast<int>(std::ceil(2.5 * more));
    cv::GaussianBlur(levels.back(), blurred, {1, 2 * half + 1}, 0, more, cv::BORDER_REPLICATE);
    levels.push_back(blurred);
  }
  return levels;
}

MatchedDisparities match(const PanoramaPair& pair, int greatest_px) { return Matcher(pair, greatest_px).run(); }

}  // namespace twocone::vision
