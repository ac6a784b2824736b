// SPDX-License-Identifier: Apache-2.0
#include "vision/bands/band_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "base/quantile.h"
#include "vision/bands/band_code.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

// Nearer to the tip, neighbouring lines show the same pixels.
constexpr double kLeastRadius_px = 8;
// Between the first and the last edge lie all cells but the outermost two.
constexpr int kInnerCells = static_cast<int>(kBandCells) - 2;
constexpr double kLineBelowFirst = static_cast<double>(kCellsOverLine) - 1;
// Smaller cells are not resolved: a light cell between dark ones then has little contrast.
constexpr double kLeastCell_steps = 2.2;
// An edge changes the grey level by this over two steps, and light and dark cells differ by twice as much.
constexpr int kLeastEdge = 12;
// Number of edges that are found from the first to the last one of a code; the codes have eight or more.
constexpr std::size_t kFewestEdges = 5;
// A cell whose grey level is nearer to the limit of light and dark, as a share of their difference, is not read.
constexpr double kLeastMargin = 0.15;
// Least correlation of a line with the image of its cells.
constexpr double kLeastLikeness = 0.85;
// Readings of one number belong together within this number of lines and this share of a cell.
constexpr int kMostGap = 6;
constexpr double kMostApart_cells = 1;
// A landmark that fewer lines show is not reported: a single line may be what a chequer shows by chance.
constexpr std::size_t kLeastLines = 2;
// Sigma of the middle of a run of lines: one more or less on either side.
constexpr double kDirectionSigma_lines = 0.5;
// Sigma of an edge on one line, in steps.
constexpr double kEdgeSigma_steps = 0.4;

struct Edge {
  double step;
  bool falls;  // darker outwards, which is upwards
};

/// Returns the places where the profile changes most.
std::vector<Edge> edges_of(std::span<const std::uint8_t> profile) {
  std::vector<Edge> edges;
  const auto change = [&](std::size_t i) { return int(profile[i + 1]) - int(profile[i - 1]); };
  for (std::size_t i = 2; i + 2 < profile.size(); ++i) {
    const int here = std::abs(change(i));
    if (here < kLeastEdge) continue;
    const int before = std::abs(change(i - 1));
    const int after = std::abs(change(i + 1));
    if (here < before || here <= after) continue;
    const double bend = before - 2.0 * here + after;
    const double off = bend < 0 ? std::clamp((before - after) / (2 * bend), -0.5, 0.5) : 0;
    edges.push_back({double(i) + off, change(i) < 0});
  }
  return edges;
}

double at(std::span<const std::uint8_t> profile, double step) {
  const auto i = std::size_t(step);
  return profile[i] + (step - double(i)) * (int(profile[i + 1]) - int(profile[i]));
}

/// Returns the correlation of a profile with that of the cells. @param last,cell in steps
double correlation(std::span<const std::uint8_t> profile, const BandCells& cells, double last, double cell) {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  const int begin = static_cast<int>(std::ceil(last - 0.7 * cell));
  const int end = static_cast<int>(std::floor(last + (kInnerCells + 0.7) * cell));
  const auto light_at = [&](double step) {
    const double up = (step - last) / cell;  // in cells above the last edge
    const int from_top = kInnerCells - static_cast<int>(std::floor(up));
    return cells[std::size_t(std::clamp(from_top, 0, int(kBandCells) - 1))] ? 1.0 : 0.0;
  };
  for (int i = begin; i <= end; ++i) {
    constexpr std::array<double, 5> kAcross{-0.6, -0.3, 0.0, 0.3, 0.6};  // an edge is about a step wide
    double model = 0;
    for (const double off : kAcross) model += light_at(i + off) / kAcross.size();
    const double seen = profile[std::size_t(i)];
    n += 1;
    x += model;
    y += seen;
    xx += model * model;
    yy += seen * seen;
    xy += model * seen;
  }
  const double spread = (n * xx - x * x) * (n * yy - y * y);
  return spread > 0 ? (n * xy - x * y) / std::sqrt(spread) : 0;
}

}  // namespace

