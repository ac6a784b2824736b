// SPDX-License-Identifier: Apache-2.0
#include "vision/paper_ranging.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "base/errors.h"
#include "vision/method_arguments.h"

namespace twocone::vision {
namespace {

// Tolerance of "90 degrees" in a robot file: pi / 2 written with a dozen digits.
constexpr double kApexTolerance_rad = 1e-9;
// Neighbours on a circle are up to sqrt(2) px apart, and an edge may leave and enter a circle of one pixel's width
// several times.
constexpr double kRunGap_px = 3;

void check(const Rig& rig, const std::vector<Landmark>& targets, cv::Size lower_size, cv::Size upper_size) {
  base::Complaints bad;
  check_sizes(bad, lower_size, upper_size);
  const auto& lower = rig.lower.settings().cone;
  const auto& upper = rig.upper.settings().cone;
  for (const auto& [view, cone] : {std::pair{"lower", lower}, std::pair{"upper", upper}}) {
    if (std::abs(cone.apex_rad - std::numbers::pi / 2) > kApexTolerance_rad) {
      bad.add("the {} mirror's apex is {} rad, equations 1 and 2 hold for pi / 2 only", view, cone.apex_rad);
    }
  }
  if (lower.rim_radius_m != upper.rim_radius_m || lower.lens_to_tip_m != upper.lens_to_tip_m) {
    bad.add("R and d are {} m and {} m below but {} m and {} m above, equation 1 has one R and one d for both mirrors",
            lower.rim_radius_m, lower.lens_to_tip_m, upper.rim_radius_m, upper.lens_to_tip_m);
  }
  for (const auto& [name, view] : {std::pair{"lower", &rig.lower}, std::pair{"upper", &rig.upper}}) {
    const MirrorViewSettings& s = view->settings();
    if (!s.tilt_rad.isZero(0)) {
      bad.add("the {} mirror's tilt_rad is [{}, {}], equation 1 holds for upright mirrors only", name, s.tilt_rad.x(),
              s.tilt_rad.y());
    }
    if (!s.axis_offset_m.isZero(0)) {
      bad.add("the {} mirror's axis_offset_m is [{}, {}], equation 1 has both mirrors on one axis", name,
              s.axis_offset_m.x(), s.axis_offset_m.y());
    }
    if (view->has_distortion()) {
      bad.add("the {} view has a lens distortion, equation 1 holds for pinhole cameras only", name);
    }
  }
  if (!(rig.mirror_separation_m() > 0)) {
    bad.add("the upper mirror is {} m above the lower one, must be > 0", rig.mirror_separation_m());
  }
  for (const Landmark& target : targets) check_radius(bad, target);
  bad.raise("method paper");
}

/// Returns the circles of PaperRanging::lower_rings_. Pixels beyond the image's edge are left out.
std::vector<std::vector<cv::Point>> rings_of(const MirrorViewSettings& view, cv::Size image) {
  // Circle k extends to k + 1/2, and a pixel's corner is half a diagonal farther out.
  const double outermost = std::floor(view.rim_radius_px - 0.5 - std::numbers::sqrt2 / 2);
  if (outermost < 0) return {};
  std::vector<std::vector<std::pair<double, cv::Point>>> by_angle(std::size_t(outermost) + 1);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const double dx = column - view.centre_px.x();
      const double dy = row - view.centre_px.y();
      const auto k = static_cast<std::size_t>(std::lround(std::hypot(dx, dy)));
      if (k >= by_angle.size()) continue;
      const double angle = std::atan2(dy, dx);
      by_angle[k].emplace_back(angle < 0 ? angle + 2 * std::numbers::pi : angle, cv::Point(column, row));
    }
  }
  std::vector<std::vector<cv::Point>> rings(by_angle.size());
  for (std::size_t k = 0; k < rings.size(); ++k) {
    std::sort(by_angle[k].begin(), by_angle[k].end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [angle, pixel] : by_angle[k]) rings[k].push_back(pixel);
  }
  return rings;
}

/// Returns the middle pixel of the first run of `label` on a circle; nothing if the circle has no such pixel.
std::optional<cv::Point> middle_of_first_run(const std::vector<cv::Point>& ring, const cv::Mat& labels, int label) {
  std::vector<cv::Point> hits;
  for (const cv::Point& p : ring) {
    if (labels.at<std::uint8_t>(p) == label) hits.push_back(p);
  }
  if (hits.empty()) return std::nullopt;
  const auto joined = [](const cv::Point& a, const cv::Point& b) { return cv::norm(a - b) <= kRunGap_px; };
  // A run that crosses angle 0 begins near the list's end.
  std::size_t begin = hits.size();
  while (begin > 1 && joined(hits[begin - 1], hits[begin % hits.size()])) --begin;
  std::size_t length = 1;
  while (length < hits.size() &&
         joined(hits[(begin + length - 1) % hits.size()], hits[(begin + length) % hits.size()])) {
    ++length;
  }
  return hits[(begin + (length - 1) / 2) % hits.size()];
}

