// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/pigment_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "drivers/sim_povray/render/native/noise.h"
#include "drivers/sim_povray/render/native/shuffled_integers.h"

namespace twocone::sim_povray {
namespace {

// Every cell of a checker, brick or cells begins this much below its plane: measured, the same at all planes. Therefore
// a wall that lies in the plane shows the cell above it, even if rounding moved the wall a little.
constexpr double kEdgeTolerance = 1e-10;

// A wave repeats after this number instead of 1, but a value of just 1 stays: measured.
constexpr double kWavePeriod = 1.00001;

// Nearer than this to the y axis in x and z, a radial has a fixed value: measured.
constexpr double kRadialTolerance = 1e-3;

double square(double value) { return value * value; }

// ------------------------------------------------------------------------------------------------------------- cells

/// Returns the numbers from 0 to 1 that cells choose among. The measured values are those of this generator with its
/// default seed, in its order.
std::vector<double> cell_numbers() {
  std::vector<double> numbers(kShuffledCount);
  std::mt19937 random;
  for (double& number : numbers) number = static_cast<double>(random()) / 4294967296.0;
  return numbers;
}

std::size_t cell_index(double at) {
  return static_cast<std::size_t>(static_cast<std::int64_t>(std::floor(at + kEdgeTolerance))) % kShuffledCount;
}

double cells(const Vec3& p) {
  static const std::vector<double> numbers = cell_numbers();
  const std::size_t row = kShuffled[kShuffled[cell_index(p.x)] ^ cell_index(p.y)];
  return numbers[kShuffled[row ^ cell_index(p.z)]];
}

// ---------------------------------------------------------------------------------------------------- other patterns

double checker(const Vec3& p) {
  const double sum =
      std::floor(p.x + kEdgeTolerance) + std::floor(p.y + kEdgeTolerance) + std::floor(p.z + kEdgeTolerance);
  return std::fmod(sum, 2) == 0 ? 0 : 1;
}

/// Returns 0 in the mortar, which takes the upper end of every brick's cell, and 1 in the brick.
double brick(const Vec3& point, const Vec3& size, double mortar) {
  const Vec3 p = point + Vec3{kEdgeTolerance, kEdgeTolerance, kEdgeTolerance};
  const auto is_mortar = [mortar](double at, double length) {
    return at - std::floor(at / length) * length >= length - mortar;
  };
  if (is_mortar(p.y, size.y)) return 0;
  // Every other course is shifted by half a brick: the even ones along z, the odd ones along x.
  const bool is_odd = std::fmod(std::floor(p.y / size.y), 2) != 0;
  const double x = p.x + (is_odd ? size.x / 2 : 0);
  const double z = p.z + (is_odd ? 0 : size.z / 2);
  return is_mortar(x, size.x) || is_mortar(z, size.z) ? 0 : 1;
}

double gradient(const Vec3& p, const Vec3& axis) {
  const double along = dot(p, axis) / length(axis);
  return along > 1 ? std::fmod(along, 1) : along;
}

double boxed(const Vec3& p) { return std::max(0.0, 1 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)})); }

double radial(const Vec3& p) {
  if (std::abs(p.x) < kRadialTolerance && std::abs(p.z) < kRadialTolerance) return 0.25;
  return 0.25 + (std::atan2(p.x, p.z) + std::numbers::pi) / (2 * std::numbers::pi);
}

double wood(Vec3 p, const std::optional<Turbulence>& given) {
  if (given && given->amount != Vec3{}) {
    // Measured: the rings do not wander with the turbulence itself but with the sine of this sum.
    const Vec3 moved = (turbulence(p, *given) + p) * given->amount;
    p.x += std::sin(2 * std::numbers::pi * moved.x);
    p.y += std::sin(2 * std::numbers::pi * moved.y);
  }
  return std::sqrt(square(p.x) + square(p.y));
}

// -------------------------------------------------------------------------------------------------------- the pattern

Vec3 repeated(Vec3 p, const RepeatWarp& warp) {
  const std::array<double*, 3> components{&p.x, &p.y, &p.z};
  const std::array<double, 3> offset{warp.offset.x, warp.offset.y, warp.offset.z};
  const std::array<double, 3> flip{warp.flip.x, warp.flip.y, warp.flip.z};
  double& along = *components[std::size_t(warp.axis)];
  const double tile = std::floor(along / warp.width);
  along -= tile * warp.width;
  const bool is_odd = std::fmod(tile, 2) != 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (is_odd && flip[i] != 0) *components[i] = (int(i) == warp.axis ? warp.width : 0) - *components[i];
    *components[i] += tile * offset[i];
  }
  return p;
}

Vec3 displaced(const Vec3& p, const Turbulence& given) {
  return given.amount == Vec3{} ? p : p + turbulence(p, given) * given.amount;
}

/// Returns the point in the pattern's own coordinates.
Vec3 pattern_point(const Pigment& pigment, Vec3 p) {
  for (auto step = pigment.steps.rbegin(); step != pigment.steps.rend(); ++step) {
    if (const auto* transform = std::get_if<Transform>(&*step)) {
      p = transform->inverse_point(p);
    } else if (const auto* repeat = std::get_if<RepeatWarp>(&*step)) {
      p = repeated(p, *repeat);
    } else if (const auto* moving = std::get_if<Turbulence>(&*step)) {
      p = displaced(p, *moving);
    }
  }
  // The keyword acts next to the pattern wherever it stands in the text: measured.
  return pigment.turbulence && pigment.pattern != Pattern::kWood ? displaced(p, *pigment.turbulence) : p;
}

