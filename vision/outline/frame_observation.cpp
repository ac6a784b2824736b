// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "base/plane.h"
#include "vision/bands/band_code.h"
#include "vision/bands/band_finder.h"
#include "vision/method_arguments.h"
#include "vision/outline/ranging_impl.h"
#include "vision/outline/view_fitter.h"
#include "vision/outline_ranging.h"
#include "vision/triangulation.h"

namespace twocone::vision {
namespace {

// An object that hides a part of a landmark in one view, above all the rig's own mast, may hide it in the other view
// too. A landmark that is narrower than this in the other view does not show that. Tuned by hand on synthetic images;
// outline_ranging_test.cpp, NorIsAMastBeforeAFarOneThatTheUpperViewShowsAsALine, exercises it but does not fix it.
constexpr double kTellingWidth_px = 8;
// Greatest difference of the two views' bearings of one landmark. Tuned by hand on synthetic images;
// outline_ranging_test.cpp, ExchangedAndTurnedCamerasAreSeenByTheirVerdicts, exercises it but does not fix it.
constexpr double kSameBearing_rad = 4 * std::numbers::pi / 180;

// Bands whose line is farther from its height on the map than this many sigmas of their size, and the same share of
// belief as below of a rig and map that are not exact, are another landmark's, or the map is wrong.
constexpr double kBandSigmas = 6;
constexpr double kDoubtfulLine = 0.02;
// Heights are fitted with this many of their sigmas, so that the image decides, and rig and map count once.
constexpr double kHeightDoubts = 3;
// The height of a plain landmark is fitted where an error of the range would have to be more than this share of it to
// move the top's image as much. Otherwise the range takes it up.
constexpr double kOfRange = 0.2;
// Views that differ by more sigmas of rig and map than this do not show the same landmark: by chance once in 700 cases.
constexpr double kBeliefSigmas = 3;

/// The state of one landmark of a frame.
struct Seen {
  std::array<OutlineSearch, 2> looks;
  std::array<std::optional<Sighting>, 2> found;
  std::array<Surface, 2> surfaces;
  bool has_other_size = false;  ///< of bands: their own size contradicts the height of their line
  bool has_twins = false;       ///< other targets have its colour, and its place is not expected
  bool has_rivals = false;
  bool is_too_wide = false;              ///< Rivals::kBeside in one view
  std::array<double, 2> width_doubts{};  ///< Cylinder::width_doubt of either view
  std::array<Stage, 2> stages{Stage::kFound, Stage::kFound};
  std::optional<Cylinder> expected;
  std::optional<Cylinder> read;  ///< of a banded landmark: its place by the view that reads it
};

/// Returns what was found within kExpectedWithin_rad of a direction in the image.
Found within(const Found& found, double angle_rad) {
  Found near;
  constexpr double kPerBin_rad = 2 * std::numbers::pi / Finder::kBins;
  for (const Candidate& candidate : found.candidates) {
    if (std::abs(base::wrap_angle_rad(candidate.angle_rad - angle_rad)) <= kExpectedWithin_rad) {
      near.candidates.push_back(candidate);
    }
  }
  if (near.candidates.empty()) return near;
  near.area_px = found.area_px;
  for (std::size_t bin = 0; bin < near.area_px.size(); ++bin) {
    const double apart_rad = base::wrap_angle_rad((double(bin) + 0.5) * kPerBin_rad - angle_rad);
    if (std::abs(apart_rad) > kExpectedWithin_rad) near.area_px[bin] = 0;
  }
  return near;
}

}  // namespace

struct FrameObservation::Impl {
  Impl(const OutlineRanging::Impl& the_ranging, const cv::Mat& lower, const cv::Mat& upper,
       const std::optional<FrameMotion>& the_motion, const ExpectedPlaces& expected)
      : ranging(the_ranging), images{lower, upper}, motion(the_motion), all(ranging.targets.size()) {
    check_image("OutlineRanging", "lower", lower, ranging.views[0].size());
    check_image("OutlineRanging", "upper", upper, ranging.views[1].size());
    std::array<std::vector<Found>, 2> found;
    for (std::size_t view = 0; view < 2; ++view) {
      found[view] = ranging.views[view].finder().find(images[view], ranging.table, ranging.wanted_hues);
    }
    if (!expected.empty() && expected.size() != all.size()) {
      throw base::InvalidArgument("method outline: {} expected places, must be of {} targets or none", expected.size(),
                                  all.size());
    }
    std::array<std::vector<BandCandidate>, 2> bands;
    for (std::size_t view = 0; view < ranging.band_finders.size(); ++view) {
      bands[view] = ranging.band_finders[view].find(images[view]);
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].surfaces.fill(ranging.surface_of(k));
      if (!ranging.wanted[k]) continue;
      if (ranging.targets[k].bands) {
        choose_bands(k, bands);
        continue;
      }
      const std::size_t hue = ranging.hues[k];
      if (!expected.empty() && expected[k]) {
        const std::array near{within_expected(k, 0, found[0][hue], *expected[k]),
                              within_expected(k, 1, found[1][hue], *expected[k])};
        choose(k, {near.data(), &near[1]});
      } else if (ranging.shares_hue(k)) {
        all[k].has_twins = true;
      } else {
        choose(k, {&found[0][hue], &found[1][hue]});
      }
    }
  }

