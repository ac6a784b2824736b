// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace twocone::vision {
namespace {

constexpr double kBin_deg = 360.0 / Finder::kBins;
// Nearer to the tip than this, a pixel's direction is accurate to several degrees only (half its diagonal over the
// radius: 5 degrees). Tuned by hand on synthetic images; no test fixes it.
constexpr double kLeastFoundRadius_px = 8;
// A wider gap separates candidates. A narrower one is not counted, because a mast in front of a landmark splits it. Two
// objects of one colour that are as close are one candidate, which is too wide for a landmark (Rivals::kBeside). Tuned
// by hand on synthetic images; outline_ranging_test.cpp, ALandmarkInHalvesIsOneLandmark, exercises it but does not fix
// it.
constexpr int kGap_bins = 10;
// Resolution of the first search for the top. Tuned by hand on synthetic images; no test fixes it.
constexpr int kRadialBin_px = 2;
// A top within this distance of the rim counts as cut by the rim. Tuned by hand on synthetic images;
// outline_ranging_test.cpp, TooNearForTheLowerMirrorLeavesTheUpperOneAndThenNone, exercises it but does not fix it.
constexpr double kRimMargin_px = 2.5;
// The search for the exact top extends this far to either side. Tuned by hand on synthetic images; no test fixes it.
constexpr double kTopSearch_px = 8;

// Of the eight pixels around one, on the grid that is searched, at least so many must have its colour too. In dark
// places a camera's noise gives single pixels any hue, and many of them would add up to a landmark. The narrowest line
// has two neighbours everywhere but at its ends. outline_ranging_test.cpp, NoiseIsNoRival, exercises it but does not
// fix it.
constexpr int kLeastNeighbours = 2;

/// Returns whether a pixel has the colour; false outside the image.
bool has_label(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, cv::Point at) {
  if (at.x < 0 || at.y < 0 || at.x >= rgb.cols || at.y >= rgb.rows) return false;
  return table.label(rgb.ptr<std::uint8_t>(at.y) + std::ptrdiff_t(3) * at.x) == label;
}

/// @param at a pixel of the colour
int neighbours_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, cv::Point at, int stride) {
  int alike = 0;
  for (int row = at.y - stride; row <= at.y + stride; row += stride) {
    for (int column = at.x - stride; column <= at.x + stride; column += stride) {
      alike += has_label(rgb, table, label, {column, row}) ? 1 : 0;
    }
  }
  return alike - 1;
}

struct Run {
  int first, last;  // bins, last may pass Finder::kBins
};

/// Returns the runs of bins with hits, round the circle.
std::vector<Run> runs_of(const std::array<int, Finder::kBins>& counts) {
  std::vector<Run> runs;
  // Begin in a wide gap, where the circle's seam does not cut a run.
  int seam = -1;
  for (int i = 0, empty = 0; i < 2 * Finder::kBins; ++i) {
    empty = counts[std::size_t(i % Finder::kBins)] == 0 ? empty + 1 : 0;
    if (empty > kGap_bins) {
      seam = i % Finder::kBins;
      break;
    }
  }
  if (seam < 0) return {{0, Finder::kBins - 1}};
  int empty = kGap_bins + 1;
  for (int i = seam; i < seam + Finder::kBins; ++i) {
    if (counts[std::size_t(i % Finder::kBins)] == 0) {
      ++empty;
      continue;
    }
    if (empty > kGap_bins) {
      runs.push_back({i, i});
    } else {
      runs.back().last = i;
    }
    empty = 0;
  }
  return runs;
}

}  // namespace

Finder::Finder(const MirrorView& view, cv::Size size)
    : centre_px_(view.settings().centre_px), rim_px_(view.settings().rim_radius_px) {
  first_row_ = std::max(0, static_cast<int>(std::ceil(centre_px_.y() - rim_px_)));
  const int last_row = std::min(size.height - 1, static_cast<int>(std::floor(centre_px_.y() + rim_px_)));
  for (int row = first_row_; row <= last_row; ++row) {
    const double half = std::sqrt(std::max(0.0, rim_px_ * rim_px_ - (row - centre_px_.y()) * (row - centre_px_.y())));
    spans_.push_back({std::max(0, static_cast<int>(std::ceil(centre_px_.x() - half))),
                      std::min(size.width, static_cast<int>(std::floor(centre_px_.x() + half)) + 1)});
  }
}

void Finder::gather(const cv::Mat& rgb, const ColourTable& table, int stride,
                    std::vector<std::vector<Polar>>& by_colour) const {
  for (std::size_t i = 0; i < spans_.size(); i += std::size_t(stride)) {
    const int row = first_row_ + static_cast<int>(i);
    const auto* pixels = rgb.ptr<std::uint8_t>(row);
    for (int column = spans_[i].begin; column < spans_[i].end; column += stride) {
      const std::uint8_t label = table.label(pixels + std::ptrdiff_t(3) * column);
      if (label == 0 || label > by_colour.size()) continue;
      if (neighbours_of(rgb, table, label, {column, row}, stride) < kLeastNeighbours) continue;
      const auto dx = static_cast<float>(column - centre_px_.x());
      const auto dy = static_cast<float>(row - centre_px_.y());
      const float radius_px = std::sqrt(dx * dx + dy * dy);
      if (radius_px < kLeastFoundRadius_px) continue;
      by_colour[label - 1U].push_back({cv::fastAtan2(dy, dx), radius_px});
    }
  }
}

