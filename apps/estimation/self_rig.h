// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/config/key_change.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "vision/self_rig.h"

/// Connects the finder of rigs (vision/self_rig.h) with robot files: what it needs of them, which of their numbers the
/// images contradict, and what a user must change where it finds nothing.
namespace twocone::estimation {

/// Returns the problem of a robot on a map, without frames.
vision::SelfRigProblem self_rig_problem(const config::Robot& robot, const config::Map& map);

/// A number of `rig:` that the images contradict or the file leaves to them.
struct RigDifference {
  std::string key;      ///< as in `rig:`: lower.centre_px
  std::string in_file;  ///< empty: the file does not state it
  std::string seen;
};

/// The rig as the images show it.
struct SelfRigAnswer {
  config::Rig rig;  ///< that of the file, with the numbers of `differences` replaced, and with their sigmas
  std::vector<RigDifference> differences;
};

/// Differences from the file up to these are left to `calibrate`, whose own measurements are better.
constexpr double kSameCentre_px = 2;
constexpr double kSameRadiusShare = 0.01;
constexpr double kSameAzimuth_rad = 0.035;
constexpr double kSameTilt_rad = 0.009;
constexpr double kSameSigmas = 3;

/// Which numbers of a robot file are replaced by those of the images.
enum class Replace { kContradicted, kAll };

/// Replaces the numbers of the robot file that differ from those found by more than the limits above and kSameSigmas of
/// the finder's sigmas. Sizes, heights, offsets and lenses are kept. Requires found.missing() to be kNothing.
/// With exchanged cameras, `lower` is the lower mirror, which the camera shows that the file calls upper.
/// With Replace::kAll every number that was found is replaced, with its own sigma; tilts only if they differ, because
/// careful assembly is better than these.
SelfRigAnswer compare_with_file(const config::Robot& robot, const vision::SelfRig& found,
                                const vision::SelfRigProblem& problem, Replace which = Replace::kContradicted);

/// Returns the changes of the robot file that make its rig that of the answer; empty without a difference.
std::vector<config::KeyChange> changes_to(const SelfRigAnswer& answer);

/// Returns what was found, in the order in which it was found, one line each, in pixels and degrees.
std::vector<std::string> lines_of(const vision::SelfRig& found);

/// Returns in one sentence why no rig was found and what to change. Requires found.missing() not to be kNothing.
std::string what_to_change(const vision::SelfRig& found);
/// Returns why this camera shows no mirror and what to change. @param camera as in the robot file
std::string what_to_change(vision::MirrorVerdict verdict, const std::string& camera);

}  // namespace twocone::estimation
