// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "vision/ranging.h"

namespace twocone::vision {

/// The width of one landmark where nothing hides a part of it, from sightings of which some show a part only.
///
/// What hides a part makes a landmark narrower, never wider. So the unhidden width is the greatest on which many
/// sightings agree, within kSame of it. A part that is hidden also shifts the bearing, by half of it; so such a
/// sighting is better left out.
class UnhiddenWidth {
 public:
  /// Two widths within this share of them agree.
  static constexpr double kSame = 0.04;
  /// A width that is less than the unhidden one by this share of it is that of a part: narrow_count().
  static constexpr double kMuch = 0.12;

  /// Counts a sighting's width. @param radius_m > 0, by which its OutlineWidth::expected_px was made
  void add(const OutlineWidth& width, double radius_m);
  /// Returns the radius that the unhidden width shows; 0 before the first add().
  [[nodiscard]] double radius_m() const;
  /// Returns whether that sighting is too narrow to show the whole landmark; false before the first add().
  [[nodiscard]] bool is_hidden(const OutlineWidth& width, double radius_m) const;
  /// Returns the number of widths that were counted.
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Returns how many of them are narrower than the unhidden one by kMuch of it, and by more than blur explains.
  [[nodiscard]] std::size_t narrow_count() const;

 private:
  struct Bin {
    std::size_t count = 0;
    double sum_px = 0;  ///< of the widths
  };
  struct Common {
    double radius_m = 0;
    double widened = 0;  ///< share of the radius that blur may have added
  };
  /// Returns what the unhidden width shows. It is computed once after the last add().
  [[nodiscard]] const Common& common() const;
  [[nodiscard]] Common find_common() const;

  std::size_t count_ = 0;
  std::map<int, Bin> bins_;  ///< by the logarithm of the radius that a width shows, over kStep
  mutable std::optional<Common> common_;
};

}  // namespace twocone::vision
