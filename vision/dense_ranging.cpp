// SPDX-License-Identifier: Apache-2.0
#include "vision/dense_ranging.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "base/errors.h"
#include "vision/dense/matching.h"
#include "vision/dense/panorama.h"
#include "vision/dense/refinement.h"
#include "vision/dense/rig_errors.h"
#include "vision/method_arguments.h"
#include "vision/srgb.h"
#include "vision/triangulation.h"

namespace twocone::vision {
namespace {

// Least deviation of a pixel's mean of r, g and b, in grey levels. Rounding to 8 bits has 0.3 per channel, and where
// there is no noise it is the same in all of them.
constexpr double kLeastNoise_grey = 0.3;
// Where everything has texture, no part of the image shows noise alone, and what is measured there is texture. No
// camera that is of use is noisier than this: a full well of 1,500 electrons, 15 of them read noise.
constexpr double kMostShot = 1.0 / 1500;
constexpr double kMostRead = 15.0 / 1500;
// Texture: the gradient energy of a window over that of noise. That of noise alone seldom exceeds this
// (dense_ranging_test.cpp, APlainWallIsUnknown).
constexpr float kLeastTexture = 2.5F;
// A match that leaves more than this share of the lower view's variance is none.
constexpr float kWorstMisfit = 0.7F;
// A disparity that is less certain is no range.
constexpr float kWorstSigma_px = 2.5F;

/// Returns the function of the sum r + g + b (0 to 765) that gives noise a standard deviation of 1.
std::vector<float> stabilised(const NoiseModel& noise) {
  std::vector<float> value{0};
  for (int sum = 0; sum < 765; ++sum) {
    const double code = (sum + 0.5) / 3;
    const double light = light_of_code()[std::size_t(code)];
    const double sigma_grey = std::sqrt(noise.shot * light + noise.read * noise.read) / light_per_grey(code);
    const double sigma = std::hypot(sigma_grey / std::numbers::sqrt3, kLeastNoise_grey);
    value.push_back(value.back() + static_cast<float>(1 / (3 * sigma)));
  }
  return value;
}

cv::Mat levels(const cv::Mat& rgb, const std::vector<float>& of_sum) {
  cv::Mat level(rgb.size(), CV_32F);
  for (int row = 0; row < rgb.rows; ++row) {
    const auto* in = rgb.ptr<std::uint8_t>(row);
    auto* out = level.ptr<float>(row);
    for (int i = 0; i < rgb.cols; ++i, in += 3) out[i] = of_sum[std::size_t(in[0] + in[1] + in[2])];
  }
  return level;
}

NoiseModel measured_noise(const cv::Mat& rgb, const MirrorView& view) {
  const auto& s = view.settings();
  NoiseModel noise = fit_noise(noise_samples(rgb, {s.centre_px, s.rim_radius_px})).value_or(NoiseModel{});
  noise.shot = std::min(noise.shot, kMostShot);
  noise.read = std::min(noise.read, kMostRead);
  return noise;
}

void check(const Rig& rig, cv::Size size, const DenseSettings& settings) {
  base::Complaints bad;
  bad.require(settings.azimuths >= 64 && settings.azimuths % 2 == 0, "azimuths is {}, must be even and >= 64",
              settings.azimuths);
  bad.within("rounds", settings.rounds, 1, 3);
  bad.require(base::is_positive(settings.nearest_m), "nearest_m is {} m, must be > 0", settings.nearest_m);
  bad.require(size.width > 0 && size.height > 0, "the images' size is {} x {}, must be > 0", size.width, size.height);
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const cv::Mat& mask = settings.own_body[std::size_t(side)];
    if (mask.empty()) continue;
    bad.require(mask.size() == size && mask.type() == CV_8UC1, "own_body of the {} view is not CV_8UC1 of {} x {}",
                to_string(side), size.width, size.height);
  }
  bad.require(rig.mirror_separation_m() > 0, "the upper mirror is {} m above the lower one, must be > 0",
              rig.mirror_separation_m());
  bad.raise("DenseRanging");
}

}  // namespace

std::string_view to_string(DenseVerdict verdict) {
  constexpr std::array<std::string_view, 7> kNames{"ok",       "not_shared", "own_body",    "no_texture",
                                                   "occluded", "repeated",   "beyond_limit"};
  static_assert(std::size_t(DenseVerdict::kBeyondLimit) + 1 == kNames.size());
  return kNames.at(std::size_t(verdict));
}

