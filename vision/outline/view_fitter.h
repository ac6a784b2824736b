// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "vision/outline/finder.h"
#include "vision/outline/one_ray.h"
#include "vision/outline/outline_fit.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// The state of one landmark in one view, until its sighting is known.
struct OutlineSearch {
  std::optional<Candidate> candidate;
  bool is_truncated = false;
  bool is_saturated = false;
  std::optional<OutlineFit> fit;  ///< the last fit: coarse, or fine where `is_fine`
  bool is_fine = false;
  bool is_one_ray = false;  ///< the fine fit was made in an image whose pixels are one ray each
  /// The contribution of the coarse fit to the image's noise and blur. Empty for a landmark that was fitted with these
  /// values from the start.
  std::optional<EdgeStatistics> pool;
  /// The posteriors of a fine fit in an image whose pixels are one ray each, where there are any.
  std::optional<OneRayFits> one_ray;
};

/// The input and output of a fit of one landmark in one view.
struct OutlineTask {
  Surface surface;
  const cv::Mat& image;
  OutlineSearch& look;
  EdgeSamples& edge_samples;  ///< memory that all fits share
};

/// The result for one landmark in one view.
struct OutlineVerdict {
  std::optional<Sighting> sighting;
  bool is_occluded = false;  ///< the top cannot be trusted
  bool is_narrow = false;    ///< the bearing cannot be trusted
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
  /// Returns the bearing half way up to the top, where every candidate lies in the mirror.
  [[nodiscard]] double bearing_of(const Candidate& candidate) const;
  /// Returns the cylinder whose near point is where the candidate's ray has the height `top_m`.
  [[nodiscard]] std::optional<Cylinder> place(const Candidate& candidate, double radius_m, double top_m) const;

  /// Returns the near point of the top from the finder alone (Stage::kFound). Returns nothing where the candidate has
  /// no place.
  [[nodiscard]] std::optional<Sighting> found(const Candidate& candidate, double radius_m, double top_m) const;

  /// Fits the outline roughly, from a place that is accurate to kCoarseReach_px; that of bands from one that is
  /// accurate to a pixel, because their edges are alike.
  void fit_coarse(const OutlineTask& task, const Cylinder& start) const;
  /// Fits the outline roughly from an expected place, with one fit instead of two. Returns false and leaves `task.look`
  /// unchanged where the outline is not there.
  [[nodiscard]] bool fit_near(const OutlineTask& task, const Cylinder& start) const;

  /// The values that the fits of a view's landmarks share. common() returns nothing without any coarse fit.
  struct Common {
    PixelNoise noise;
    SampleReach reach;
    double blur_px;
    bool is_one_ray = false;  ///< each pixel is one ray
  };
  [[nodiscard]] static std::optional<Common> common(const std::vector<const OutlineSearch*>& looks);
  /// Fits the whole outline, from the coarse fit.
  void fit_fine(const OutlineTask& task, const Common& common) const;
  /// As fit_fine(), from an expected place. Returns false and leaves `task.look` unchanged where the outline is not
  /// there.
  [[nodiscard]] bool fit_expected(const OutlineTask& task, const Cylinder& expected, const Common& common) const;

  /// Returns the sightings of the fitted landmarks, with the scatter of all fits of the same stage.
  [[nodiscard]] static std::vector<OutlineVerdict> judge(const std::vector<const OutlineSearch*>& looks);

 private:
  /// Returns the candidate's ray, from the point where it has that height.
  [[nodiscard]] std::optional<Ray> ray_at(const Candidate& candidate, double height_m) const;
  void follow_colour(std::uint8_t label, const cv::Mat& image, OutlineFit& fit) const;
  void fit_bands(const OutlineTask& task, const Cylinder& start) const;
  /// Fits the whole outline once. Returns the step to its answer (range m, bearing rad); nothing: there is no fit.
  [[nodiscard]] std::optional<Eigen::Vector2d> fit_whole(const OutlineTask& task, const Cylinder& start,
                                                         const Common& common, double converged_px) const;
  /// Sets `task.look.fit`.
  void fit(const OutlineTask& task, const Cylinder& cylinder, const SampleReach& reach, const PixelNoise& noise,
           const FitLimits& limits, int stride) const;

  const MirrorView& mirror_;
  cv::Size size_;
  const ColourTable& table_;
  Finder finder_;
};

/// Returns the width of the top in the image. If a landmark is too narrow, a mast that hides it is not recognised.
double rim_width_px(const OutlineFit& fit);

/// Returns the least area, in pixels, of an unobstructed landmark in a view: that of its wedge from
/// Finder::kSureRadius_px to its top, at Landmark::greatest_range_m, in the direction in which it appears smallest. It
/// is at least Finder::kLeastArea_px, and equal to that where the target has no greatest range.
double least_area_px(const MirrorView& view, const Landmark& target);

/// Whether a view shows a landmark's colour outside the first candidate, with at least half of a landmark's least area.
/// Half is enough, because a landmark loses its colour in shadow and objects may hide a part of it.
enum class Rivals {
  kNone,
  kApart,   ///< elsewhere
  kBeside,  ///< in the candidate, which is wider than a landmark with its top there
};
/// Returns whether and where a view shows a rival. Colour within the width of one landmark is no rival: it may be a
/// part of a landmark that a mast splits.
/// @param found with a candidate @param least_px least_area_px() @param width_doubt as Cylinder::width_doubt
Rivals rivals_of(const ViewFitter& fitter, const Landmark& target, const Found& found, double least_px,
                 double width_doubt = 0);

}  // namespace twocone::vision
