// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "vision/full/finder.h"
#include "vision/full/outline_fit.h"
#include "vision/sighting.h"

namespace twocone::vision {

/// One landmark in one view, on the way to its sighting.
struct Look {
  std::optional<Candidate> candidate;
  bool is_truncated = false;
  bool is_saturated = false;
  std::optional<OutlineFit> fit;  ///< the last one: coarse, or fine where `is_fine`
  bool is_fine = false;
  /// What the coarse fit tells of the picture's noise and blur; there is none of a landmark that was fitted by them.
  struct Pool {
    double residual, grey, spread, code_variance, blur;
  };
  std::optional<Pool> pool;
};

/// What a look comes to.
struct Judged {
  std::optional<Sighting> sighting;
  bool is_occluded = false;  ///< the top cannot be trusted
  bool is_narrow = false;    ///< its bearing cannot be trusted
  bool is_wide = false;      ///< wider than a landmark of its radius is at that range
};

/// Finds and fits landmarks in one view.
class ViewFitter {
 public:
  ViewFitter(const MirrorView& mirror, cv::Size size, const ColourTable& table)
      : mirror_(mirror), size_(size), table_(table), finder_(mirror, size) {}

  [[nodiscard]] cv::Size size() const { return size_; }
  [[nodiscard]] const Finder& finder() const { return finder_; }

  [[nodiscard]] Eigen::Vector2d pixel_of(const Candidate& candidate) const;
  /// Half way up, where every candidate lies in the mirror.
  [[nodiscard]] double bearing_of(const Candidate& candidate) const;
  /// Where a candidate's ray has the height `top_m`.
  [[nodiscard]] std::optional<Cylinder> place(const Candidate& candidate, double radius_m, double top_m) const;

  /// The near point of the top as the finder has it (Stage::kFound). Nothing where the candidate has no place.
  [[nodiscard]] std::optional<Sighting> found(const Candidate& candidate, double radius_m, double top_m) const;

  /// From a place that is good to kCoarseReach_px.
  void fit_coarse(std::size_t k, const cv::Mat& picture, const Cylinder& start, Look& look, Stations& stations) const;
  /// From a place that is expected: one fit in place of two. False, with `look` as it was, where it is not there.
  bool fit_near(std::size_t k, const cv::Mat& picture, const Cylinder& start, Look& look, Stations& stations) const;

  /// What the fits of a view's landmarks have in common. Nothing without any.
  struct Common {
    PixelNoise noise;
    Reach reach;
    double blur_px;
  };
  [[nodiscard]] static std::optional<Common> common(const std::vector<const Look*>& looks);
  /// From the coarse fit.
  void fit_fine(std::size_t k, const cv::Mat& picture, const Common& common, Look& look, Stations& stations) const;
  /// Like fit_fine from a place that is only expected. False, with `look` as it was, where the outline is not there.
  bool fit_expected(std::size_t k, const cv::Mat& picture, const Cylinder& expected, const Common& common, Look& look,
                    Stations& stations) const;

  /// Sightings of those that are fitted, by how all that are fitted alike scatter.
  [[nodiscard]] static std::vector<Judged> judge(const std::vector<const Look*>& looks);

 private:
  void follow_colour(std::size_t k, const cv::Mat& picture, OutlineFit& fit) const;
  [[nodiscard]] std::optional<OutlineFit> fit(std::size_t k, const cv::Mat& picture, const Cylinder& cylinder,
                                              const Reach& reach, const PixelNoise& noise, const FitLimits& limits,
                                              int stride, Look& look, Stations& stations) const;

  const MirrorView& mirror_;
  cv::Size size_;
  const ColourTable& table_;
  Finder finder_;
};

/// Of the top in the picture. A landmark that is narrower does not show a mast that hides it.
double rim_width_px(const OutlineFit& fit);

}  // namespace twocone::vision
