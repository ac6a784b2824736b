// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "vision/image_quality.h"
#include "vision/image_quality/shared.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

using Bin = NoiseSamples::Bin;
using Bins = std::array<Bin, NoiseSamples::kBins>;

constexpr int kNoiseTile_px = 5, kHalfTile_px = kNoiseTile_px / 2;
constexpr int kPixels = kNoiseTile_px * kNoiseTile_px;
constexpr int kFreedom = kPixels - 3;  // degrees of freedom of the scatter about a plane
constexpr float kSquares = 50;         // sum over a tile of the squared column (row) distance from its middle
constexpr double kRounding_grey2 = 1. / 12;
constexpr double kSteepest = 14;                  // 99.9 % quantile of the chi square of the plane's two slopes
constexpr double kPlainSlope_grey2 = 1;           // shading no steeper than noise of this variance is no edge
constexpr double kScatterCut = 33.92 / kFreedom;  // 95 % quantile of chi square
// Mean of the scatters below that cut, over the mean of all: P(33.92) of a chi square with 24 degrees of freedom over
// that with 22.
constexpr double kMeanBelowCut = 0.9620515273460244;
constexpr double kLowerQuartile = 17.24 / kFreedom;
constexpr std::size_t kLeastNoiseTiles = 30;
constexpr double kLeastPlain = 0.6;  // share of a level's tiles
constexpr double kClear_sigma = 3;
constexpr double kLeastClear = 0.002;  // used where there is hardly any noise: a grey level at full scale is 0.009

struct Tile {
  double level;
  double scatter_grey2;
  double slope_grey2;
  double light_per_grey2;
};

/// Returns the squares of light_per_grey() of each integer code.
const std::array<double, 256>& light_per_grey2_of_code() {
  static const std::array<double, 256> kOfCode = [] {
    std::array<double, 256> squares{};
    for (std::size_t code = 0; code < squares.size(); ++code) squares[code] = std::pow(light_per_grey(double(code)), 2);
    return squares;
  }();
  return kOfCode;
}

/// Returns the bin of a light.
std::size_t light_bin(double light) {
  static const std::array<double, NoiseSamples::kBins> kFirst = [] {
    std::array<double, NoiseSamples::kBins> first{};
    for (std::size_t bin = 0; bin < first.size(); ++bin) {
      first[bin] = srgb_to_linear(256. * double(bin) / NoiseSamples::kBins);
    }
    return first;
  }();
  const auto next = std::ranges::upper_bound(kFirst, light);
  return std::size_t(std::max<std::ptrdiff_t>(next - kFirst.begin() - 1, 0));
}

/// Measures one channel of the tile whose upper left pixel is given.
Tile measure(const cv::Mat& rgb, int column, int row, int channel) {
  const std::array<float, 256>& light = light_of_code();
  const float middle = light[rgb.ptr(row + kHalfTile_px)[3 * (column + kHalfTile_px) + channel]];
  float sum = 0, squares = 0, along_column = 0, along_row = 0;
  int codes = 0;
  for (int y = 0; y < kNoiseTile_px; ++y) {
    const std::uint8_t* code = rgb.ptr(row + y) + std::ptrdiff_t{3} * column + channel;
    float row_sum = 0;
    for (int x = 0; x < kNoiseTile_px; ++x, code += 3) {
      const float d = light[*code] - middle;
      codes += *code;
      row_sum += d;
      squares += d * d;
      along_column += d * float(x - kHalfTile_px);
    }
    sum += row_sum;
    along_row += row_sum * float(y - kHalfTile_px);
  }
  const float slope = (along_column * along_column + along_row * along_row) / kSquares;
  const float scatter = std::max(0.F, squares - sum * sum / kPixels - slope) / kFreedom;
  const int code = (codes + kPixels / 2) / kPixels;
  const double per_grey2 = light_per_grey2_of_code()[std::size_t(code)];
  return {double(middle + sum / kPixels), scatter / per_grey2, slope / per_grey2, per_grey2};
}