/// The lower match.
struct Match {
  cv::Point pixel;
  std::size_t ring;
};

std::optional<Match> find_outermost(const std::vector<std::vector<cv::Point>>& rings, const cv::Mat& labels,
                                    int label) {
  for (std::size_t k = rings.size(); k-- > 0;) {
    if (const auto pixel = middle_of_first_run(rings[k], labels, label)) return Match{*pixel, k};
  }
  return std::nullopt;
}

std::optional<cv::Point> find_on_line(const cv::Mat& labels, int label, const Eigen::Vector2d& from,
                                      const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const int steps = static_cast<int>(std::ceil(along.cwiseAbs().maxCoeff()));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = steps == 0 ? from : Eigen::Vector2d(from + along * (double(i) / steps));
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    if (!cv::Rect({0, 0}, labels.size()).contains(pixel)) continue;
    if (labels.at<std::uint8_t>(pixel) == label) return pixel;
  }
  return std::nullopt;
}

Eigen::Vector2d to_vector(const cv::Point& p) { return {p.x, p.y}; }

}  // namespace

PaperRanging::PaperRanging(const Rig& rig, const std::vector<Landmark>& targets, cv::Size lower_size,
                           cv::Size upper_size, const std::vector<std::size_t>& wanted)
    : rig_(rig),
      targets_(targets),
      wanted_(targets.size(), wanted.empty()),
      hues_(colours_of(targets)),
      lower_rings_(rings_of(rig.lower.settings(), lower_size)),
      lower_size_(lower_size),
      upper_size_(upper_size) {
  check(rig, targets, lower_size, upper_size);
  for (const std::size_t i : wanted) wanted_.at(i) = true;
}

std::vector<RangeMeasurement> PaperRanging::measure(const cv::Mat& lower, const cv::Mat& upper) const {
  check_image("PaperRanging", "lower", lower, lower_size_);
  check_image("PaperRanging", "upper", upper, upper_size_);
  const cv::Mat lower_labels = hues_.label(lower);
  const cv::Mat upper_labels = hues_.label(upper);
  std::vector<RangeMeasurement> measurements;
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    measurements.push_back(wanted_[i] ? measure_one(i, lower_labels, upper_labels) : RangeMeasurement{});
  }
  return measurements;
}

RangeMeasurement PaperRanging::measure_one(std::size_t target, const cv::Mat& lower_labels,
                                           const cv::Mat& upper_labels) const {
  RangeMeasurement m;
  // The paper's method identifies landmarks by their hues, so it does not see bands.
  if (targets_[target].bands) return m;
  const auto before = std::span(targets_).first(target);
  const auto hue = std::size_t(std::ranges::count_if(before, [](const Landmark& l) { return !l.bands; }));
  if (hues_.is_ambiguous(hue)) return with_verdict(m, RangeVerdict::kSameColour);
  const int label = static_cast<int>(hue) + 1;
  const MirrorView& lower = rig_.lower;
  const MirrorView& upper = rig_.upper;

  const auto lower_match = find_outermost(lower_rings_, lower_labels, label);
  if (!lower_match) return m;  // kNotSeen
  m.lower_px = to_vector(lower_match->pixel);
  const Eigen::Vector2d lower_offset = *m.lower_px - lower.settings().centre_px;
  const double bearing = lower.bearing_rad(lower_offset);
  m.bearing_rad = bearing;
  if (lower_match->ring + 1 == lower_rings_.size()) return with_verdict(m, RangeVerdict::kTruncated);

  const double upper_per_lower = upper.focal_length_px() / lower.focal_length_px();
  const Eigen::Vector2d from =
      upper.settings().centre_px + upper.offset_px(bearing, lower_offset.norm() * upper_per_lower);
  const auto upper_match = find_on_line(upper_labels, label, from, upper.settings().centre_px);
  if (!upper_match) return with_verdict(m, RangeVerdict::kNoMatch);
  m.upper_px = to_vector(*upper_match);
  const Eigen::Vector2d upper_offset = *m.upper_px - upper.settings().centre_px;
  const Eigen::Vector2d upper_in_lower =
      lower.offset_px(upper.bearing_rad(upper_offset), upper_offset.norm() / upper_per_lower);
  const double disparity_px = (lower_offset - upper_in_lower).norm();
  m.disparity_px = disparity_px;
  if (!(lower_offset.norm() > upper_in_lower.norm())) return with_verdict(m, RangeVerdict::kBeyondLimit);
  const double near_edge_m = lower.focal_length_px() * rig_.mirror_separation_m() / disparity_px -
                             lower.settings().cone.lens_to_tip_m;  // equation 1
  m.range_m = near_edge_m + targets_[target].radius_m;
  return with_verdict(m, RangeVerdict::kOk);
}

}  // namespace twocone::vision
