// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/camera_stage.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/errors.h"
#include "base/random.h"
#include "drivers/sim_povray/camera/jpeg.h"
#include "drivers/sim_povray/camera/light.h"

namespace twocone::sim_povray {
namespace {

std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

int shutter_sample_count(const CameraEffects& effects) { return takes_time(effects) ? effects.shutter_samples : 1; }

bool has_distortion(const CameraEffects& effects) {
  return std::any_of(effects.distortion.begin(), effects.distortion.end(), [](double k) { return k != 0; });
}

/// Returns when the shutter of a row opens, from the opening of the first row's.
double opens_s(const CameraEffects& effects, int row, int height_px) {
  return effects.readout_s * (height_px > 1 ? row / (height_px - 1.0) : 0.5);
}

/// Returns the time of sample i of n: (i + 1/2) / n of the way from the first row's opening to the last row's closing.
double sample_time_s(const CameraEffects& effects, int i) {
  return (effects.readout_s + effects.exposure_time_s) * (i + 0.5) / effects.shutter_samples;
}

/// Returns the integral from -infinity to `x` of the triangle of height 1 over -1 to 1.
double triangle_until(double x) {
  if (x <= -1) return 0;
  if (x >= 1) return 1;
  return x < 0 ? (1 + x) * (1 + x) / 2 : 1 - (1 - x) * (1 - x) / 2;
}

/// Returns, for each row, the shares of the shutter samples in its light: the mean over the time while its shutter is
/// open, of light that changes linearly from sample to sample, and not before the first or after the last. So a row's
/// mean time is the middle of that time. The samples within it alone would move it by up to half of their interval.
std::vector<std::vector<ImageShare>> samples_of_rows(const CameraEffects& effects, int height_px) {
  std::vector<std::vector<ImageShare>> rows(static_cast<std::size_t>(height_px));
  const int count = shutter_sample_count(effects);
  const double interval_s = (effects.readout_s + effects.exposure_time_s) / count;
  for (int row = 0; row < height_px; ++row) {
    std::vector<ImageShare>& shares = rows[std::size_t(row)];
    if (count == 1) {
      shares = {{0, 1}};
      continue;
    }
    // In intervals from the first sample. A shutter that opens for no time is one that opens for very little.
    const double begin = opens_s(effects, row, height_px) / interval_s - 0.5;
    const double end = begin + std::max(effects.exposure_time_s / interval_s, 1e-3);
    const double last = count - 1;
    for (int i = 0; i < count; ++i) {
      double weight = triangle_until(std::clamp(end, 0.0, last) - i) - triangle_until(std::clamp(begin, 0.0, last) - i);
      if (i == 0) weight += std::max(0.0, std::min(end, 0.0) - begin);
      if (i == count - 1) weight += std::max(0.0, end - std::max(begin, last));
      constexpr double kNegligible = 1e-6;  // of a row's light
      const double share = weight / (end - begin);
      if (share > kNegligible) shares.push_back({i, static_cast<float>(share)});
    }
  }
  return rows;
}

}  // namespace

std::vector<RowRange> rows_of_shutter_samples(const CameraEffects& effects, int height_px) {
  std::vector<RowRange> ranges(std::size_t(shutter_sample_count(effects)), RowRange{height_px, -1});
  const auto rows = samples_of_rows(effects, height_px);
  for (int row = 0; row < height_px; ++row) {
    for (const ImageShare& sample : rows[std::size_t(row)]) {
      RowRange& range = ranges[std::size_t(sample.image)];
      range = {std::min(range.first, row), row};
    }
  }
  for (RowRange& range : ranges) {
    if (range.last < 0) range = {};
  }
  return ranges;
}

namespace {

void check(const CameraEffects& effects, const std::vector<std::shared_ptr<const Image>>& shutter_samples) {
  if (shutter_samples.size() != std::size_t(shutter_sample_count(effects))) {
    throw base::InvalidArgument("there are {} shutter samples, must be {}", shutter_samples.size(),
                                shutter_sample_count(effects));
  }
  for (const auto& image : shutter_samples) {
    const Image& first = *shutter_samples.front();
    const bool is_whole = image->format == PixelFormat::kRgb8 &&
                          image->bytes.size() == image_bytes(image->format, image->width_px, image->height_px);
    if (!is_whole || image->width_px != first.width_px || image->height_px != first.height_px) {
      throw base::InvalidArgument("a shutter sample of {} x {} px, {}, {} bytes, must be whole, Rgb8 and {} x {} px",
                                  image->width_px, image->height_px, to_string(image->format), image->bytes.size(),
                                  first.width_px, first.height_px);
    }
  }
}

/// All random numbers of an image follow from these values.
struct Draws {
  std::uint64_t seed;
  std::string_view camera;
  std::uint64_t step;
  std::chrono::nanoseconds now;

