// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/runs/estimator.h"

namespace twocone::tradeoff {

/// What the simulated world does.
enum class Effects {
  kScene,  ///< what scene, map and robot file call for
  kFlat,   ///< the same without shadows, area lights, photons, radiosity and media
  kNoise,  ///< as kScene, with a sensor's noise on top (kNoiseElectrons) where the robot file has none
};

/// Full well of Effects::kNoise: noise of about two grey levels of 255 in the brightest pixel.
constexpr double kNoiseElectrons = 5000;

/// How pictures become an answer.
enum class Level {
  kPaper,     ///< method paper
  kFound,     ///< method full, landmarks found to a pixel or two (vision::Stage::kFound)
  kCoarse,    ///< ... their outlines fitted coarsely (kCoarse)
  kFine,      ///< ... fitted with all that the pixels tell (kFine): what `run` does if not told otherwise
  kAdaptive,  ///< ... as far as the stated sigma calls for, down to Setting::enough_m
};

/// One set of pictures. All of one sweep are taken at the same poses, from the first on.
struct Pictures {
  int width_px = 0, height_px = 0;
  int antialias = 1;  ///< rays per pixel side
  Effects effects = Effects::kScene;

  friend auto operator<=>(const Pictures&,
                          const Pictures&) = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 misreads it
};

/// One way to have a robot see and locate itself.
struct Setting {
  Pictures pictures;
  Level level = Level::kFine;
  double enough_m = 0;   ///< of kAdaptive: files::EstimatorKeys::enough_m; else 0
  int landmarks = 0;     ///< how many are looked for, >= 3: the first ones of Plan::landmarks
  bool bearings = true;  ///< false: fixes from ranges alone
  double rate_hz = 0;    ///< of the frames that are looked at
  int frames = 1;        ///< 1: fixes of single frames; more: the filter's estimate after so many frames

  /// Whether fixes take bearings: those of method paper never do.
  [[nodiscard]] bool uses_bearings() const { return bearings && level != Level::kPaper; }

  friend auto operator<=>(const Setting&,
                          const Setting&) = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 misreads it
};

/// What a setting can differ in, one at a time.
enum class Axis { kSize, kAntialias, kEffects, kLevel, kLandmarks, kBearings, kRate, kFrames };
std::span<const Axis> all_axes();
/// As tables and files call it: size, antialias, effects, estimator, landmarks, bearings, rate, frames.
std::string_view name(Axis axis);
/// scene, flat, noise.
std::string_view name(Effects effects);
/// paper, found, coarse, fine, adaptive.
std::string_view name(Level level);
/// The setting's place on an axis, in words: "640x480", "+R2" ("none" for 1), "scene", "full, fine", "6", "ranges and
/// bearings", "15 Hz", "4".
std::string value(const Setting& setting, Axis axis);
/// All of it in one line: "640x480, +R2, scene, full fine, 6 landmarks, ranges and bearings, 15 Hz, 4 frames".
std::string describe(const Setting& setting);

/// The robot as the setting has it: sizes of pictures and with them the rig's pixels, anti-aliasing, rate, noise,
/// `estimator:`. Pixel numbers are scaled as pictures are: (c + 0.5) k - 0.5. @param landmarks Plan::landmarks
files::Robot robot_of(const Setting& setting, const files::Robot& robot, std::span<const std::string> landmarks);
/// The map as the setting has it: Effects::kFlat switches its effects off.
files::Map map_of(const Setting& setting, const files::Map& map);
/// The method that a level belongs to.
runs::Method method_of(Level level);

}  // namespace twocone::tradeoff