  /// Returns the regions of a landmark's colour in the direction in which a view shows an expected place; all of them
  /// where it cannot show the place.
  [[nodiscard]] Found within_expected(std::size_t k, std::size_t view, const Found& all_found,
                                      const Eigen::Vector2d& place_m) const {
    const MirrorView& mirror = of_view(ranging.belief.rig(), Side(view));
    const Landmark& target = ranging.targets[k];
    const auto shown = mirror.project_with_jacobian({place_m.x(), place_m.y(), target.top_m}, Rim::kGoesOn);
    if (!shown) return all_found;
    const Eigen::Vector2d from_tip = shown->pixel_px - mirror.settings().centre_px;
    return within(all_found, std::atan2(from_tip.y(), from_tip.x()));
  }

  [[nodiscard]] std::vector<const OutlineSearch*> looks(std::size_t view) const {
    std::vector<const OutlineSearch*> looks;
    looks.reserve(all.size());
    for (const Seen& seen : all) looks.push_back(&seen.looks[view]);
    return looks;
  }

  /// Returns the place of a candidate by its view alone, where rig and map are not known exactly.
  [[nodiscard]] std::optional<Triangulation> alone_in(std::size_t k, std::size_t view,
                                                      const Candidate& candidate) const {
    if (ranging.is_exact(k) || candidate.at_rim) return std::nullopt;
    const Landmark& target = ranging.targets[k];
    const auto sighting = ranging.views[view].found(candidate, target.radius_m, target.top_m);
    if (!sighting) return std::nullopt;
    const bool is_lower = view == 0;
    Triangulation alone =
        ranging.place(k, is_lower ? &*sighting : nullptr, is_lower ? nullptr : &*sighting, target.top_m, motion);
    return alone.range_m ? std::optional(std::move(alone)) : std::nullopt;
  }

  /// @param alone the place of a landmark by one view alone
  [[nodiscard]] double width_doubt(std::size_t k, const Triangulation& alone) const {
    const double by_range = alone.by_shared.row(0).norm() / *alone.range_m;
    const double by_radius = ranging.by_shared[k].row(kRadius).norm() / ranging.targets[k].radius_m;
    // The width is the image radius times 2 r / range, and an error of the image radius changes both: the sum of both
    // effects is less than twice that of the range.
    return std::hypot(2 * by_range, by_radius);
  }

