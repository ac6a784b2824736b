// SPDX-License-Identifier: Apache-2.0
// This is the only file that uses Ceres. The wheels link the poses in a chain, so the poses are not an independent set
// for a Schur solver. Instead, a sparse Cholesky factor with a fill-reducing order eliminates them before the shared
// numbers.
#include <ceres/ceres.h>

#include <algorithm>

#include <Eigen/Sparse>

#include "vision/calibration/bundle.h"
#include "vision/calibration/bundle_rows.h"

namespace twocone::vision::calibration {
namespace {

constexpr int kSolverIterations = 100;

template <typename T>
void whiten(const Eigen::Matrix2d& whitener, const T* error, T* residual) {
  for (int i = 0; i < 2; ++i) residual[i] = whitener(i, 0) * error[0] + whitener(i, 1) * error[1];
}

/// Adds a cost of `residuals` numbers by unknowns of these `sizes`, with derivatives by automatic differentiation.
template <int residuals, int... sizes, typename Cost, typename... Blocks>
void add(ceres::Problem& problem, const Cost& cost, ceres::LossFunction* loss, Blocks*... blocks) {
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Cost, residuals, sizes...>(new Cost(cost)), loss, blocks...);
}

bool has_biases(const BundleSettings& settings) { return settings.systematic_px > 0 && !settings.hold_all; }

/// Adds the priors of the biases, px.
void add_biases(BundleState& state, double sigma_px, ceres::Problem& problem) {
  const auto cost = [sigma_px]<typename T>(const T* bias, T* residual) {
    for (int i = 0; i < 2; ++i) residual[i] = bias[i] / T(sigma_px);
    return true;
  };
  for (Eigen::Vector2d& bias : state.biases) add<2, 2>(problem, cost, nullptr, bias.data());
}

void add_wheels(const BundleData& data, const BundleSettings& settings, BundleState& state, ceres::Problem& problem) {
  for (std::size_t i = 0; i < data.wheels.size(); ++i) {
    const WheelRow& row = data.wheels[i];
    const auto cost = [&model = data.model, &row, scale = settings.wheel_scale]<typename T>(
                          const T* unknowns, const T* from, const T* to, const T* last_slips, const T* slips,
                          T* residual) {
      wheel_residual(model, row, unknowns, from, to, last_slips, slips, residual);
      for (int k = 0; k < 5; ++k) residual[k] /= T(scale);
      return true;
    };
    const auto first_cost = [cost]<typename T>(const T* unknowns, const T* from, const T* to, const T* slips,
                                               T* residual) {
      const T none[2] = {T(0), T(0)};
      return cost(unknowns, from, to, none, slips, residual);
    };
    double* const from = state.poses[row.frame - 1].data();
    double* const to = state.poses[row.frame].data();
    double* const slips = state.slips[i].data();
    if (row.follows) {
      add<5, kSharedNumbers, 3, 3, 2, 2>(problem, cost, nullptr, state.unknowns.data(), from, to,
                                         state.slips[i - 1].data(), slips);
    } else {
      add<5, kSharedNumbers, 3, 3, 2>(problem, first_cost, nullptr, state.unknowns.data(), from, to, slips);
    }
  }
}

void add_sightings(const BundleData& data, const BundleSettings& settings, BundleState& state,
                   ceres::Problem& problem) {
  for (const SightingRow& row : data.sightings) {
    if (!row.used) continue;
    const Eigen::Matrix2d whitener = row.whitener / settings.sighting_scale;
    const auto cost = [&model = data.model, &row, whitener]<typename T>(const T* unknowns, const T* pose,
                                                                        const T* shift, T* residual) {
      T error[2];
      sighting_residual(model, row, unknowns, pose, shift, error);
      whiten(whitener, error, residual);
      return true;
    };
    const auto biased_cost = [&model = data.model, &row, whitener]<typename T>(
                                 const T* unknowns, const T* pose, const T* shift, const T* of_landmark,
                                 const T* of_ring, const T* of_both, T* residual) {
      T error[2];
      sighting_residual(model, row, unknowns, pose, shift, error);
      const T bias[2] = {of_landmark[0] + of_ring[0] + of_both[0], of_landmark[1] + of_ring[1] + of_both[1]};
      for (int i = 0; i < 2; ++i) error[i] -= row.axes(i, 0) * bias[0] + row.axes(i, 1) * bias[1];
      whiten(whitener, error, residual);
      return true;
    };
    ceres::LossFunction* const loss = settings.cauchy_sigmas ? new ceres::CauchyLoss(*settings.cauchy_sigmas) : nullptr;
    double* const pose = state.poses[row.frame].data();
    double* const shift = state.landmarks[row.landmark_index].data();
    if (has_biases(settings)) {
      add<2, kSharedNumbers, 3, kLandmarkNumbers, 2, 2, 2>(
          problem, biased_cost, loss, state.unknowns.data(), pose, shift, state.biases[row.groups[0]].data(),
          state.biases[row.groups[1]].data(), state.biases[row.groups[2]].data());
    } else {
      add<2, kSharedNumbers, 3, kLandmarkNumbers>(problem, cost, loss, state.unknowns.data(), pose, shift);
    }
  }
}

void add_rims(const BundleData& data, BundleState& state, ceres::Problem& problem) {
  for (const RimRow& row : data.rims) {
    const auto cost = [&model = data.model, &row]<typename T>(const T* unknowns, T* residual) {
      const Numbers<T> numbers = numbers_of(model, unknowns);
      T circle[3];
      rim_circle(view_numbers(numbers.data(), row.side), model.views[row.side == Side::kLower ? 0 : 1], circle);
      residual[0] = (circle[0] - row.rim.centre_px.x()) / row.rim.sigma_centre_px;
      residual[1] = (circle[1] - row.rim.centre_px.y()) / row.rim.sigma_centre_px;
      residual[2] = (circle[2] - row.rim.radius_px) / row.rim.sigma_radius_px;
      return true;
    };
    add<3, kSharedNumbers>(problem, cost, nullptr, state.unknowns.data());
  }
}

void add_first_pose(const BundleData& data, BundleState& state, ceres::Problem& problem) {
  if (!data.first_pose) return;
  const auto cost = [&first = *data.first_pose]<typename T>(const T* pose, T* residual) {
    const T error[3] = {pose[0] - first.pose[0], pose[1] - first.pose[1],
                        within_half_a_turn<T>(pose[2] - first.pose[2])};
    for (int i = 0; i < 3; ++i) {
      residual[i] = T(0);
      for (int j = 0; j < 3; ++j) residual[i] += first.whitener(i, j) * error[j];
    }
    return true;
  };
  add<3, 3>(problem, cost, nullptr, state.poses.front().data());
}

/// Returns the distance between two landmarks minus the measured one, in its sigmas. @param from,to their shifts
template <typename T>
T distance_residual(const BundleData::DistanceRow& row, const T* from, const T* to) {
  const auto place = [](const Landmark& l, const T* shift, int axis) {
    return axis == 0 ? l.x_m + l.sigma.x_m * shift[kPlaceX] : l.y_m + l.sigma.y_m * shift[kPlaceY];
  };
  const T dx = place(row.to, to, 0) - place(row.from, from, 0);
  const T dy = place(row.to, to, 1) - place(row.from, from, 1);
  return (sqrt(dx * dx + dy * dy) - T(row.measured.distance_m)) / T(row.measured.sigma_m);
}

void add_distances(const BundleData& data, BundleState& state, ceres::Problem& problem) {
  for (const BundleData::DistanceRow& row : data.distances) {
    const auto cost = [&row]<typename T>(const T* from, const T* to, T* residual) {
      residual[0] = distance_residual(row, from, to);
      return true;
    };
    add<1, kLandmarkNumbers, kLandmarkNumbers>(problem, cost, nullptr, state.landmarks[row.measured.from].data(),
                                               state.landmarks[row.measured.to].data());
  }
}

/// Adds the priors of the landmarks' shifts.
void add_landmarks(const BundleData& data, BundleState& state, ceres::Problem& problem) {
  for (std::size_t i = 0; i < state.landmarks.size(); ++i) {
    const auto centred = []<typename T>(const T* shift, T* residual) {
      std::copy_n(shift, int(kLandmarkNumbers), residual);
      return true;
    };
    const auto& scale = data.radius_scales[i];
    if (!scale) {
      add<kLandmarkNumbers, kLandmarkNumbers>(problem, centred, nullptr, state.landmarks[i].data());
      continue;
    }
    const auto scaled = [&row = *scale, centred]<typename T>(const T* shift, const T* other, T* residual) {
      centred(shift, residual);
      residual[kRadius] -= distance_residual(row, shift, other);
      return true;
    };
    add<kLandmarkNumbers, kLandmarkNumbers, kLandmarkNumbers>(problem, scaled, nullptr, state.landmarks[i].data(),
                                                              state.landmarks[scale->measured.to].data());
  }
}

/// Adds the prior of the unknowns: each is in sigmas of its prior, with mean 0.
void add_prior(BundleState& state, ceres::Problem& problem) {
  const auto cost = []<typename T>(const T* unknowns, T* residual) {
    std::copy_n(unknowns, kSharedNumbers, residual);
    return true;
  };
  add<kSharedNumbers, kSharedNumbers>(problem, cost, nullptr, state.unknowns.data());
}

void build(const BundleData& data, const BundleSettings& settings, BundleState& state, ceres::Problem& problem) {
  problem.AddParameterBlock(state.unknowns.data(), kSharedNumbers);
  for (Eigen::Vector3d& pose : state.poses) problem.AddParameterBlock(pose.data(), 3);
  add_first_pose(data, state, problem);
  add_sightings(data, settings, state, problem);
  if (has_biases(settings)) add_biases(state, settings.systematic_px, problem);
  add_landmarks(data, state, problem);
  if (settings.hold_all || !data.moves_landmarks) {
    for (LandmarkVector& shift : state.landmarks) problem.SetParameterBlockConstant(shift.data());
  }
  add_prior(state, problem);
  if (settings.hold_all) {
    problem.SetParameterBlockConstant(state.unknowns.data());
    return;
  }
  add_rims(data, state, problem);
  add_distances(data, state, problem);
  add_wheels(data, settings, state, problem);
  if (!settings.held.empty()) {
    problem.SetManifold(state.unknowns.data(), new ceres::SubsetManifold(kSharedNumbers, settings.held));
  }
}

}  // namespace