/// Erases the tiles that are not plain; erases all where too few are plain.
void keep_plain(std::vector<Tile>& tiles) {
  const std::size_t all = tiles.size();
  if (all < kLeastNoiseTiles) return tiles.clear();
  const auto quarter = tiles.begin() + std::ptrdiff_t(all / 4);
  std::ranges::nth_element(tiles, quarter, {}, &Tile::scatter_grey2);
  double variance = quarter->scatter_grey2 / kLowerQuartile;
  const auto is_plain = [&variance](const Tile& tile) {
    return tile.scatter_grey2 <= kScatterCut * variance &&
           tile.slope_grey2 <= kSteepest * std::max(variance, kPlainSlope_grey2);
  };
  for (int iteration = 0; iteration < 12; ++iteration) {
    double sum = 0;
    std::size_t count = 0;
    for (const Tile& tile : tiles) {
      if (!is_plain(tile)) continue;
      sum += tile.scatter_grey2;
      ++count;
    }
    if (count < kLeastNoiseTiles) return tiles.clear();
    variance = sum / double(count) / kMeanBelowCut;
  }
  std::erase_if(tiles, [&](const Tile& tile) { return !is_plain(tile); });
  if (tiles.size() < kLeastNoiseTiles || double(tiles.size()) < kLeastPlain * double(all)) tiles.clear();
}

Bin measure_level(std::vector<Tile>& tiles) {
  keep_plain(tiles);
  Bin bin;
  if (tiles.empty()) return bin;
  double light2 = 0;
  for (const Tile& tile : tiles) light2 += tile.scatter_grey2 * tile.light_per_grey2;
  const double clear = std::max(kLeastClear, kClear_sigma * std::sqrt(light2 / kMeanBelowCut / double(tiles.size())));
  for (const Tile& tile : tiles) {
    if (tile.level < clear || tile.level > 1 - clear) continue;
    bin.tiles += 1;
    bin.level += tile.level;
    // The variance is summed in linear light, tile by tile, because in grey levels it changes within one bin.
    bin.variance += (tile.scatter_grey2 / kMeanBelowCut - kRounding_grey2) * tile.light_per_grey2;
  }
  return bin;
}

struct Line {
  double shot = 0;
  double read2 = 0;
  Eigen::Vector2d sigma = Eigen::Vector2d::Zero();  ///< of shot and read2 if noise is Gaussian
  double sigma_grey_level = 0;                      ///< of the variance at kNoiseLevel
  [[nodiscard]] double at(double level) const { return shot * level + read2; }
};

double grey_at_noise_level(double variance) {
  return std::sqrt(std::max(variance, 0.)) / light_per_grey(linear_to_srgb(kNoiseLevel));
}

/// Fits shot and read2, each >= 0, by weighted least squares.
Line fit(const Bins& bins) {
  Line line;
  for (int iteration = 0; iteration < 8; ++iteration) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const Bin& bin : bins) {
      if (bin.tiles == 0) continue;
      const double level = bin.level / bin.tiles;
      const double rounding = kRounding_grey2 * std::pow(light_per_grey(linear_to_srgb(level)), 2);
      // The first round needs a rough estimate only: shot noise.
      const double expected = (iteration == 0 ? level * rounding : line.at(level)) + rounding;
      const double weight = bin.tiles * kFreedom / 2 / (expected * expected);
      const Eigen::Vector2d row(level, 1);
      normal += weight * row * row.transpose();
      right += weight * bin.variance / bin.tiles * row;
    }
    // If there is hardly more than one level, the two cannot be separated, and all noise counts as read noise.
    Eigen::Vector2d both = Eigen::Vector2d(-1, 0);
    if (normal.determinant() > 1e-9 * normal(0, 0) * normal(1, 1)) both = normal.inverse() * right;
    if (both.x() < 0) both = {0, std::max(0., right.y() / normal(1, 1))};
    if (both.y() < 0) both = {std::max(0., right.x() / normal(0, 0)), 0};
    line.shot = both.x();
    line.read2 = both.y();
    const Eigen::Matrix2d covariance = (normal + 1e-12 * Eigen::Matrix2d(normal.diagonal().asDiagonal())).inverse();
    line.sigma = covariance.diagonal().cwiseSqrt();
    const Eigen::Vector2d at(kNoiseLevel, 1);
    line.sigma_grey_level = std::sqrt(at.dot(covariance * at));
  }
  return line;
}