  /// Chooses the candidates of both views that may be one landmark.
  void choose(std::size_t k, const std::array<const Found*, 2>& found) {
    Seen& seen = all[k];
    if (ranging.is_same_colour(k)) return;
    std::array<const Candidate*, 2> chosen{};
    const Eigen::Index errors = std::max(ranging.belief.errors(), ranging.by_shared[k].cols());
    std::array<Eigen::RowVectorXd, 2> by_shared{Eigen::RowVectorXd::Zero(errors), Eigen::RowVectorXd::Zero(errors)};
    const auto& views = ranging.views;
    const Landmark& target = ranging.targets[k];
    for (std::size_t view = 0; view < 2; ++view) {
      if (found[view]->candidates.empty()) continue;
      chosen[view] = &found[view]->candidates.front();
      const std::optional<Triangulation> alone = alone_in(k, view, *chosen[view]);
      if (alone) {
        seen.width_doubts[view] = width_doubt(k, *alone);
        by_shared[view] = alone->by_shared.row(1);
      }
      const Rivals rivals =
          rivals_of(views[view], target, *found[view], ranging.least_px[k][view], seen.width_doubts[view]);
      seen.has_rivals = seen.has_rivals || rivals == Rivals::kApart;
      seen.is_too_wide = seen.is_too_wide || rivals == Rivals::kBeside;
    }
    if (chosen[0] != nullptr && chosen[1] != nullptr) {
      const double doubt_rad = ranging.is_exact(k) ? 0 : kBeliefSigmas * (by_shared[0] - by_shared[1]).norm();
      const double apart_rad = base::wrap_angle_rad(views[0].bearing_of(*chosen[0]) - views[1].bearing_of(*chosen[1]));
      if (std::abs(apart_rad) > kSameBearing_rad + doubt_rad) seen.has_rivals = true;
    }
    if (seen.has_rivals) return;

    for (std::size_t view = 0; view < 2; ++view) {
      if (chosen[view] == nullptr) continue;
      OutlineSearch& look = seen.looks[view];
      look.candidate = *chosen[view];
      look.is_truncated = chosen[view]->at_rim;
      if (!look.is_truncated) seen.found[view] = views[view].found(*chosen[view], target.radius_m, target.top_m);
    }
  }

  /// Returns the number's candidate of a view that may be a landmark, and sets what others there are.
  [[nodiscard]] const BandCandidate* chosen_bands(std::size_t k, std::size_t view,
                                                  const std::vector<BandCandidate>& found) {
    const Landmark& target = ranging.targets[k];
    const BandCandidate* chosen = nullptr;
    for (const BandCandidate& bands : found) {
      if (bands.number != target.bands->number) continue;
      // The line's height, and with it the distance by the line's ray, follows from the bands' own size.
      const double line_m = ranging.band_finders[view].place_of(bands, target.bands->cell_m).line_m;
      const double from_eye_m = target.bands->cell_m / bands.slope_per_cell * bands.line_slope;
      const double by_size_m = kBandSigmas * bands.sigma * from_eye_m;
      const double believed_m = ranging.is_exact(k) ? 0 : kBeliefSigmas * kDoubtfulLine * from_eye_m;
      if (std::abs(line_m - target.top_m) > by_size_m + believed_m) {
        all[k].has_other_size = true;
        continue;
      }
      if (chosen == nullptr) {
        chosen = &bands;
        continue;
      }
      // What stands before a landmark may split it.
      const double apart_rad = base::wrap_angle_rad(bands.candidate.angle_rad - chosen->candidate.angle_rad);
      if (std::abs(apart_rad) <= kSameBearing_rad) continue;
      all[k].has_rivals = true;
      return nullptr;
    }
    return chosen;
  }