double Finder::refined_top(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, double angle_rad,
                           double half_rad, double top_px) const {
  const Eigen::Vector2d out(std::cos(angle_rad), std::sin(angle_rad));
  const Eigen::Vector2d across(-out.y(), out.x());
  const double most_px = std::min(top_px + kTopSearch_px, rim_px_);
  const int circles = static_cast<int>(std::ceil(most_px - (top_px - kTopSearch_px)));
  for (int circle = 0; circle < circles; ++circle) {
    const double radius = most_px - circle;
    // Only the middle two thirds count, because a curved rim ends farther in at its ends.
    const int reach = static_cast<int>(radius * half_rad * 2 / 3);
    int hits = 0;
    for (int i = -reach; i <= reach; ++i) {
      const Eigen::Vector2d p = centre_px_ + radius * out + i * across;
      const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
      hits += has_label(rgb, table, label, pixel) ? 1 : 0;
    }
    if (2 * hits > 2 * reach + 1) return radius + 0.5;
  }
  return top_px;
}

std::optional<Candidate> Finder::candidate_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label,
                                              const std::vector<Polar>& wedge, int stride) const {
  const double area_px = double(wedge.size()) * stride * stride;
  if (area_px < kLeastArea_px) return std::nullopt;
  std::vector<int> radial(std::size_t(rim_px_ / kRadialBin_px) + 2, 0);
  std::vector<double> angles;
  angles.reserve(wedge.size());
  for (const Polar& p : wedge) {
    ++radial[std::min(radial.size() - 1, std::size_t(p.radius_px / kRadialBin_px))];
    angles.push_back(p.angle_deg);
  }
  const auto quantile = [&angles](double q) {
    const auto at = angles.begin() + std::ptrdiff_t(q * double(angles.size() - 1));
    std::nth_element(angles.begin(), at, angles.end());
    return *at;
  };
  // The middle 90 % of the directions of a uniform wedge span 0.9 of its width.
  const double half_deg = std::max((quantile(0.95) - quantile(0.05)) / 1.8, kBin_deg / 10);
  const double half_rad = half_deg * std::numbers::pi / 180;
  // The top is the outermost circle on which at least half of the width has the colour.
  double top_px = 0;
  for (std::size_t r = radial.size(); r-- > 0 && top_px == 0;) {
    const double expected = 2 * half_rad * (double(r) + 0.5) * kRadialBin_px * kRadialBin_px / (stride * stride);
    if (radial[r] >= std::max(0.5 * expected, 1.0)) top_px = double(r + 1) * kRadialBin_px;
  }
  // The direction is taken from the outer part, where a pixel's direction is accurate.
  double sum_deg = 0;
  int outer = 0;
  for (const Polar& p : wedge) {
    if (p.radius_px < 0.4 * top_px || p.radius_px > top_px) continue;
    sum_deg += p.angle_deg;
    ++outer;
  }
  if (outer == 0) return std::nullopt;
  const double angle_rad = sum_deg / outer * std::numbers::pi / 180;
  top_px = refined_top(rgb, table, label, angle_rad, half_rad, top_px);
  return Candidate{angle_rad, top_px, area_px, top_px > rim_px_ - kRimMargin_px, 0, 0};
}

Found Finder::found_of(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const std::vector<Polar>& hits,
                       int stride) const {
  std::array<int, Finder::kBins> counts{};
  const auto bin_of = [](const Polar& p) { return static_cast<int>(p.angle_deg / kBin_deg) % Finder::kBins; };
  for (const Polar& hit : hits) ++counts[std::size_t(bin_of(hit))];
  Found found;
  std::vector<Candidate>& candidates = found.candidates;
  for (const Run& run : runs_of(counts)) {
    // Angles in the wedge are unrolled from the run's beginning.
    std::vector<Polar> wedge;
    for (Polar hit : hits) {
      int bin = bin_of(hit);
      if (bin < run.first) {
        bin += Finder::kBins;
        hit.angle_deg += 360;
      }
      if (bin >= run.first && bin <= run.last) wedge.push_back(hit);
    }
    auto candidate = candidate_of(rgb, table, label, wedge, stride);
    if (!candidate) continue;
    candidate->first_bin = run.first;
    candidate->last_bin = run.last;
    candidates.push_back(*candidate);
  }
  if (candidates.empty()) return found;
  std::ranges::sort(candidates, std::greater{}, &Candidate::area_px);
  found.area_px.assign(Finder::kBins, 0);
  for (const Polar& hit : hits) {
    if (hit.radius_px >= kSureRadius_px) found.area_px[std::size_t(bin_of(hit))] += stride * stride;
  }
  return found;
}

std::vector<Found> Finder::find(const cv::Mat& rgb, const ColourTable& table, const std::vector<bool>& wanted) const {
  const std::size_t colours = wanted.size();
  std::vector<Found> found(colours);
  // First search every other pixel of every other row, then all pixels for the colours that were not found.
  for (const int stride : {2, 1}) {
    std::vector<std::vector<Polar>> by_colour(colours);
    gather(rgb, table, stride, by_colour);
    bool is_complete = true;
    for (std::size_t k = 0; k < colours; ++k) {
      if (!wanted[k] || !found[k].candidates.empty()) continue;
      if (!by_colour[k].empty()) {
        found[k] = found_of(rgb, table, static_cast<std::uint8_t>(k + 1), by_colour[k], stride);
      }
      is_complete = is_complete && !found[k].candidates.empty();
    }
    if (is_complete) break;
  }
  return found;
}

}  // namespace twocone::vision
