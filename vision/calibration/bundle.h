// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vision/calibration/shared.h"

namespace twocone::vision::calibration {

struct SightingRow {
  std::size_t frame;           ///< index into BundleState::poses
  std::size_t landmark_index;  ///< into BundleState::landmarks
  KnownLandmark landmark;
  BodyTwist twist;
  double late_s = 0;
  double readout_share = 0;  ///< of the readout, after the middle row
  Eigen::Vector2d pixel_px;
  Eigen::Matrix2d whitener;  ///< W with W covariance W^T = 1
  /// Sightings that err alike, as indices into BundleState::biases: those of one landmark in one view, those at about
  /// one radius in one view, and those that are both.
  std::array<std::size_t, 3> groups{};
  Side side;
  bool used = true;
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();  ///< columns: outwards from the tip, and across that
};

/// The wheels' way from one frame to the next.
struct WheelRow {
  std::size_t frame;  ///< it leads to; from the one before
  std::vector<Eigen::Vector2d> turns_rad;
  Eigen::Matrix3d whitener;  ///< of (x, y, heading) seen from the frame before, beyond the slips
  bool follows = false;      ///< the interval before this one has a row too, the one before in the list
  double slip_share = 0;     ///< the mean of this interval's slip given the last one's: share * last
  double slip_sigma = 1;     ///< and its standard deviation, both in units of WheelBelief::slip
  BodyTwist from_twist, to_twist;
};

struct RimRow {
  Side side;
  RimMeasurement rim;
};

struct BundleData {
  SharedModel model;
  std::vector<SightingRow> sightings;
  std::vector<WheelRow> wheels;
  std::vector<RimRow> rims;
  std::size_t groups = 0;
};

struct BundleState {
  Shared unknowns = Shared::Zero();
  std::vector<Eigen::Vector3d> poses;      ///< x m, y m, heading rad
  std::vector<Eigen::Vector2d> slips;      ///< left, right of each wheel row, in units of WheelBelief::slip
  std::vector<Eigen::Vector2d> biases;     ///< of each group, px, along its sightings' axes
  std::vector<Eigen::Vector2d> landmarks;  ///< their shifts, in units of SharedModel::landmark_sigma_m
};

struct BundleSettings {
  std::vector<int> held;      ///< shared numbers that stay
  bool hold_all = false;      ///< only the poses move, and the wheels are not asked
  double sighting_scale = 1;  ///< times the stated sigma
  double wheel_scale = 1;
  double systematic_px = 0;             ///< standard deviation of the biases; 0: there are none
  std::optional<double> cauchy_sigmas;  ///< loss of the sightings; none: squares
};

/// Least squares from `state` on; false where there is no answer.
bool minimise(const BundleData& data, const BundleSettings& settings, BundleState& state);

/// Information (inverse covariance) of all shared unknowns at `state`, and behind them x and y of each landmark where
/// the map is not trusted; priors included, poses, slips and biases eliminated. Those of sigma 0 have rows of the prior
/// alone.
Eigen::MatrixXd shared_information(const BundleData& data, const BundleSettings& settings, const BundleState& state);

/// Sum of squares of the wheel rows and the slips' own.
double wheel_chi_squared(const BundleData& data, const BundleState& state);

/// Measured minus predicted, a bias being a part of it.
Eigen::Vector2d residual_px(const BundleData& data, const SightingRow& row, const BundleState& state);

bool has_solver();

}  // namespace twocone::vision::calibration
