// SPDX-License-Identifier: Apache-2.0
#include "apps/behaviours/seen_floor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace twocone::behaviours {
namespace {

// Evidence of one scan, and its limits. Floor is free after three scans that look through it. A thin thing is ranged in
// every fifth scan of a cell, and the floor under it in the others: one scan that shows it must outweigh those.
constexpr float kHit = 1.6F;
constexpr float kMiss = -0.25F;
constexpr float kLeast = -1.5F;
constexpr float kMost = 3;
// Where low things are not ranged, a beam shows a thing only if this much of it is above the lowest height that is:
// ranges are missing, or wrong, beside the limit of what both mirrors show.
constexpr double kShown_m = 0.20;
// A thing is confirmed by another scan that shows one this near to it, within so many scans, from no farther than this.
// Single wrong ranges are usual, and from farther away also what seems to be behind the edge of a low thing.
constexpr double kConfirms_m = 2.1 * SeenFloor::kCell_m;
constexpr std::uint64_t kConfirmsScans = 10;
constexpr double kConfirmsFrom_m = 2;
// A confirmed thing has gone only if so many beams beside it pass as well, from no farther than this share of the
// distance from which it was seen: half of the beams show the edge of a table, 0.045 m high, from 1.5 m, and a fifth of
// them from 2.5 m.
constexpr int kBeside = 2;
constexpr double kFartherShare = 1.1;
// After so many scans, a thing that moves is this far from its place. Nearer to something, nothing has come.
constexpr std::uint64_t kMoveScans = 15;
constexpr double kMoves_m = 3.5 * SeenFloor::kCell_m;
// A beam places something only if others beside it end as far away, one by one with no greater step. From where the
// floor is ranged on, it is one other. Nearer, where things are wide, and of single beams a quarter end too soon, it is
// this many in all: of those, one in a thousand does.
constexpr double kStep_m = 0.06;
constexpr int kLeastRun = 6;
// Ranges with larger sigmas place nothing.
constexpr double kMostSigma_m = 0.15;
// Share of its range by which a beam may end too late.
constexpr double kRangeShare = 0.03;

/// Returns whether the floor was ranged at this distance and before it (vision::Beam::floor): behind the far edge of a
/// low thing it is ranged as well.
bool has_floor_at(std::uint32_t floor, double distance_m) {
  const std::uint32_t here = vision::Beam::floor_bit(distance_m);
  const std::uint32_t both = here | here >> 1;
  return here != 0 && (floor & both) == both;
}

/// Returns the distance up to which a beam shows that nothing is there; 0: it says nothing.
double free_up_to_m(const vision::Beam& beam) {
  if (beam.state == vision::BeamState::kUnknown) return 0;
  return std::min(beam.range_m * (1 - kRangeShare) - std::max(SeenFloor::kCell_m, 2 * beam.sigma_m),
                  SeenFloor::kFarthest_m);
}

/// Returns the number of beams beside each other, this one among them, that end at one thing, and no more than `most`.
int agreeing_beams(const std::vector<vision::Beam>& scan, std::size_t k, int most) {
  int agreeing = 1;
  for (const std::size_t step : {std::size_t{1}, scan.size() - 1}) {
    for (std::size_t at = k; agreeing < most;) {
      const std::size_t next = (at + step) % scan.size();
      if (scan[next].state != vision::BeamState::kOccupied) break;
      if (std::abs(scan[next].range_m - scan[at].range_m) > kStep_m) break;
      ++agreeing;
      at = next;
    }
  }
  return agreeing;
}

}  // namespace

SeenFloor::SeenFloor(const Arena& arena, LowestSeen lowest_seen_m)
    : min_m_(arena.min_m),
      columns_(std::max(1, static_cast<int>(std::ceil((arena.max_m - arena.min_m).x() / kCell_m)))),
      rows_(std::max(1, static_cast<int>(std::ceil((arena.max_m - arena.min_m).y() / kCell_m)))),
      lowest_seen_m_(std::move(lowest_seen_m)),
      cells_(std::size_t(columns_) * std::size_t(rows_)) {
  for (std::size_t cell = 0; cell < cells(); ++cell) cells_[cell].is_listed = arena.clearance_m(middle_m(cell)) < 0;
}

