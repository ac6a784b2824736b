// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/tradeoff/setting.h"
#include "hal/diff_drive.h"
#include "hal/pose.h"

namespace twocone::tradeoff {

/// A short drive from a place of its own: kInstants frames at the robot's rate. Legs are independent of each other.
struct Leg {
  std::uint64_t seed = 0;  ///< of the wheels' slip and the cameras' noise
  Pose2 from;
  WheelSpeeds speeds;  ///< all the way
};
constexpr int kInstants = 4;

/// The frames of a leg that a setting looks at for one answer, the last one first: `frames` of them, at its rate. Of
/// single frames each is an answer of its own, and this is the last.
std::vector<int> instants_of(const Setting& setting, double robot_rate_hz);

/// What a person asks a sweep for.
struct PlanOptions {
  std::uint64_t seed = 1;
  /// Legs of the cheapest pictures, >= 3; dearer ones have fewer (legs_of), never fewer than a third or 3.
  int legs = 28;
  bool fine = false;  ///< more sizes and more anti-aliasing, four times the legs

  friend bool operator==(const PlanOptions&, const PlanOptions&) = default;
};

/// All that is to be done, in the order in which it is reported.
struct Plan {
  PlanOptions options;
  double robot_rate_hz = 0;  ///< of the robot file: that of the legs' frames
  std::vector<Leg> legs;     ///< pictures with fewer have the first ones
  std::vector<Setting> settings;
  /// The map's landmarks in the order in which they are given up last: the first n of them are what a setting with n
  /// landmarks looks for. By backward elimination: the one goes first whose going raises the mean squared position
  /// bound over the legs least.
  std::vector<std::string> landmarks;
  /// Independent pieces of work: pictures of some legs, and all settings that are made of them.
  struct Shard {
    Pictures pictures;
    int first_leg = 0, legs = 0;
  };
  std::vector<Shard> shards;
};

/// A function of its arguments alone. @throws files::FileError for a robot that no simulation inside this program
/// moves, or that finds no room to stand in; for a map with fewer than three landmarks; std::invalid_argument for
/// options outside their domain
Plan make_plan(const files::Robot& robot, const files::Map& map, const PlanOptions& options);

/// The sweep's settings with these pictures on `legs` legs that no sweep uses: for checks of choices. @throws as
/// make_plan
Plan make_check_plan(const files::Robot& robot, const files::Map& map, const Plan& sweep, const Pictures& pictures,
                     int legs);

}  // namespace twocone::tradeoff