  /// Chooses the candidates of both views that show the number of a banded landmark. Where one view alone reads it, the
  /// other one's is where the first one's place is seen.
  void choose_bands(std::size_t k, const std::array<std::vector<BandCandidate>, 2>& found) {
    Seen& seen = all[k];
    const Landmark& target = ranging.targets[k];
    seen.has_twins = ranging.shares_number(k);
    if (seen.has_twins) return;
    std::array<const BandCandidate*, 2> chosen{chosen_bands(k, 0, found[0]), chosen_bands(k, 1, found[1])};
    if (seen.has_rivals || (chosen[0] == nullptr && chosen[1] == nullptr)) return;
    seen.has_other_size = false;
    const std::size_t reading = chosen[0] != nullptr ? 0 : 1;
    seen.read = ranging.views[reading].place(chosen[reading]->candidate, target.radius_m, target.top_m);
    for (std::size_t view = 0; view < 2; ++view) {
      OutlineSearch& look = seen.looks[view];
      if (chosen[view] != nullptr) {
        look.candidate = chosen[view]->candidate;
        seen.found[view] = ranging.views[view].found(*look.candidate, target.radius_m, target.top_m);
        if (seen.found[view]) seen.found[view]->covariance_px2 += BandFinder::between_lines_px2(*look.candidate);
      } else if (seen.read) {
        look.candidate = candidate_at(view, seen.read->place_m(), target);
      }
      seen.surfaces[view].limit_of_light = chosen[chosen[view] != nullptr ? view : reading]->limit;
      const auto alone = look.candidate ? alone_in(k, view, *look.candidate) : std::nullopt;
      if (alone) seen.width_doubts[view] = width_doubt(k, *alone);
    }
  }

  /// Returns the image of a landmark's near point, also beyond the rim.
  [[nodiscard]] auto near_point_in(std::size_t view, const Eigen::Vector2d& place_m, double radius_m,
                                   double top_m) const {
    const MirrorView& mirror = of_view(ranging.belief.rig(), Side(view));
    const auto near_m = near_top_point(mirror, place_m, radius_m, top_m);
    return near_m ? mirror.project_with_jacobian(*near_m, Rim::kGoesOn) : std::nullopt;
  }

  /// Returns where a view shows the near point of a landmark at a place.
  [[nodiscard]] std::optional<Candidate> candidate_at(std::size_t view, const Eigen::Vector2d& place_m,
                                                      const Landmark& target) const {
    const auto shown = near_point_in(view, place_m, target.radius_m, target.top_m);
    if (!shown) return std::nullopt;
    const Eigen::Vector2d from_tip = shown->pixel_px - of_view(ranging.belief.rig(), Side(view)).settings().centre_px;
    return Candidate{.angle_rad = std::atan2(from_tip.y(), from_tip.x()), .top_px = from_tip.norm()};
  }

  /// Returns Cylinder::height_doubt_m. Bands may contradict their size by it. Where a view hardly looks down or up at a
  /// top, no range moves its image: without a doubt, the top would be where the believed rig has the horizon, whatever
  /// the image shows.
  [[nodiscard]] double height_doubt_m(std::size_t k, std::size_t view, const Cylinder& cylinder) const {
    const Eigen::Vector2d place_m = cylinder.place_m();
    const auto shown = near_point_in(view, place_m, cylinder.radius_m, cylinder.top_m);
    if (!shown) return 0;
    const Eigen::Vector2d by_height_pxpm = shown->jacobian.col(2);
    const auto by_rig_px = ranging.belief.pixel_by_shared(Side(view), place_m, cylinder.radius_m, cylinder.top_m);
    const double by_rig_m = (by_height_pxpm.transpose() * by_rig_px).norm() / by_height_pxpm.squaredNorm();
    const double doubt_m = std::hypot(ranging.by_shared[k].row(kTop).norm(), by_rig_m);
    const double by_range = (shown->jacobian.leftCols<2>() * place_m.normalized()).norm() / by_height_pxpm.norm();
    if (!cylinder.bands && doubt_m < kOfRange * by_range * cylinder.range_m) return 0;
    return kHeightDoubts * doubt_m;
  }

  void set_doubts(std::size_t k, std::size_t view, const Candidate& candidate, Cylinder& cylinder) const {
    if (ranging.is_exact(k)) return;
    cylinder.width_doubt = all[k].width_doubts[view];
    cylinder.height_doubt_m = height_doubt_m(k, view, cylinder);
    cylinder.lean_doubt_rad = std::sqrt(ranging.belief.lean_variance_rad2(Side(view), candidate.top_px));
  }

