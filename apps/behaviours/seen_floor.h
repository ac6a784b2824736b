// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "vision/beam.h"

namespace twocone::behaviours {

/// Returns the lowest height over the floor that is ranged at a distance from the body's origin; infinite where nothing
/// is ranged.
using LowestSeen = std::function<double(double distance_m)>;

/// What scans have shown of the floor of an arena, in square cells: an occupancy grid (Moravec and Elfes 1985).
///
/// A thing that ends a beam counts for its cell, and all before it against theirs. A beam counts against a thing that
/// two scans have shown only if the floor was ranged there, or, nearer to the robot than that can be, if it would have
/// shown the thing. So a low thing that the mirrors no longer see because the robot has come near stays where it was
/// seen. The edge of a table may be all that both mirrors see of it, with floor under it: it is ranged by some beams,
/// and from near. So beams beside the thing must pass it as well, and from no farther than it was seen from. Likewise,
/// floor is free only if beams have passed it that would have shown a low thing there. Only round the start, where no
/// scan has, each beam counts until the robot has left it: low things must not stand there. What the map lists is never
/// free.
class SeenFloor {
 public:
  static constexpr double kCell_m = 0.05;
  static constexpr double kFarthest_m = 3.5;  ///< beams count up to this distance

  SeenFloor(const Arena& arena, LowestSeen lowest_seen_m);

  /// Adds a scan. @param at the body's pose at its time, world frame
  /// @returns places of things that were free some scans ago: of what moves, or was not ranged until now
  std::vector<Eigen::Vector2d> add(const localisation::Pose& at, const std::vector<vision::Beam>& scan);
  /// The robot stands there, so that nothing else does.
  void stand_on(const Eigen::Vector2d& place_m, double radius_m);

  [[nodiscard]] std::size_t cells() const { return cells_.size(); }
  [[nodiscard]] int columns() const { return columns_; }
  /// Returns the cell of a place; that of the nearest place of the arena for one outside.
  [[nodiscard]] std::size_t cell_of(const Eigen::Vector2d& place_m) const;
  [[nodiscard]] Eigen::Vector2d middle_m(std::size_t cell) const;
  /// Returns whether the cell was seen to be free, and the map lists nothing there.
  [[nodiscard]] bool is_free(std::size_t cell) const {
    const Cell& at = cells_[cell];
    return !at.is_listed && at.evidence < kFree && (at.is_well_seen || is_at_start_);
  }
  /// Returns whether a low thing would have been seen there: everywhere on free floor but round the start.
  [[nodiscard]] bool is_well_seen(std::size_t cell) const { return cells_[cell].is_well_seen; }
  /// Returns whether something that two scans had shown has gone from there: more may come.
  [[nodiscard]] bool is_busy(std::size_t cell) const { return cells_[cell].busy_by != 0; }
  /// Returns whether that was in one of the latest scans.
  [[nodiscard]] bool was_busy_within(std::size_t cell, std::uint64_t scans) const {
    return is_busy(cell) && cells_[cell].busy_by + scans > scans_;
  }
  /// Returns 1 for each cell at whose middle a disc of this radius lies on free cells alone.
  [[nodiscard]] std::vector<std::uint8_t> room_for(double radius_m) const;
  /// Returns the number of cells within the disc that are not free.
  [[nodiscard]] int not_free_within(const Eigen::Vector2d& place_m, double radius_m) const;
  /// Calls `use(cell)` for each cell whose middle lies within the disc.
  template <typename Use>
  void within(const Eigen::Vector2d& place_m, double radius_m, Use&& use) const;

 private:
  static constexpr float kFree = -0.7F;
  static constexpr double kLow_m = 0.05;  // lower things than this are no obstacles
  struct Cell {
    bool is_listed = false;  ///< the map has something there
    bool is_well_seen = false;
    bool has_come = false;      ///< it was free before
    bool is_confirmed = false;  ///< two scans have shown what is there
    float evidence = 0;         ///< > 0: occupied, < kFree: free; 0 at the begin: unknown
    double top_m = 0;           ///< greatest height that was ranged of what is there
    double from_m = 0;          ///< greatest distance from which it was ranged
    std::uint64_t hit_by = 0;   ///< the number of the latest scan with a thing there
    std::uint64_t since = 0;    ///< that of the scan from which on something is there
    std::uint64_t busy_by = 0;  ///< that of the latest scan by which something had gone from there; 0: none
  };
  /// Returns whether a thing of that height at that distance is ranged.
  [[nodiscard]] bool shows(double distance_m, double top_m) const;
  /// A beam that ends at a thing.
  struct End {
    std::size_t beam;
    Eigen::Vector2d place_m;
  };
  /// Returns the ends of beams that show their thing well enough to be believed.
  [[nodiscard]] std::vector<End> ends_of(const localisation::Pose& at, const std::vector<vision::Beam>& scan) const;
  /// Returns whether something is listed, or was seen some scans ago, at the place or beside it.
  [[nodiscard]] bool is_known_thing(const Eigen::Vector2d& place_m) const;
  void count_hits(const std::vector<End>& ends, const std::vector<vision::Beam>& scan);
  void count_free(const localisation::Pose& at, const std::vector<vision::Beam>& scan);

  Eigen::Vector2d min_m_;
  int columns_, rows_;
  LowestSeen lowest_seen_m_;
  std::vector<Cell> cells_;
  std::uint64_t scans_ = 0;
  std::optional<Eigen::Vector2d> start_m_;  ///< where the first scan was taken
  bool is_at_start_ = true;                 ///< so near to it that low things there were not seen
};

template <typename Use>
void SeenFloor::within(const Eigen::Vector2d& place_m, double radius_m, Use&& use) const {
  const Eigen::Vector2d reach_m = Eigen::Vector2d::Constant(radius_m);
  const std::size_t first = cell_of(place_m - reach_m);
  const std::size_t last = cell_of(place_m + reach_m);
  const auto columns = std::size_t(columns_);
  for (std::size_t row = first / columns; row <= last / columns; ++row) {
    for (std::size_t column = first % columns; column <= last % columns; ++column) {
      const std::size_t cell = row * columns + column;
      if ((middle_m(cell) - place_m).squaredNorm() <= radius_m * radius_m) use(cell);
    }
  }
}

}  // namespace twocone::behaviours