  [[nodiscard]] std::mt19937_64 engine(CameraPurpose purpose) const {
    return camera_engine(seed, purpose, camera, step);
  }
  [[nodiscard]] bool happens(double probability, CameraPurpose purpose) const {
    if (probability <= 0) return false;
    std::mt19937_64 random = engine(purpose);
    return base::fraction(random) < probability;
  }
  /// Returns the lamps' phase at time 0. It depends neither on the camera nor on the step.
  [[nodiscard]] double lamp_phase_rad() const {
    std::mt19937_64 random = camera_engine(seed, CameraPurpose::kFlicker, "", 0);
    return 2 * std::numbers::pi * base::fraction(random);
  }
};

/// Returns the lamps' light during the exposure of each row. Over an exposure T, the mean of cos(w t + phase) is
/// sin(w T / 2) / (w T / 2) times its value in the middle.
std::vector<float> light_of_rows(const CameraEffects& effects, const Draws& draws, int height_px) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const double half_rad = kTurn * kLampFlicker_hz * effects.exposure_time_s / 2;
  const double amplitude = effects.flicker * (half_rad > 0 ? std::sin(half_rad) / half_rad : 1);
  const double first_s = std::chrono::duration<double>(draws.now).count() - effects.stamp_late_s - effects.readout_s -
                         effects.exposure_time_s;
  const double phase_rad = draws.lamp_phase_rad();
  std::vector<float> gains;
  for (int row = 0; row < height_px; ++row) {
    const double middle_s = first_s + opens_s(effects, row, height_px) + effects.exposure_time_s / 2;
    gains.push_back(static_cast<float>(1 + amplitude * std::cos(kTurn * kLampFlicker_hz * middle_s + phase_rad)));
  }
  return gains;
}

/// Runs the stages after the shutter. @param all true: also the stages that are at their neutral values
Image run_stages(const CameraEffects& effects, Light light, const Draws& draws, bool all) {
  if (all || has_distortion(effects)) light = distorted(light, effects.distortion, effects.distortion_focal_px);
  if (all || effects.defocus_px > 0) light = defocused(light, effects.defocus_px);
  if (all || effects.vignetting > 0) vignette(light, effects.vignetting);
  if (all || !effects.colour_gain.empty()) multiply_channels(light, effects.colour_gain);
  if (all || effects.flicker > 0) multiply_rows(light, light_of_rows(effects, draws, light.height_px));
  if (all || effects.gain != 1) {
    const auto gain = static_cast<float>(effects.gain);
    for (float& value : light.values) value *= gain;
  }
  if (all || effects.full_well_electrons > 0) {
    add_shot_noise(light, effects.full_well_electrons, Normal(draws.engine(CameraPurpose::kShotNoise)));
  }
  if (all || effects.read_noise_electrons > 0) {
    const double sigma =
        effects.read_noise_electrons > 0 ? effects.read_noise_electrons / effects.full_well_electrons : 0;
    add_read_noise(light, sigma, Normal(draws.engine(CameraPurpose::kReadNoise)));
  }
  return effects.jpeg_quality > 0 ? through_jpeg(to_image(light), effects.jpeg_quality) : to_image(light);
}

}  // namespace

bool takes_time(const CameraEffects& effects) { return effects.exposure_time_s > 0 || effects.readout_s > 0; }

bool changes_pixels(const CameraEffects& effects) {
  return takes_time(effects) || has_distortion(effects) || effects.defocus_px > 0 || effects.vignetting > 0 ||
         effects.gain != 1 || effects.full_well_electrons > 0 || effects.read_noise_electrons > 0 ||
         !effects.colour_gain.empty() || effects.flicker > 0 || effects.jpeg_quality > 0;
}

std::vector<std::chrono::nanoseconds> shutter_samples_before(const CameraEffects& effects) {
  const std::chrono::nanoseconds late = to_nanoseconds(effects.stamp_late_s);
  if (!takes_time(effects)) return {late};
  std::vector<std::chrono::nanoseconds> before;
  before.reserve(std::size_t(effects.shutter_samples));
  for (int i = 0; i < effects.shutter_samples; ++i) {
    before.push_back(late + to_nanoseconds(effects.readout_s + effects.exposure_time_s - sample_time_s(effects, i)));
  }
  return before;
}

std::chrono::nanoseconds capture_before(const CameraEffects& effects) {
  return to_nanoseconds((effects.readout_s + effects.exposure_time_s) / 2);
}

Image develop(const CameraEffects& effects, const std::vector<std::shared_ptr<const Image>>& shutter_samples,
              std::uint64_t seed, std::string_view camera, std::uint64_t step, std::chrono::nanoseconds now) {
  check(effects, shutter_samples);
  if (!changes_pixels(effects)) return *shutter_samples.front();
  std::vector<const Image*> images;
  images.reserve(shutter_samples.size());
  for (const auto& image : shutter_samples) images.push_back(image.get());
  Light light = mean_light(images, samples_of_rows(effects, images.front()->height_px));
  return run_stages(effects, std::move(light), {seed, camera, step, now}, false);
}

Image pass_through(const Image& image) {
  CameraEffects neutral{
      .distortion = {0, 0, 0, 0, 0}, .distortion_focal_px = double(image.width_px), .colour_gain = {1, 1, 1}};
  const std::vector<std::vector<ImageShare>> each_row_of_both(std::size_t(image.height_px), {{0, 0.5F}, {1, 0.5F}});
  return run_stages(neutral, mean_light({&image, &image}, each_row_of_both), {0, "", 0, {}}, true);
}

bool drops(const CameraEffects& effects, std::uint64_t seed, std::string_view camera, std::uint64_t step) {
  return Draws{seed, camera, step, {}}.happens(effects.drop_probability, CameraPurpose::kDrop);
}

bool is_late(const CameraEffects& effects, std::uint64_t seed, std::string_view camera, std::uint64_t step) {
  return Draws{seed, camera, step, {}}.happens(effects.late_probability, CameraPurpose::kLate);
}

}  // namespace twocone::sim_povray