double raw_value(const Pigment& pigment, const Vec3& p) {
  switch (pigment.pattern) {
    case Pattern::kChecker:
      return checker(p);
    case Pattern::kBrick:
      return brick(p, pigment.brick_size, pigment.mortar);
    case Pattern::kCells:
      return cells(p);
    case Pattern::kGradient:
      return gradient(p, pigment.axis);
    case Pattern::kBoxed:
      return boxed(p);
    case Pattern::kRadial:
      return radial(p);
    case Pattern::kWood:
      return wood(p, pigment.turbulence);
    case Pattern::kBozo:
      return noise(p);
    case Pattern::kColour:
      break;
  }
  return 0;
}

/// Returns the value after frequency, phase and wave.
double waved(const Pigment& pigment, double value) {
  if (pigment.frequency != 0) {  // a frequency of 0 leaves the phase out too: measured
    value = value * pigment.frequency + pigment.phase;
    if (value < 0 || value > 1) value = std::fmod(value, kWavePeriod);
  }
  if (value < 0) value -= std::floor(value);
  switch (pigment.wave.value_or(pigment.pattern == Pattern::kWood ? Wave::kTriangle : Wave::kRamp)) {
    case Wave::kRamp:
      break;
    case Wave::kTriangle:
      if (value > 1) value -= std::floor(value);
      return value > 0.5 ? 2 * (1 - value) : 2 * value;
    case Wave::kSine:
      return 0.5 * (1 + std::sin(2 * std::numbers::pi * value));
    case Wave::kScallop:
      return std::abs(std::sin(std::numbers::pi * value));
    case Wave::kCubic:
      return value * value * (3 - 2 * value);
    case Wave::kPoly:
      return std::pow(value, pigment.poly_exponent);
  }
  return value;
}

// --------------------------------------------------------------------------------------------------------------- maps

const std::vector<PigmentEntry>& default_map(Pattern pattern) {
  static const std::vector<PigmentEntry> grey{{0, {0, 0, 0}, nullptr}, {1, {1, 1, 1}, nullptr}};
  static const std::vector<PigmentEntry> wood{{0.6, {0.666, 0.312, 0.2}, nullptr},
                                              {0.6, {0.4, 0.1333, 0.066}, nullptr}};
  static const std::vector<PigmentEntry> bozo{{0.4, {1, 1, 1}, nullptr}, {0.4, {0, 1, 0}, nullptr},
                                              {0.6, {0, 1, 0}, nullptr}, {0.6, {0, 0, 1}, nullptr},
                                              {0.8, {0, 0, 1}, nullptr}, {0.8, {1, 0, 0}, nullptr}};
  static const std::vector<PigmentEntry> radial{
      {0, {0, 1, 1}, nullptr}, {0.333, {1, 1, 0}, nullptr}, {0.666, {1, 0, 1}, nullptr}, {1, {0, 1, 1}, nullptr}};
  switch (pattern) {
    case Pattern::kWood:
      return wood;
    case Pattern::kBozo:
      return bozo;
    case Pattern::kRadial:
      return radial;
    default:
      return grey;
  }
}

Colour entry_colour(const PigmentEntry& entry, const Vec3& p) {
  return entry.pigment ? pigment_colour(*entry.pigment, p) : entry.colour;
}

/// Looks up a map. Its entries need not be in order; below the first and above the last, the colour is constant.
Colour map_colour(const std::vector<PigmentEntry>& map, double value, const Vec3& p) {
  if (value >= map.back().at) return entry_colour(map.back(), p);
  // The last entry ends the search.
  const auto above = std::find_if(map.begin(), map.end(), [value](const PigmentEntry& e) { return e.at > value; });
  if (above == map.begin()) return entry_colour(*above, p);
  const PigmentEntry& below = *(above - 1);
  const double share = (value - below.at) / (above->at - below.at);
  return entry_colour(below, p) * (1 - share) + entry_colour(*above, p) * share;
}

/// Whether the entries are the two colours of a checker or brick rather than a map.
bool is_list(const Pigment& pigment) {
  return (pigment.pattern == Pattern::kChecker || pigment.pattern == Pattern::kBrick) && pigment.entries.size() == 2 &&
         pigment.entries[0].at == pigment.entries[1].at;
}

}  // namespace

double pattern_value(const Pigment& pigment, const Vec3& point) {
  return waved(pigment, raw_value(pigment, pattern_point(pigment, point)));
}

Colour patterned_colour(const Pigment& pigment, const Vec3& point) {
  const Vec3 p = pattern_point(pigment, point);
  const double raw = raw_value(pigment, p);
  if (is_list(pigment)) return entry_colour(pigment.entries[raw == 0 ? 0 : 1], p);
  const auto& map = pigment.entries.empty() ? default_map(pigment.pattern) : pigment.entries;
  return map_colour(map, waved(pigment, raw), p);
}

}  // namespace twocone::sim_povray
