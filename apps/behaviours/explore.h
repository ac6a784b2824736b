// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "apps/behaviours/seen_floor.h"

namespace twocone::behaviours {

/// Visits all floor that can be reached, by what the robot sees: it keeps clear of what scans show and of what the map
/// lists, never drives onto floor that no scan has shown to be free, and stops for what comes near.
///
/// It drives to the goal that shows the most new floor per second, forwards or backwards, along the shortest way on the
/// cells of SeenFloor (Dijkstra), and begins again when all floor was visited. It keeps clear of what comes near, and
/// of where that will be if it goes on, also when it is too near to be seen. The floor round the start, which the
/// mirrors do not show, is taken as free as far as beams pass over it: what is low must not stand there. The robot
/// leaves it the short way.
class Explore final : public Behaviour {
 public:
  static constexpr double kMargin_m = 0.08;   ///< beside the body, to what is not free
  static constexpr double kComfort_m = 0.16;  ///< likewise, on easy ways
  static constexpr double kUneasyCost = 4;    ///< of other ways, over one that is easy
  static constexpr double kVisited_m = 0.4;   ///< floor within this distance of the robot's way is visited

  /// @param reaction_s time from an image to the motion that follows from it, >= 0
  Explore(const Body& body, const Arena& arena, LowestSeen lowest_seen_m, double reaction_s);
  Motion decide(const localisation::Pose& believed, double step_s) override;
  void see(const localisation::Pose& at, const std::vector<vision::Beam>& scan) override;

 private:
  struct Ways;
  /// Places of what has come near.
  struct Come {
    std::vector<Eigen::Vector2d> seen_m;      ///< SeenFloor::add
    std::vector<Eigen::Vector2d> expected_m;  ///< in the next scans
  };
  /// Returns where things will be that go on as they did in the latest scans.
  [[nodiscard]] std::vector<Eigen::Vector2d> expected(const std::vector<Eigen::Vector2d>& seen_m) const;
  /// Returns the share of new floor, free and not visited, within kVisited_m, by cell.
  [[nodiscard]] std::vector<float> new_floor() const;
  [[nodiscard]] Ways ways_from(std::size_t here) const;
  /// Returns the time for a way of a length that begins towards a place. What is behind the robot needs no turn.
  [[nodiscard]] double time_s(const localisation::Pose& from, const Eigen::Vector2d& first_m, double way_m) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> nearest_room(const localisation::Pose& from) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> next_place(const localisation::Pose& believed);
  [[nodiscard]] bool is_straight_way(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const;
  [[nodiscard]] bool is_blocked(const localisation::Pose& believed) const;

  Body body_;
  double reaction_s_;
  SeenFloor floor_;
  std::vector<std::uint8_t> room_;        ///< SeenFloor::room_for, less what is near things that have come or gone
  std::vector<std::uint8_t> is_easy_;     ///< has much room, was well seen, and nothing passes there
  std::vector<std::uint8_t> is_visited_;  ///< by cell
  std::deque<Come> come_;                 ///< in the latest scans
  std::optional<std::size_t> goal_;
};

}  // namespace twocone::behaviours