void add(Bins& to, const Bins& from) {
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i].tiles += from[i].tiles;
    to[i].level += from[i].level;
    to[i].variance += from[i].variance;
  }
}

bool any(const Bins& bins) {
  return std::any_of(bins.begin(), bins.end(), [](const Bin& bin) { return bin.tiles > 0; });
}

}  // namespace

void NoiseSamples::merge(const NoiseSamples& later) {
  for (std::size_t i = 0; i < kBlocks; ++i) add(blocks[(images + i) % kBlocks], later.blocks[i]);
  images += later.images;
}

NoiseSamples noise_samples(const cv::Mat& rgb, const ImageRegion& region) {
  image_quality::check("noise_samples", rgb, region);
  std::array<std::vector<Tile>, NoiseSamples::kBins> levels;
  for (int row = 0; row + kNoiseTile_px <= rgb.rows; row += kNoiseTile_px) {
    for (int column = 0; column + kNoiseTile_px <= rgb.cols; column += kNoiseTile_px) {
      if (!image_quality::is_within(region, column + kHalfTile_px, row + kHalfTile_px, kHalfTile_px * 1.5)) continue;
      for (int channel = 0; channel < 3; ++channel) {
        const Tile tile = measure(rgb, column, row, channel);
        levels[light_bin(tile.level)].push_back(tile);
      }
    }
  }
  NoiseSamples samples;
  samples.images = 1;
  for (std::size_t i = 0; i < levels.size(); ++i) samples.blocks[0][i] = measure_level(levels[i]);
  return samples;
}

double NoiseModel::full_well_electrons() const {
  constexpr double kMost = 1e6;
  if (shot <= 0 && read <= 0) return 0;
  return shot > 1 / kMost ? 1 / shot : kMost;
}

std::optional<NoiseModel> fit_noise(const NoiseSamples& samples) {
  Bins all{};
  for (const Bins& block : samples.blocks) add(all, block);
  if (!any(all)) return std::nullopt;
  const Line line = fit(all);
  NoiseModel model;
  model.shot = line.shot;
  model.read = std::sqrt(line.read2);
  model.noise_grey = grey_at_noise_level(line.at(kNoiseLevel));

  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  int blocks = 0;
  for (std::size_t without = 0; without < samples.blocks.size(); ++without) {
    if (!any(samples.blocks[without])) continue;
    Bins others{};
    for (std::size_t i = 0; i < samples.blocks.size(); ++i) {
      if (i != without) add(others, samples.blocks[i]);
    }
    if (!any(others)) continue;
    const Line left = fit(others);
    // Differences from the fit of all blocks keep more digits.
    const Eigen::Vector3d off(left.shot - line.shot, std::sqrt(left.read2) - model.read,
                              grey_at_noise_level(left.at(kNoiseLevel)) - model.noise_grey);
    sum += off;
    squares += off.cwiseAbs2();
    ++blocks;
  }
  Eigen::Vector3d jackknife = Eigen::Vector3d::Zero();
  if (blocks > 1) jackknife = ((blocks - 1.) * (squares - sum.cwiseAbs2() / blocks) / blocks).cwiseMax(0).cwiseSqrt();
  // The variance under the square root may be 0, so the step by one sigma is used and not the derivative.
  const double counted = grey_at_noise_level(line.at(kNoiseLevel) + line.sigma_grey_level) - model.noise_grey;
  const double common = std::hypot(kNoiseFloor_grey, kNoiseShare * model.noise_grey);
  model.sigma_noise_grey = std::hypot(std::max(jackknife.z(), counted), common);
  // The error that images share may be shot noise or read noise.
  const double grey = light_per_grey(linear_to_srgb(kNoiseLevel));
  const double common_variance = common * (2 * model.noise_grey + common) * grey * grey;
  model.sigma_shot = std::hypot(std::max(jackknife.x(), line.sigma.x()), common_variance / kNoiseLevel);
  const double read_variance = std::hypot(line.sigma.y(), common_variance);
  model.sigma_read = std::max(jackknife.y(), std::sqrt(line.read2 + read_variance) - model.read);
  return model;
}

}  // namespace twocone::vision
