// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "base/errors.h"
#include "base/quantile.h"
#include "vision/image_quality.h"
#include "vision/image_quality/shared.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

constexpr int kTransferTile_px = 8;
// Noise of 4 grey levels at mid grey is 0.014 of light: at these levels it is hardly ever clipped.
constexpr float kDark = 0.04F;
constexpr double kBright = 0.85;
constexpr float kPlain = 1.12F;  // brightest over darkest of a tile and its neighbours
constexpr double kTukey = 4.685;
constexpr double kLeastScale = 1e-3;  // of log ratio: a disagreement below the step of 8 bits means nothing
constexpr std::size_t kLeastTransferTiles = 30;

/// Returns the mean linear light of each tile.
cv::Mat_<cv::Vec3f> tiles_of(const cv::Mat& rgb) {
  const std::array<float, 256>& light = light_of_code();
  cv::Mat_<cv::Vec3f> tiles(rgb.rows / kTransferTile_px, rgb.cols / kTransferTile_px);
  for (int row = 0; row < tiles.rows; ++row) {
    for (int column = 0; column < tiles.cols; ++column) {
      cv::Vec3f sum = cv::Vec3f::all(0);
      for (int y = 0; y < kTransferTile_px; ++y) {
        const std::uint8_t* code = rgb.ptr(row * kTransferTile_px + y) + std::ptrdiff_t{3} * column * kTransferTile_px;
        for (int x = 0; x < kTransferTile_px; ++x, code += 3) {
          sum += cv::Vec3f(light[code[0]], light[code[1]], light[code[2]]);
        }
      }
      tiles(row, column) = sum / float(kTransferTile_px * kTransferTile_px);
    }
  }
  return tiles;
}

/// Returns whether the tile and its eight neighbours have one brightness and are not dark.
bool is_plain(const cv::Mat_<cv::Vec3f>& tiles, int row, int column, int channel) {
  float least = tiles(row, column)[channel];
  float most = least;
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) {
      least = std::min(least, tiles(y, x)[channel]);
      most = std::max(most, tiles(y, x)[channel]);
    }
  }
  return least > kDark && most <= kPlain * least;
}

struct Pair {
  int channel;
  double simulated;
  double rho2;
  double log_ratio;
};

std::vector<Pair> plain_pairs(const cv::Mat& simulated_rgb, const cv::Mat& real_rgb, const ImageRegion& region) {
  const cv::Mat_<cv::Vec3f> simulated = tiles_of(simulated_rgb);
  const cv::Mat_<cv::Vec3f> real = tiles_of(real_rgb);
  const Eigen::Vector2d middle((real_rgb.cols - 1) / 2., (real_rgb.rows - 1) / 2.);
  std::vector<Pair> pairs;
  for (int row = 1; row + 1 < real.rows; ++row) {
    for (int column = 1; column + 1 < real.cols; ++column) {
      const Eigen::Vector2d at =
          Eigen::Vector2d(column + 0.5, row + 0.5) * kTransferTile_px - Eigen::Vector2d(0.5, 0.5);
      if (!image_quality::is_within(region, at.x(), at.y(), kTransferTile_px * 1.5)) continue;
      for (int channel = 0; channel < 3; ++channel) {
        if (!is_plain(simulated, row, column, channel) || !is_plain(real, row, column, channel)) continue;
        const double expected = double(simulated(row, column)[channel]);
        const double ratio = double(real(row, column)[channel]) / expected;
        pairs.push_back({channel, expected, (at - middle).squaredNorm() / middle.squaredNorm(), std::log(ratio)});
      }
    }
  }
  return pairs;
}

/// Returns initial gains from the darker half of each channel, which is not clipped even in an overexposed image.
std::optional<std::array<double, 3>> first_gains(const std::vector<Pair>& pairs) {
  std::array<double, 3> gains{};
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<double> levels;
    for (const Pair& pair : pairs) {
      if (pair.channel == channel) levels.push_back(pair.simulated);
    }
    if (levels.size() < kLeastTransferTiles) return std::nullopt;
    const double half = base::median(levels);
    std::vector<double> ratios;
    for (const Pair& pair : pairs) {
      if (pair.channel == channel && pair.simulated <= half) ratios.push_back(pair.log_ratio);
    }
    gains[std::size_t(channel)] = base::median(ratios);
  }
  return gains;
}

}  // namespace

std::optional<Transfer> transfer(const cv::Mat& simulated_rgb, const cv::Mat& real_rgb, const ImageRegion& region) {
  image_quality::check("transfer", simulated_rgb, region);
  image_quality::check("transfer", real_rgb, region);
  if (simulated_rgb.size() != real_rgb.size()) {
    throw base::InvalidArgument("transfer: images of {} x {} and {} x {} px, must be of one size", simulated_rgb.cols,
                                simulated_rgb.rows, real_rgb.cols, real_rgb.rows);
  }
  const std::vector<Pair> pairs = plain_pairs(simulated_rgb, real_rgb, region);
  const auto start = first_gains(pairs);
  if (!start) return std::nullopt;
  Transfer answer{*start, 0, {}};
  for (int iteration = 0; iteration < 15; ++iteration) {
    const auto shade = [&answer](const Pair& pair) { return std::max(0.05, 1 - answer.vignetting * pair.rho2); };
    const auto expected_log = [&](const Pair& pair) {
      return answer.log_gain[std::size_t(pair.channel)] + std::log(shade(pair));
    };
    answer.tiles = {};
    std::vector<const Pair*> used;
    std::vector<double> sizes;
    for (const Pair& pair : pairs) {
      const double expected = expected_log(pair);
      if (std::max(1., std::exp(expected)) * pair.simulated > kBright) continue;
      used.push_back(&pair);
      sizes.push_back(std::abs(pair.log_ratio - expected));
      ++answer.tiles[std::size_t(pair.channel)];
    }
    if (std::ranges::min(answer.tiles) < kLeastTransferTiles) return std::nullopt;
    const double reach = kTukey * std::max(base::robust_sigma(sizes), kLeastScale);
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Pair* pair : used) {
      const double residual = pair->log_ratio - expected_log(*pair);
      if (std::abs(residual) >= reach) continue;
      const double weight = std::pow(1 - std::pow(residual / reach, 2), 2);
      Eigen::Vector4d row = Eigen::Vector4d::Zero();
      row[pair->channel] = 1;
      row[3] = -pair->rho2 / shade(*pair);
      normal += weight * row * row.transpose();
      right += weight * residual * row;
    }
    // This regularisation is too small to change an answer. It serves tiles that are all at one radius, and channels in
    // which no tiles agree.
    normal(3, 3) += 1e-6;
    for (int i = 0; i < 3; ++i) normal(i, i) += 1e-9;
    const Eigen::Vector4d step = normal.ldlt().solve(right);
    for (int i = 0; i < 3; ++i) answer.log_gain[std::size_t(i)] += step[i];
    answer.vignetting = std::clamp(answer.vignetting + step[3], -2., 0.95);
  }
  return answer;
}

}  // namespace twocone::vision