  void take_to_coarse(std::size_t k, std::size_t view, Stage stage) {
    Seen& seen = all.at(k);
    if (seen.stages[view] != Stage::kFound) return;
    seen.stages[view] = Stage::kCoarse;
    OutlineSearch& look = seen.looks[view];
    if (!look.candidate || look.is_truncated) return;
    const Landmark& target = ranging.targets[k];
    const ViewFitter& fitter = ranging.views[view];
    const OutlineTask task{seen.surfaces[view], images[view], look, edge_samples};
    if (seen.expected) {
      const auto common = stage == Stage::kFine ? ViewFitter::common(looks(view)) : std::nullopt;
      Cylinder expected = ranging.when_exposed(view, *seen.expected, motion);
      expected.bands = target.bands;
      set_doubts(k, view, *look.candidate, expected);
      const bool is_there = common ? fitter.fit_expected(task, expected, *common) : fitter.fit_near(task, expected);
      if (is_there) return;
    }
    auto start = fitter.place(*look.candidate, target.radius_m, target.top_m);
    if (!start) start = seen.read;
    if (!start) return;
    start->bands = target.bands;
    set_doubts(k, view, *look.candidate, *start);
    fitter.fit_coarse(task, *start);
  }

  void take_to_fine(std::size_t view, std::span<const std::size_t> landmarks) {
    const auto common = ViewFitter::common(looks(view));
    for (const std::size_t k : landmarks) {
      all[k].stages[view] = Stage::kFine;
      OutlineSearch& look = all[k].looks[view];
      if (common && look.fit && !look.is_fine) {
        ranging.views[view].fit_fine({all[k].surfaces[view], images[view], look, edge_samples}, *common);
      }
    }
  }

  /// Returns whether the landmark's colour was found without a usable outline.
  static bool is_part_hidden(const OutlineSearch& look, const OutlineVerdict& judged) {
    return look.candidate && !judged.sighting && !look.is_truncated && !look.is_saturated;
  }

  /// Returns whether both views show the whole top at another height than the map's. An outline that is projected with
  /// a top far from the true one lies far from the pixels, so its fit fails as if something hid the landmark. Therefore
  /// the outline is fitted again with an unknown height. A top that is hidden in one view gives a height as well, but a
  /// range that contradicts the landmark's width.
  [[nodiscard]] bool shows_another_top(std::size_t k, const Seen& seen) const {
    const Landmark& target = ranging.targets[k];
    if (target.bands) return false;
    std::array<OutlineSearch, 2> looks;
    std::array<Sighting, 2> sightings;
    for (std::size_t view = 0; view < 2; ++view) {
      const OutlineSearch& look = seen.looks[view];
      if (!look.candidate || look.candidate->at_rim || look.is_saturated) return false;
      looks[view].candidate = look.candidate;
      sightings[view].pixel_px = ranging.views[view].pixel_of(*look.candidate);
    }
    const auto place = [&](const std::optional<double>& top_m) {
      return ranging.place(k, sightings.data(), &sightings[1], top_m, motion);
    };
    EdgeSamples own_samples;
    // The first height is as accurate as the finder's pixels, the second as accurate as the outlines.
    for (int round = 0; round < 2; ++round) {
      const Triangulation free = place(std::nullopt);
      if (free.verdict != RangeVerdict::kOk) return false;
      const Cylinder start{*free.range_m, *free.bearing_rad, target.radius_m, *free.top_m};
      bool is_telling = false;
      for (std::size_t view = 0; view < 2; ++view) {
        const ViewFitter& fitter = ranging.views[view];
        const Candidate& candidate = *looks[view].candidate;
        fitter.fit_coarse({seen.surfaces[view], images[view], looks[view], own_samples}, start);
        const OutlineVerdict judged = ViewFitter::judge({&looks[view]}).front();
        if (judged.sighting) {
          if (judged.is_narrow || judged.is_wide) return false;
          sightings[view] = *judged.sighting;
          is_telling = true;
        } else {
          // The landmark is too thin for an outline: use the finder's position.
          const auto found = fitter.found(candidate, target.radius_m, start.top_m);
          if (!found || 2 * candidate.top_px * target.radius_m > kTellingWidth_px * start.range_m) return false;
          sightings[view] = *found;
        }
      }
      if (!is_telling) return false;
    }
    // Only the height contradicts the map; the bearings of the two views agree.
    return place(std::nullopt).verdict == RangeVerdict::kOk &&
           place(target.top_m).verdict == RangeVerdict::kInconsistent;
  }