std::size_t SeenFloor::cell_of(const Eigen::Vector2d& place_m) const {
  const Eigen::Vector2d at = (place_m - min_m_) / kCell_m;
  const int column = std::clamp(static_cast<int>(std::floor(at.x())), 0, columns_ - 1);
  const int row = std::clamp(static_cast<int>(std::floor(at.y())), 0, rows_ - 1);
  return std::size_t(row) * std::size_t(columns_) + std::size_t(column);
}

Eigen::Vector2d SeenFloor::middle_m(std::size_t cell) const {
  const std::size_t column = cell % std::size_t(columns_);
  const std::size_t row = cell / std::size_t(columns_);
  return min_m_ + kCell_m * Eigen::Vector2d(double(column) + 0.5, double(row) + 0.5);
}

std::vector<Eigen::Vector2d> SeenFloor::add(const localisation::Pose& at, const std::vector<vision::Beam>& scan) {
  if (scan.empty()) return {};
  ++scans_;
  const Eigen::Vector2d here_m(at.x_m, at.y_m);
  if (!start_m_) start_m_ = here_m;
  if (shows((here_m - *start_m_).norm(), kLow_m)) is_at_start_ = false;
  const std::vector<End> ends = ends_of(at, scan);
  std::vector<Eigen::Vector2d> new_m;
  for (const End& end : ends) {
    const Cell& cell = cells_[cell_of(end.place_m)];
    if ((cell.evidence < kFree || cell.has_come) && !is_known_thing(end.place_m)) new_m.push_back(end.place_m);
  }
  count_hits(ends, scan);
  count_free(at, scan);
  return new_m;
}

bool SeenFloor::shows(double distance_m, double top_m) const {
  const double lowest_m = lowest_seen_m_(distance_m);
  return lowest_m <= kLow_m || lowest_m <= top_m - kShown_m;
}

std::vector<SeenFloor::End> SeenFloor::ends_of(const localisation::Pose& at,
                                               const std::vector<vision::Beam>& scan) const {
  std::vector<End> ends;
  for (std::size_t k = 0; k < scan.size(); ++k) {
    const vision::Beam& beam = scan[k];
    if (beam.state != vision::BeamState::kOccupied) continue;
    if (agreeing_beams(scan, k, kLeastRun) < (shows(beam.range_m, kLow_m) ? 2 : kLeastRun)) continue;
    const double course_rad = at.heading_rad + vision::beam_bearing_rad(k, scan.size());
    ends.push_back({k, Eigen::Vector2d(at.x_m, at.y_m) +
                           beam.range_m * Eigen::Vector2d(std::cos(course_rad), std::sin(course_rad))});
  }
  return ends;
}

void SeenFloor::count_hits(const std::vector<End>& ends, const std::vector<vision::Beam>& scan) {
  for (const auto& [k, place_m] : ends) {
    const vision::Beam& beam = scan[k];
    if (beam.range_m > kFarthest_m || beam.sigma_m > kMostSigma_m) continue;
    const std::size_t at = cell_of(place_m);
    if ((middle_m(at) - place_m).cwiseAbs().maxCoeff() > kCell_m) continue;  // outside the arena
    Cell& cell = cells_[at];
    const bool is_new = cell.evidence <= 0;
    if (is_new) {
      cell.is_confirmed = false;
      cell.has_come = cell.evidence < kFree;
      cell.top_m = beam.top_m;
      cell.from_m = beam.range_m;
    }
    cell.top_m = std::max(cell.top_m, beam.top_m);
    cell.from_m = std::max(cell.from_m, beam.range_m);
    if (beam.range_m <= kConfirmsFrom_m) {
      within(place_m, kConfirms_m, [&](std::size_t near) {
        const std::uint64_t hit_by = cells_[near].hit_by;
        if (hit_by == 0 || hit_by == scans_ || hit_by + kConfirmsScans < scans_) return;
        cell.is_confirmed = cells_[near].is_confirmed = true;
      });
    }
    const std::uint64_t before = std::exchange(cell.hit_by, scans_);
    if (before == scans_) continue;
    // What comes again has not stood there all the time.
    if (is_new || (cell.has_come && before + kMoveScans < scans_)) cell.since = scans_;
    cell.evidence = std::min(cell.evidence + kHit, kMost);
  }
}

