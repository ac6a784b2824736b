// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "hal/image.h"

/// What a camera makes of the light that reaches it.
namespace twocone::sim_povray {

/// Whether anything has to be done to a picture: without, none of what follows is entered.
[[nodiscard]] bool changes_pixels(const CameraEffects& effects);
/// Whether one picture is made of several, rendered at different times. A late stamp alone does not call for that.
[[nodiscard]] bool takes_time(const CameraEffects& effects);

/// How long before the world's present instant each of a picture's exposures is, oldest first; one exposure, at 0, when
/// the picture takes no time. The last row's shutter closes at the present instant; evenly spread, the exposures sit in
/// the middles of equal parts of readout + exposure. With a late stamp all of them are stamp_late_s older.
[[nodiscard]] std::vector<std::chrono::nanoseconds> exposures_before(const CameraEffects& effects);

/// From the middle of a picture's exposure (of its middle row), as its time stamp has it, to the present instant: what
/// the stamp is early by. It knows nothing of stamp_late_s.
[[nodiscard]] std::chrono::nanoseconds capture_before(const CameraEffects& effects);

/// One picture from its exposures. In linear light, in this order: each row is the mean of the exposures within its own
/// shutter time (at least the nearest to its middle), lens distortion, defocus, vignetting, gain, shot noise, read
/// noise; then sRGB-coded again and rounded. What is not called for is not computed: with no effect the pixels come
/// back as they are.
///
/// Noise is drawn from generators of its own, one per purpose and camera and picture, so that it depends neither on
/// other effects nor on the order in which pictures are made. Shot noise: n ~ Normal(e, e) electrons for e expected
/// ones (Poisson's variance; its skewness, 1/sqrt(e), is left out). Read noise: Normal(0, read_noise_electrons^2).
/// Clipped to 0 and full scale, at the end only.
/// @param exposures as many as exposures_before() tells, in its order, all of one size, kRgb8
/// @throws std::invalid_argument for others
[[nodiscard]] Image develop(const CameraEffects& effects, const std::vector<std::shared_ptr<const Image>>& exposures,
                            std::uint64_t seed, std::string_view camera, std::uint64_t tick);

/// The picture through every stage of develop(), each at its neutral value: equal bytes, which shows that leaving the
/// stages out changes nothing. @param picture kRgb8
[[nodiscard]] Image pass_through(const Image& picture);

/// Whether the camera loses (is late with) its frame of this instant; drawn from a generator of its own for each.
[[nodiscard]] bool drops(const CameraEffects& effects, std::uint64_t seed, std::string_view camera, std::uint64_t tick);
[[nodiscard]] bool is_late(const CameraEffects& effects, std::uint64_t seed, std::string_view camera,
                           std::uint64_t tick);

}  // namespace twocone::sim_povray