struct DenseRanging::Impl {
  Impl(UncertainRig rig, cv::Size the_size, DenseSettings the_settings)
      : belief(std::move(rig)),
        size(the_size),
        settings((check(belief.rig(), the_size, the_settings), std::move(the_settings))),
        grid(grid_of(belief.rig(), settings.azimuths)),
        views{PanoramaView(belief.rig().lower, grid, 2 * settings.nearest_m, size, settings.own_body[0]),
              PanoramaView(belief.rig().upper, grid, 2 * settings.nearest_m, size, settings.own_body[1])},
        blur(views[0].widths_px(), views[1].widths_px()),
        rig_errors(belief, grid, settings.nearest_m) {
    const double from_eye_m = settings.nearest_m + eye_of(belief.rig().lower).behind_m;
    // A slope t of the lower view meets the floor where the upper view has the slope t (height of its eye / that of the
    // lower one), but for the little by which one eye is farther behind the axis.
    const double per_slope = 1 - eye_of(belief.rig().upper).height_m / eye_of(belief.rig().lower).height_m;
    floor = {per_slope, -grid.first_slope / grid.slope_step};
    greatest_px = static_cast<int>(std::ceil(belief.rig().mirror_separation_m() / (from_eye_m * grid.slope_step)));
  }

  /// Where a pixel of the lower view and one of the upper view meet.
  struct Meeting {
    float along_m, height_m, left_m;
    float per_px;  ///< of `along_m`, by the disparity
  };
  [[nodiscard]] std::optional<Meeting> meeting(int azimuth, int index, float disparity_px) const {
    const PlaneRay lower = views[0].ray(azimuth, static_cast<float>(index));
    const PlaneRay upper = views[1].ray(azimuth, static_cast<float>(index) - disparity_px);
    const float closing = lower.slope - upper.slope;
    if (!(closing > 0)) return std::nullopt;
    const float along_m = (upper.height_m - lower.height_m) / closing;
    const float left_m = lower.left_m + lower.left_slope * along_m;
    const auto step = static_cast<float>(grid.slope_step);
    return Meeting{along_m, lower.height_m + lower.slope * along_m, left_m, along_m * step / closing};
  }

  UncertainRig belief;
  cv::Size size;
  DenseSettings settings;
  PanoramaGrid grid;
  std::array<PanoramaView, 2> views;
  AcrossBlur blur;
  RigErrorsOfRange rig_errors;
  FloorLine floor;
  int greatest_px = 0;
};

DenseRanging::DenseRanging(UncertainRig rig, cv::Size size, DenseSettings settings)
    : impl_(std::make_unique<Impl>(std::move(rig), size, std::move(settings))) {}
DenseRanging::~DenseRanging() = default;
DenseRanging::DenseRanging(DenseRanging&&) noexcept = default;
DenseRanging& DenseRanging::operator=(DenseRanging&&) noexcept = default;

const PanoramaGrid& DenseRanging::grid() const { return impl_->grid; }
const DenseSettings& DenseRanging::settings() const { return impl_->settings; }

cv::Mat DenseRanging::panorama(Side side, const cv::Mat& image) const {
  if (image.size() != impl_->size) {
    throw base::InvalidArgument("DenseRanging: the image has {} x {} pixels, wanted {} x {}", image.cols, image.rows,
                                impl_->size.width, impl_->size.height);
  }
  const PanoramaView& view = impl_->views[std::size_t(side)];
  cv::Mat panorama = without_seam(view.resample(image)).clone();
  panorama.setTo(cv::Scalar::all(0), without_seam(view.shown()) == 0);
  return panorama;
}