  /// Leaves out views in which the line of bands lies beyond the rim, though bands below it are seen: there is no ray.
  void leave_out_beyond_rims(std::array<OutlineVerdict, 2>& judged) const {
    for (const Side side : {Side::kLower, Side::kUpper}) {
      std::optional<Sighting>& sighting = judged[std::size_t(side)].sighting;
      if (sighting && !of_view(ranging.belief.rig(), side).back_project(sighting->pixel_px)) sighting.reset();
    }
  }

  [[nodiscard]] RangeMeasurement conclude(std::size_t k, const Seen& seen,
                                          const std::array<OutlineVerdict, 2>& judged) const {
    RangeMeasurement m;
    const OutlineVerdict& lower = judged[0];
    const OutlineVerdict& upper = judged[1];
    if (!ranging.wanted[k]) return m;
    if (ranging.is_same_colour(k) || seen.has_twins) return with_verdict(m, RangeVerdict::kSameColour);
    if (seen.has_rivals) return with_verdict(m, RangeVerdict::kTwoCandidates);
    if (seen.has_other_size) return with_verdict(m, RangeVerdict::kInconsistent);
    if (seen.is_too_wide) {
      return with_verdict(m, shows_another_top(k, seen) ? RangeVerdict::kInconsistent : RangeVerdict::kTwoCandidates);
    }
    m.lower_sighting = lower.sighting;
    m.upper_sighting = upper.sighting;
    if (lower.sighting) m.lower_px = lower.sighting->pixel_px;
    if (upper.sighting) m.upper_px = upper.sighting->pixel_px;
    const Landmark& target = ranging.targets[k];
    const Triangulation t = ranging.place(k, lower.sighting ? &*lower.sighting : nullptr,
                                          upper.sighting ? &*upper.sighting : nullptr, target.top_m, motion);
    m.verdict = t.verdict;
    const bool is_narrow = (lower.sighting && lower.is_narrow) || (upper.sighting && upper.is_narrow);
    // An outline is missing or not whole: either something hides it, or the map is wrong.
    if ((!lower.sighting || !upper.sighting || is_narrow) && shows_another_top(k, seen)) {
      m.disparity_px = t.disparity_px;
      return with_verdict(m, RangeVerdict::kInconsistent);
    }
    if (t.verdict == RangeVerdict::kNotSeen) {
      const auto any = [&](auto what) { return bool(seen.looks[0].*what) || bool(seen.looks[1].*what); };
      if (any(&OutlineSearch::is_saturated)) return with_verdict(m, RangeVerdict::kSaturated);
      if (lower.is_occluded || upper.is_occluded) return with_verdict(m, RangeVerdict::kOccluded);
      if (any(&OutlineSearch::is_truncated)) return with_verdict(m, RangeVerdict::kTruncated);
      return any(&OutlineSearch::candidate) ? with_verdict(m, RangeVerdict::kNoMatch) : m;
    }
    if (t.verdict == RangeVerdict::kOneView) {
      // No occlusion makes a landmark wider than it is at its range: the top is not at the height of the map.
      if (lower.sighting ? lower.is_wide : upper.is_wide) return with_verdict(m, RangeVerdict::kInconsistent);
      // No other view shows whether the top is whole. Bands that were read are.
      const std::size_t shown = lower.sighting ? 0 : 1;
      const auto& fit = seen.looks[shown].fit;
      if (is_narrow || (!ranging.targets[k].bands && is_part_hidden(seen.looks[1 - shown], judged[1 - shown]) && fit &&
                        rim_width_px(*fit) < kTellingWidth_px)) {
        return with_verdict(m, RangeVerdict::kOccluded);
      }
    }
    m.range_m = t.range_m;
    m.bearing_rad = t.bearing_rad;
    m.covariance = t.covariance;
    m.own_covariance = t.own_covariance;
    m.by_shared = t.by_shared;
    m.disparity_px = t.disparity_px;
    if (t.covariance) {
      m.sigma_range_m = std::sqrt((*t.covariance)(0, 0));
      m.sigma_bearing_rad = std::sqrt((*t.covariance)(1, 1));
    }
    if (is_narrow) {
      m.verdict = RangeVerdict::kOccluded;
      m.bearing_rad.reset();
      m.sigma_bearing_rad.reset();
    }
    return m;
  }