BandFinder::BandFinder(const MirrorView& view, cv::Size size)
    : view_(view),
      sin_apex_(std::sin(view.settings().cone.apex_rad)),
      cos_apex_(std::cos(view.settings().cone.apex_rad)) {
  const double rim_px = view.settings().rim_radius_px;
  const auto slope_at = [&](double radius_px) {
    const double s = radius_px / view_.focal_length_px();
    return (cos_apex_ + sin_apex_ * s) / (sin_apex_ - cos_apex_ * s);
  };
  least_slope_ = slope_at(kLeastRadius_px);
  steps_ = std::max(2, static_cast<int>(std::ceil(rim_px - kLeastRadius_px)));
  slope_step_ = (slope_at(rim_px) - least_slope_) / (steps_ - 1);
  columns_.create(kDirections, steps_, CV_32F);
  rows_.create(kDirections, steps_, CV_32F);
  for (int i = 0; i < kDirections; ++i) {
    for (int k = 0; k < steps_; ++k) {
      const Eigen::Vector2d pixel = pixel_of(i, k).value_or(Eigen::Vector2d(-1, -1));
      columns_.at<float>(i, k) = static_cast<float>(std::clamp(pixel.x(), -1.0, double(size.width)));
      rows_.at<float>(i, k) = static_cast<float>(std::clamp(pixel.y(), -1.0, double(size.height)));
    }
  }
}

