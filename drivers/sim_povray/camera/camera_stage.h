// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/session_settings.h"
#include "hal/image.h"

/// Turns rendered light into the image of a camera.
namespace twocone::sim_povray {

/// Returns whether any effect changes the pixels of an image; if not, none of the stages below runs.
[[nodiscard]] bool changes_pixels(const CameraEffects& effects);
/// Returns whether an image is made from several of different times. A late stamp alone does not require that.
[[nodiscard]] bool takes_time(const CameraEffects& effects);

/// Returns how long before the world's present step each of an image's shutter samples is, oldest first; one sample, at
/// 0, if the image takes no time. The last row's shutter closes at the present step. The shutter samples are evenly
/// spread, in the middles of equal parts of readout + exposure. With a late stamp all of them are stamp_late_s older.
[[nodiscard]] std::vector<std::chrono::nanoseconds> shutter_samples_before(const CameraEffects& effects);

/// Returns the time from the middle of an image's exposure (of its middle row), which its stamp gives, to the present
/// step. It ignores stamp_late_s.
[[nodiscard]] std::chrono::nanoseconds capture_before(const CameraEffects& effects);

/// Rows of an image, from 0, both included.
struct RowRange {
  int first = 0, last = 0;

  friend bool operator==(const RowRange&, const RowRange&) = default;
};

/// Returns which rows of an image of this height use each of its shutter samples. A sample that no row uses has one
/// row.
[[nodiscard]] std::vector<RowRange> rows_of_shutter_samples(const CameraEffects& effects, int height_px);

/// Makes one image from its shutter samples. These stages are in linear light, in this order: each row becomes the mean
/// over its own shutter time of light that changes linearly between the shutter samples; lens distortion, defocus,
/// vignetting, the lamps' colour and flicker, gain, shot noise, read noise. The result is then sRGB-coded again and
/// rounded, and compressed. Inactive stages are not computed: without effects the pixels are returned unchanged.
///
/// Colour and flicker act on the image as a whole, although they belong to the lamps: these are the only light of a
/// room, and the ambient part of its materials stands for their scattered light. The flicker's phase follows from the
/// seed alone, so that all cameras of a robot see the same lamps.
///
/// Noise is drawn from separate generators, one per purpose and camera and image, so that it depends neither on other
/// effects nor on the order in which images are made. Shot noise: n ~ Normal(e, e) electrons for e expected ones
/// (Poisson's variance; its skewness, 1/sqrt(e), is left out). Read noise: Normal(0, read_noise_electrons^2). Values
/// are clipped to 0 and full scale, at the end only.
/// @param shutter_samples in the number and order of shutter_samples_before(), all of one size, kRgb8
/// @param now simulated time of the step, at which the last row's shutter closes (stamp_late_s earlier, with a late
/// stamp)
/// @throws std::invalid_argument for others
[[nodiscard]] Image develop(const CameraEffects& effects,
                            const std::vector<std::shared_ptr<const Image>>& shutter_samples, std::uint64_t seed,
                            std::string_view camera, std::uint64_t step, std::chrono::nanoseconds now);

/// Passes an image through every stage of develop() that has a neutral value, each at that value; compression has none.
/// The bytes stay equal, which shows that leaving the stages out changes nothing. @param image kRgb8
[[nodiscard]] Image pass_through(const Image& image);

/// Returns whether the camera loses (delivers late) its frame of this step; each is drawn from a generator of its own.
[[nodiscard]] bool drops(const CameraEffects& effects, std::uint64_t seed, std::string_view camera, std::uint64_t step);
[[nodiscard]] bool is_late(const CameraEffects& effects, std::uint64_t seed, std::string_view camera,
                           std::uint64_t step);

}  // namespace twocone::sim_povray