  const OutlineRanging::Impl& ranging;
  std::array<cv::Mat, 2> images;
  std::optional<FrameMotion> motion;
  std::vector<Seen> all;
  EdgeSamples edge_samples;  // shared by all fits, so that its memory is allocated once
};

FrameObservation::FrameObservation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FrameObservation::~FrameObservation() = default;
FrameObservation::FrameObservation(FrameObservation&&) noexcept = default;
FrameObservation& FrameObservation::operator=(FrameObservation&&) noexcept = default;

void FrameObservation::expect(std::size_t landmark, double range_m, double bearing_rad) {
  Seen& seen = impl_->all.at(landmark);
  const Landmark& target = impl_->ranging.targets[landmark];
  if (range_m > target.radius_m) seen.expected = Cylinder{range_m, bearing_rad, target.radius_m, target.top_m};
}

void FrameObservation::take(std::span<const std::size_t> landmarks, Stage stage, Views views) {
  if (stage == Stage::kFound) return;
  const auto is_asked = [views](std::size_t view) {
    return views == Views::kBoth || (view == 0) == (views == Views::kLower);
  };
  for (const std::size_t k : landmarks) {
    for (std::size_t view = 0; view < 2; ++view) {
      if (is_asked(view)) impl_->take_to_coarse(k, view, stage);
    }
  }
  for (std::size_t view = 0; view < 2; ++view) {
    if (stage == Stage::kFine && is_asked(view)) impl_->take_to_fine(view, landmarks);
  }
}

int FrameObservation::refined() const {
  const auto is_fine = [](const Seen& seen) { return seen.looks[0].is_fine || seen.looks[1].is_fine; };
  return static_cast<int>(std::ranges::count_if(impl_->all, is_fine));
}

std::vector<RangeMeasurement> FrameObservation::measurements() const {
  const std::array judged{ViewFitter::judge(impl_->looks(0)), ViewFitter::judge(impl_->looks(1))};
  std::vector<RangeMeasurement> measurements;
  for (std::size_t k = 0; k < impl_->all.size(); ++k) {
    std::array<OutlineVerdict, 2> both;
    for (std::size_t view = 0; view < 2; ++view) {
      both[view] =
          impl_->all[k].stages[view] == Stage::kFound ? OutlineVerdict{impl_->all[k].found[view]} : judged[view][k];
    }
    if (impl_->ranging.targets[k].bands) impl_->leave_out_beyond_rims(both);
    measurements.push_back(impl_->conclude(k, impl_->all[k], both));
  }
  return measurements;
}

FrameObservation OutlineRanging::look(const cv::Mat& lower, const cv::Mat& upper,
                                      const std::optional<FrameMotion>& motion, const ExpectedPlaces& expected) const {
  return FrameObservation(std::make_unique<FrameObservation::Impl>(*impl_, lower, upper, motion, expected));
}

}  // namespace twocone::vision