std::optional<Eigen::Vector2d> BandFinder::pixel_of(double direction, double step) const {
  const double slope = slope_of(step);
  const double radius_px = view_.focal_length_px() * (sin_apex_ * slope - cos_apex_) / (sin_apex_ + cos_apex_ * slope);
  const double angle_rad = direction * 2 * std::numbers::pi / kDirections;
  return view_.distort_px(view_.settings().centre_px +
                          radius_px * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
}

Eigen::Matrix2d BandFinder::between_lines_px2(const Candidate& candidate) {
  const double apart_px = candidate.top_px * 2 * std::numbers::pi / kDirections;
  const Eigen::Vector2d across(-std::sin(candidate.angle_rad), std::cos(candidate.angle_rad));
  return kDirectionSigma_lines * kDirectionSigma_lines * apart_px * apart_px * across * across.transpose();
}

BandFinder::Place BandFinder::place_of(const BandCandidate& bands, double cell_m) const {
  // The mirror sees all points above each other from the point (-d sin apex, d (1 - cos apex)) from the lens.
  const MirrorViewSettings& settings = view_.settings();
  const double d = settings.cone.lens_to_tip_m;
  const double from_eye_m = cell_m / bands.slope_per_cell;
  const double distance_m = from_eye_m - d * sin_apex_;
  const double over_lens_m = d * (1 - cos_apex_) + from_eye_m * bands.line_slope;
  const Eigen::Vector3d from_lens_m(distance_m * std::cos(bands.bearing_rad), distance_m * std::sin(bands.bearing_rad),
                                    over_lens_m);
  const Eigen::Vector3d tilted_m = Eigen::AngleAxisd(settings.tilt_rad.y(), Eigen::Vector3d::UnitY()) *
                                   (Eigen::AngleAxisd(settings.tilt_rad.x(), Eigen::Vector3d::UnitX()) * from_lens_m);
  return {distance_m, settings.lens_height_m + tilted_m.z()};
}

void BandFinder::read(std::span<const std::uint8_t> profile, int direction, std::vector<Reading>& readings) const {
  const std::vector<Edge> edges = edges_of(profile);
  std::vector<Reading> found;
  for (std::size_t lower = 0; lower < edges.size(); ++lower) {
    if (edges[lower].falls) continue;
    for (std::size_t upper = lower + kFewestEdges; upper < edges.size(); ++upper) {
      if (!edges[upper].falls) continue;
      const double last = edges[lower].step;
      const double cell = (edges[upper].step - last) / kInnerCells;
      if (cell < kLeastCell_steps) continue;
      if (last - 0.7 * cell < 0 || edges[upper].step + 0.7 * cell > double(steps_ - 2)) continue;
      const auto grey_of = [&, step = last](std::size_t cell_from_top) {
        return at(profile, step + (kInnerCells + 0.5 - double(cell_from_top)) * cell);
      };
      // Most pairs of edges fail here, by the cells that all codes have.
      const double light = std::min(grey_of(1), grey_of(kBandCells - 2));
      const double dark = std::max(grey_of(0), grey_of(kBandCells - 1));
      if (light - dark < 2 * kLeastEdge) continue;
      const double limit = (light + dark) / 2;
      BandCells cells{};
      bool is_clear = true;
      for (std::size_t k = 0; k < kBandCells && is_clear; ++k) {
        const double grey = grey_of(k);
        cells[k] = grey > limit;
        is_clear = std::abs(grey - limit) >= kLeastMargin * (light - dark);
      }
      const auto number = is_clear ? band_number(cells) : std::nullopt;
      if (!number) continue;
      const double likeness = correlation(profile, cells, last, cell);
      if (likeness >= kLeastLikeness) found.push_back({direction, *number, edges[upper].step, last, limit, likeness});
    }
  }
  // A part of a code may look like another, smaller code. What is most like its cells is read.
  std::ranges::stable_sort(found, std::greater{}, &Reading::likeness);
  const std::size_t before = readings.size();
  for (const Reading& one : found) {
    const auto overlaps = [&](const Reading& other) { return one.last < other.first && other.last < one.first; };
    if (std::none_of(readings.begin() + std::ptrdiff_t(before), readings.end(), overlaps)) readings.push_back(one);
  }
}

std::optional<BandCandidate> BandFinder::candidate_of(const std::vector<Reading>& readings) const {
  if (readings.size() < kLeastLines) return std::nullopt;
  double direction = 0, first = 0, last = 0;
  std::vector<double> limits;
  for (const Reading& r : readings) {
    direction += r.direction;
    limits.push_back(r.limit);
  }
  const auto n = double(readings.size());
  direction /= n;
  // The middle third shows the near side. Beside it a band is farther away, and is seen nearer to the tip.
  const std::size_t side = readings.size() / 3;
  for (std::size_t i = side; i < readings.size() - side; ++i) {
    first += readings[i].first / double(readings.size() - 2 * side);
    last += readings[i].last / double(readings.size() - 2 * side);
  }
  BandCandidate bands;
  bands.number = readings.front().number;
  const double cell = (first - last) / kInnerCells;
  const double line = first - kLineBelowFirst * cell;
  bands.slope_per_cell = cell * slope_step_;
  bands.line_slope = slope_of(line);
  bands.sigma = kEdgeSigma_steps * std::numbers::sqrt2 / (first - last);
  bands.limit = light_of_code()[std::size_t(std::clamp(base::median(std::move(limits)), 0.0, 255.0))];
  const auto pixel = pixel_of(direction, line);
  if (!pixel) return std::nullopt;
  const double direction_rad = direction * 2 * std::numbers::pi / kDirections;
  bands.bearing_rad = view_.bearing_rad({std::cos(direction_rad), std::sin(direction_rad)});
  const Eigen::Vector2d from_tip = *pixel - view_.settings().centre_px;
  bands.candidate.angle_rad = std::atan2(from_tip.y(), from_tip.x());
  bands.candidate.top_px = from_tip.norm();
  bands.candidate.first_bin = readings.front().direction;
  bands.candidate.last_bin = readings.back().direction;
  // A line within it that nothing was read on shows it, too.
  bands.candidate.area_px = bands.candidate.last_bin - bands.candidate.first_bin + 1;
  return bands;
}

std::vector<BandCandidate> BandFinder::find(const cv::Mat& rgb) const {
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  cv::Mat lines;
  cv::remap(grey, lines, columns_, rows_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  std::vector<Reading> readings;
  for (int i = 0; i < kDirections; ++i) {
    read({lines.ptr<std::uint8_t>(i), std::size_t(steps_)}, i, readings);
  }

  // Runs of neighbouring lines that read the same number at the same place. A run may pass the end of the circle.
  std::vector<std::vector<Reading>> runs;
  const auto follows = [](const Reading& next, const Reading& before) {
    const double apart = kMostApart_cells * (before.first - before.last) / kInnerCells;
    return next.number == before.number && next.direction - before.direction <= kMostGap &&
           std::abs(next.first - before.first) <= apart && std::abs(next.last - before.last) <= apart;
  };
  for (const Reading& reading : readings) {
    const auto run = std::ranges::find_if(runs, [&](const auto& one) { return follows(reading, one.back()); });
    if (run == runs.end()) {
      runs.push_back({reading});
    } else if (run->back().direction < reading.direction) {
      run->push_back(reading);
    }
  }
  for (auto& run : runs) {
    for (auto& start : runs) {
      if (&start == &run || start.empty() || run.empty()) continue;
      Reading next = start.front();
      next.direction += kDirections;
      if (!follows(next, run.back())) continue;
      for (Reading& r : start) {
        r.direction += kDirections;
        run.push_back(r);
      }
      start.clear();
    }
  }
  std::vector<BandCandidate> found;
  for (const auto& run : runs) {
    if (auto bands = candidate_of(run)) found.push_back(*bands);
  }
  std::ranges::stable_sort(found, [](const BandCandidate& a, const BandCandidate& b) {
    return a.number != b.number ? a.number < b.number : a.candidate.area_px > b.candidate.area_px;
  });
  return found;
}

}  // namespace twocone::vision