RangeImage DenseRanging::measure(const cv::Mat& lower, const cv::Mat& upper,
                                 const std::optional<std::array<NoiseModel, 2>>& noise) const {
  check_image("DenseRanging", "lower", lower, impl_->size);
  check_image("DenseRanging", "upper", upper, impl_->size);
  const auto& views = impl_->views;
  const Rig& rig = impl_->belief.rig();
  const std::array<NoiseModel, 2> noises =
      noise ? *noise : std::array{measured_noise(lower, rig.lower), measured_noise(upper, rig.upper)};
  const PanoramaPair pair{AcrossBlur::blurred(views[0].resample(levels(lower, stabilised(noises[0])))),
                          views[1].resample(levels(upper, stabilised(noises[1]))),
                          views[0].shown(),
                          views[1].shown(),
                          &impl_->blur,
                          &impl_->floor};
  const MatchedDisparities matched = match(pair, impl_->greatest_px);

  const PanoramaGrid& grid = impl_->grid;
  const cv::Size full(grid.slopes, grid.azimuths);
  cv::Mat start;
  cv::Mat smooth;
  cv::medianBlur(matched.disparity_px, smooth, 3);
  cv::resize(smooth, start, full, 0, 0, cv::INTER_LINEAR);
  cv::Mat unchecked;
  cv::Mat repeated;
  cv::resize(matched.is_unchecked, unchecked, full, 0, 0, cv::INTER_NEAREST);
  cv::resize(matched.is_repeated, repeated, full, 0, 0, cv::INTER_NEAREST);
  const cv::Mat lower_shown = without_seam(views[0].shown());
  const RefinedDisparities refined =
      refine(pair, start, ~unchecked & lower_shown, views[1].widths_px(), impl_->settings.rounds);

  RangeImage image{grid,
                   cv::Mat(full, CV_8U),
                   cv::Mat(full, CV_32F, cv::Scalar(0)),
                   cv::Mat(full, CV_32F, cv::Scalar(0)),
                   cv::Mat(full, CV_32F, cv::Scalar(0)),
                   cv::Mat(full, CV_32F, cv::Scalar(0)),
                   cv::Mat(full, CV_32F, cv::Scalar(0)),
                   refined.disparity_px.clone()};
  const cv::Mat own_body = without_seam(views[0].own_body());
  const cv::Mat upper_own_body = without_seam(views[1].own_body());
  const cv::Mat upper_shown = without_seam(views[1].shown());
  for (int a = 0; a < full.height; ++a) {
    const double bearing_rad = grid.bearing_rad(a);
    for (int i = 0; i < full.width; ++i) {
      const auto answer = [&]() -> DenseVerdict {
        if (own_body.at<std::uint8_t>(a, i) != 0) return DenseVerdict::kOwnBody;
        if (lower_shown.at<std::uint8_t>(a, i) == 0) return DenseVerdict::kNotShared;
        const float disparity_px = refined.disparity_px.at<float>(a, i);
        const float sigma_px = refined.sigma_px.at<float>(a, i);
        if (!(refined.texture.at<float>(a, i) > kLeastTexture) || !(sigma_px < kWorstSigma_px)) {
          return DenseVerdict::kNoTexture;
        }
        const float other = static_cast<float>(i) - disparity_px;
        const int other_index = static_cast<int>(std::lround(other));
        if (other < 0) return DenseVerdict::kNotShared;
        if (upper_own_body.at<std::uint8_t>(a, other_index) != 0) return DenseVerdict::kOwnBody;
        if (upper_shown.at<std::uint8_t>(a, other_index) == 0) return DenseVerdict::kNotShared;
        const float misfit = refined.misfit.at<float>(a, i);
        if (unchecked.at<std::uint8_t>(a, i) != 0 || misfit > kWorstMisfit) return DenseVerdict::kOccluded;
        if (repeated.at<std::uint8_t>(a, i) != 0) return DenseVerdict::kRepeated;
        if (disparity_px < kMinSigmas * sigma_px) return DenseVerdict::kBeyondLimit;
        const auto met = impl_->meeting(a, i, disparity_px);
        if (!met) return DenseVerdict::kBeyondLimit;
        const float own_m = met->per_px * sigma_px;
        image.range_m.at<float>(a, i) = std::hypot(met->along_m, met->left_m);
        image.height_m.at<float>(a, i) = met->height_m;
        image.bearing_rad.at<float>(a, i) = static_cast<float>(
            std::remainder(bearing_rad + std::atan2(met->left_m, met->along_m), 2 * std::numbers::pi));
        image.own_sigma_m.at<float>(a, i) = own_m;
        image.sigma_m.at<float>(a, i) =
            std::hypot(own_m, static_cast<float>(impl_->rig_errors.sigma_m(a, i, met->along_m)));
        return DenseVerdict::kOk;
      };
      image.verdict.at<std::uint8_t>(a, i) = static_cast<std::uint8_t>(answer());
    }
  }
  return image;
}

}  // namespace twocone::vision
