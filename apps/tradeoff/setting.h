// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/estimator.h"

namespace twocone::tradeoff {

/// Effects of the simulated world.
enum class Effects {
  kScene,  ///< the effects of scene, map and robot file
  kFlat,   ///< the same without shadows, area lights, photons, radiosity and media
  kNoise,  ///< as kScene, with the noise of a sensor added (kNoiseElectrons) where the robot file has none
};

/// Full well of Effects::kNoise: noise of about two grey levels of 255 in the brightest pixel.
constexpr double kNoiseElectrons = 5000;

/// The estimator that makes an answer from images.
enum class Level {
  kPaper,     ///< method paper
  kFound,     ///< method outline, landmarks located to a pixel or two (vision::Stage::kFound)
  kCoarse,    ///< method outline, outlines fitted coarsely (kCoarse)
  kFine,      ///< method outline, fitted with all information of the pixels (kFine): the default of `run`
  kAdaptive,  ///< method outline, refined as far as the stated sigma requires, down to Setting::enough_m
};

/// One set of images. All images of one sweep are taken at the same poses, beginning with the first one.
struct Images {
  int width_px = 0, height_px = 0;
  int antialias = 1;  ///< rays per pixel side
  Effects effects = Effects::kScene;

  friend auto operator<=>(const Images&,
                          const Images&) = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 misreads it
};

/// One configuration of a robot's vision and localisation.
struct Setting {
  Images images{};
  Level level = Level::kFine;
  double enough_m = 0;   ///< for kAdaptive: config::EstimatorKeys::enough_m; else 0
  int landmarks = 0;     ///< number searched for, >= 3: the first ones of Plan::landmarks
  bool bearings = true;  ///< false: fixes from ranges only
  double rate_hz = 0;    ///< rate of the frames that are used
  int frames = 1;        ///< 1: fixes of single frames; more: the filter's estimate after this number of frames

  /// Returns whether fixes use bearings; those of method paper never do.
  [[nodiscard]] bool uses_bearings() const { return bearings && level != Level::kPaper; }

  friend auto operator<=>(const Setting&,
                          const Setting&) = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 misreads it
};

/// The properties in which settings differ, one at a time.
enum class Axis { kSize, kAntialias, kEffects, kLevel, kLandmarks, kBearings, kRate, kFrames };
inline constexpr std::array kAllAxes{Axis::kSize,      Axis::kAntialias, Axis::kEffects, Axis::kLevel,
                                     Axis::kLandmarks, Axis::kBearings,  Axis::kRate,    Axis::kFrames};
/// The place of a setting on an axis. Places sort as conclusions.h states (levels: by Level, then by enough_m). The
/// first number is the size, for an axis that has one (pixels of an image, landmarks, frames, ...).
using AxisPlace = std::pair<double, double>;
struct AxisFacts {
  std::string_view name;   ///< as in tables and files: size, antialias, effects, estimator, ...
  std::string_view title;  ///< in a sentence
  bool costs_rendering;    ///< its cost is the simulation time, otherwise the robot time
  bool is_sized;           ///< larger values are "beyond" a smaller one
  /// Returns the setting's value on the axis, in words: "640x480", "+R2" ("none" for 1), "scene", "outline, fine", "6",
  /// "ranges and bearings", "15 Hz", "4".
  std::string (*value)(const Setting& setting);
  AxisPlace (*place)(const Setting& setting);
};
const AxisFacts& facts_of(Axis axis);
/// scene, flat, noise.
std::string_view name(Effects effects);
/// paper, found, coarse, fine, adaptive.
std::string_view name(Level level);
/// Returns all values in one line: "640x480, +R2, scene, outline fine, 6 landmarks, ranges and bearings, 15 Hz, 4
/// frames".
std::string describe(const Setting& setting);

/// Returns the robot with the setting's values: sizes of images and with them the rig's pixels, anti-aliasing, rate,
/// noise, `estimator:`. Pixel numbers are scaled like the images: (c + 0.5) k - 0.5. @param landmarks Plan::landmarks
config::Robot robot_of(const Setting& setting, const config::Robot& robot, std::span<const std::string> landmarks);
/// Returns the map with the setting's effects: Effects::kFlat switches its effects off.
config::Map map_of(const Setting& setting, const config::Map& map);
/// Returns the method of a level.
estimation::Method method_of(Level level);

}  // namespace twocone::tradeoff