void SeenFloor::count_free(const localisation::Pose& at, const std::vector<vision::Beam>& scan) {
  const auto beams = static_cast<int>(scan.size());
  const double per_beam_rad = 2 * std::numbers::pi / beams;
  std::vector<double> free_m(scan.size());
  std::ranges::transform(scan, free_m.begin(), free_up_to_m);
  const Eigen::Vector2d here_m(at.x_m, at.y_m);
  within(here_m, kFarthest_m, [&](std::size_t index) {
    Cell& cell = cells_[index];
    if (cell.hit_by == scans_) return;
    const Eigen::Vector2d there_m = localisation::in_body(at, middle_m(index));
    const double distance_m = there_m.norm();
    const bool was_there = cell.evidence > 0 && cell.is_confirmed;
    if (was_there && distance_m > kFartherShare * cell.from_m) return;
    // All beams that cross the cell must pass it.
    const double half_rad = std::atan2(kCell_m / 2, distance_m);
    const double from = (std::atan2(there_m.y(), there_m.x()) - half_rad + std::numbers::pi) / per_beam_rad;
    const double to = from + 2 * half_rad / per_beam_rad;
    const int beside = was_there ? kBeside : 0;
    std::uint32_t floor = 0;
    for (int k = static_cast<int>(std::floor(from)) - beside; k <= static_cast<int>(std::floor(to)) + beside; ++k) {
      const auto beam = std::size_t((k % beams + beams) % beams);
      if (free_m[beam] < distance_m) return;
      floor |= scan[beam].floor;
    }
    const bool shows_low = shows(distance_m, kLow_m);
    if (was_there && !(shows_low ? has_floor_at(floor, distance_m) : shows(distance_m, cell.top_m))) return;
    if (cell.evidence <= 0) {
      if (!shows_low && !is_at_start_ && cell.busy_by == 0) return;
      cell.is_well_seen |= shows_low;
    }
    cell.evidence = std::min(cell.evidence, std::max(cell.evidence + kMiss, kLeast));
    // A thing that moved away stood on floor.
    if (was_there && cell.evidence <= 0) {
      cell.busy_by = scans_;
      cell.is_well_seen = true;
    }
  });
}

void SeenFloor::stand_on(const Eigen::Vector2d& place_m, double radius_m) {
  within(place_m, radius_m, [&](std::size_t cell) {
    cells_[cell].evidence = kLeast;
    cells_[cell].is_well_seen = true;
  });
}

bool SeenFloor::is_known_thing(const Eigen::Vector2d& place_m) const {
  bool is_known = false;
  within(place_m, kMoves_m, [&](std::size_t near) {
    const Cell& cell = cells_[near];
    // Where something has come and was not seen of late, it may have gone on.
    const bool is_there = cell.evidence > 0 && (!cell.has_come || cell.hit_by + kMoveScans > scans_);
    is_known |= cell.is_listed || (is_there && cell.since + kMoveScans <= scans_);
  });
  return is_known;
}

std::vector<std::uint8_t> SeenFloor::room_for(double radius_m) const {
  std::vector<std::uint8_t> room(cells());
  for (std::size_t cell = 0; cell < cells(); ++cell) room[cell] = is_free(cell) ? 1 : 0;
  // What is not free takes the room round it. Beyond the arena's border is a wall.
  const auto columns = std::size_t(columns_);
  const auto reach = std::size_t(std::ceil(radius_m / kCell_m));
  for (std::size_t cell = 0; cell < cells(); ++cell) {
    const std::size_t column = cell % columns;
    const std::size_t row = cell / columns;
    if (std::min({column, columns - 1 - column, row, std::size_t(rows_) - 1 - row}) < reach) room[cell] = 0;
    if (is_free(cell)) continue;
    // Cells amid others that are not free take no more room than those.
    const bool is_amid = column > 0 && column + 1 < columns && row > 0 && row + 1 < std::size_t(rows_) &&
                         !is_free(cell - 1) && !is_free(cell + 1) && !is_free(cell - columns) &&
                         !is_free(cell + columns);
    if (!is_amid) within(middle_m(cell), radius_m, [&](std::size_t taken) { room[taken] = 0; });
  }
  return room;
}

int SeenFloor::not_free_within(const Eigen::Vector2d& place_m, double radius_m) const {
  int count = 0;
  within(place_m, radius_m, [&](std::size_t cell) { count += is_free(cell) ? 0 : 1; });
  return count;
}

}  // namespace twocone::behaviours