bool has_solver() { return true; }

bool minimise(const BundleData& data, const BundleSettings& settings, BundleState& state) {
  BundleState attempt = state;
  ceres::Problem problem;
  build(data, settings, attempt, problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = kSolverIterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // Iterate until the rounding of the sum of squares ends it, because the answer must not depend on the start.
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable() || !attempt.unknowns.allFinite()) return false;
  state = attempt;
  return true;
}

Eigen::MatrixXd shared_information(const BundleData& data, const BundleSettings& settings, const BundleState& state) {
  BundleState copy = state;
  BundleSettings all_free = settings;
  all_free.held.clear();
  all_free.cauchy_sigmas.reset();
  ceres::Problem problem;
  build(data, all_free, copy, problem);
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = {copy.unknowns.data()};
  if (data.moves_landmarks) {
    for (LandmarkVector& shift : copy.landmarks) options.parameter_blocks.push_back(shift.data());
  }
  const int wanted = kSharedNumbers + (data.moves_landmarks ? kLandmarkNumbers * int(copy.landmarks.size()) : 0);
  for (Eigen::Vector3d& pose : copy.poses) options.parameter_blocks.push_back(pose.data());
  for (Eigen::Vector2d& slips : copy.slips) options.parameter_blocks.push_back(slips.data());
  if (has_biases(settings)) {
    for (Eigen::Vector2d& bias : copy.biases) options.parameter_blocks.push_back(bias.data());
  }
  ceres::CRSMatrix rows;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &rows);

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(rows.num_rows, wanted);
  for (int row = 0; row < rows.num_rows; ++row) {
    for (int k = rows.rows[std::size_t(row)]; k < rows.rows[std::size_t(row) + 1]; ++k) {
      const int column = rows.cols[std::size_t(k)];
      const double value = rows.values[std::size_t(k)];
      if (column < wanted) {
        shared(row, column) = value;
      } else {
        entries.emplace_back(row, column - wanted, value);
      }
    }
  }
  Eigen::SparseMatrix<double> own(rows.num_rows, rows.num_cols - wanted);
  own.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> block = own.transpose() * own;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(block);
  const Eigen::MatrixXd mixed = own.transpose() * shared;
  const Eigen::MatrixXd eliminated = mixed.transpose() * factor.solve(mixed);
  const Eigen::MatrixXd information = shared.transpose() * shared - eliminated;
  return (information + information.transpose()) / 2;
}

}  // namespace twocone::vision::calibration
