// SPDX-License-Identifier: Apache-2.0
// This is the only file that uses Ceres. The wheels link the poses in a chain, so they are not an independent set for a
// Schur solver. A sparse Cholesky factor with a fill-reducing order eliminates them before the shared numbers
// nevertheless.
#include <ceres/ceres.h>

#include <numeric>

#include <Eigen/Sparse>

#include "vision/calibration/bundle.h"
#include "vision/calibration/bundle_rows.h"

namespace twocone::vision::calibration {
namespace {

constexpr int kSolverIterations = 100;

struct Plain {
  double operator()(double x) const { return x; }
  template <int n>
  double operator()(const ceres::Jet<double, n>& x) const {
    return x.a;
  }
};

struct SightingCost {
  const SharedModel* model;
  const SightingRow* row;
  Eigen::Matrix2d whitener;

  template <typename T>
  bool operator()(const T* unknowns, const T* pose, const T* shift, T* residual) const {
    T error[2];
    sighting_residual(*model, *row, unknowns, pose, shift, error);
    for (int i = 0; i < 2; ++i) residual[i] = whitener(i, 0) * error[0] + whitener(i, 1) * error[1];
    return true;
  }
};

struct BiasedSightingCost {
  SightingCost cost;

  template <typename T>
  bool operator()(const T* unknowns, const T* pose, const T* shift, const T* of_landmark, const T* of_ring,
                  const T* of_both, T* residual) const {
    T error[2];
    sighting_residual(*cost.model, *cost.row, unknowns, pose, shift, error);
    const T bias[2] = {of_landmark[0] + of_ring[0] + of_both[0], of_landmark[1] + of_ring[1] + of_both[1]};
    const Eigen::Matrix2d& axes = cost.row->axes;
    for (int i = 0; i < 2; ++i) error[i] -= axes(i, 0) * bias[0] + axes(i, 1) * bias[1];
    for (int i = 0; i < 2; ++i) residual[i] = cost.whitener(i, 0) * error[0] + cost.whitener(i, 1) * error[1];
    return true;
  }
};

/// Prior of a bias, px, or of a landmark's shift, in units of its sigma.
struct CentredCost {
  double sigma;

  template <typename T>
  bool operator()(const T* number, T* residual) const {
    for (int i = 0; i < 2; ++i) residual[i] = number[i] / T(sigma);
    return true;
  }
};

struct WheelCost {
  const SharedModel* model;
  const WheelRow* row;
  double scale;

  template <typename T>
  bool operator()(const T* unknowns, const T* from, const T* to, const T* last_slips, const T* slips,
                  T* residual) const {
    wheel_residual(*model, *row, unknowns, from, to, last_slips, slips, residual, Plain{});
    for (int i = 0; i < 5; ++i) residual[i] /= T(scale);
    return true;
  }
};

struct FirstWheelCost {
  WheelCost cost;

  template <typename T>
  bool operator()(const T* unknowns, const T* from, const T* to, const T* slips, T* residual) const {
    const T none[2] = {T(0), T(0)};
    return cost(unknowns, from, to, none, slips, residual);
  }
};

struct RimCost {
  const SharedModel* model;
  const RimRow* row;

  template <typename T>
  bool operator()(const T* unknowns, T* residual) const {
    const Numbers<T> numbers = numbers_of(*model, unknowns);
    T circle[3];
    rim_circle(view_numbers(numbers.data(), row->side), model->views[row->side == Side::kLower ? 0 : 1], circle);
    residual[0] = (circle[0] - row->rim.centre_px.x()) / row->rim.sigma_centre_px;
    residual[1] = (circle[1] - row->rim.centre_px.y()) / row->rim.sigma_centre_px;
    residual[2] = (circle[2] - row->rim.radius_px) / row->rim.sigma_radius_px;
    return true;
  }
};

/// Prior of the unknowns: each is in sigmas of its prior, with mean 0.
struct PriorCost {
  template <typename T>
  bool operator()(const T* unknowns, T* residual) const {
    for (int i = 0; i < kSharedNumbers; ++i) residual[i] = unknowns[i];
    return true;
  }
};

/// Adds a cost of `residuals` numbers by unknowns of these `sizes`, with derivatives by automatic differentiation.
template <int residuals, int... sizes, typename Cost, typename... Blocks>
void add(ceres::Problem& problem, const Cost& cost, ceres::LossFunction* loss, Blocks*... blocks) {
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Cost, residuals, sizes...>(new Cost(cost)), loss, blocks...);
}

bool moves_landmarks(const BundleData& data) { return data.model.landmark_sigma_m > 0; }

bool has_biases(const BundleSettings& settings) { return settings.systematic_px > 0 && !settings.hold_all; }

void add_centred(std::vector<Eigen::Vector2d>& numbers, double sigma, ceres::Problem& problem) {
  for (Eigen::Vector2d& number : numbers) add<2, 2>(problem, CentredCost{sigma}, nullptr, number.data());
}

void add_wheels(const BundleData& data, const BundleSettings& settings, BundleState& state, ceres::Problem& problem) {
  for (std::size_t i = 0; i < data.wheels.size(); ++i) {
    const WheelRow& row = data.wheels[i];
    const WheelCost cost{&data.model, &row, settings.wheel_scale};
    double* const from = state.poses[row.frame - 1].data();
    double* const to = state.poses[row.frame].data();
    double* const slips = state.slips[i].data();
    if (row.follows) {
      add<5, kSharedNumbers, 3, 3, 2, 2>(problem, cost, nullptr, state.unknowns.data(), from, to,
                                         state.slips[i - 1].data(), slips);
    } else {
      add<5, kSharedNumbers, 3, 3, 2>(problem, FirstWheelCost{cost}, nullptr, state.unknowns.data(), from, to, slips);
    }
  }
}

void build(const BundleData& data, const BundleSettings& settings, BundleState& state, ceres::Problem& problem) {
  problem.AddParameterBlock(state.unknowns.data(), kSharedNumbers);
  for (Eigen::Vector3d& pose : state.poses) problem.AddParameterBlock(pose.data(), 3);
  for (const SightingRow& row : data.sightings) {
    if (!row.used) continue;
    const SightingCost cost{&data.model, &row, row.whitener / settings.sighting_scale};
    ceres::LossFunction* const loss = settings.cauchy_sigmas ? new ceres::CauchyLoss(*settings.cauchy_sigmas) : nullptr;
    double* const pose = state.poses[row.frame].data();
    double* const shift = state.landmarks[row.landmark_index].data();
    if (has_biases(settings)) {
      add<2, kSharedNumbers, 3, 2, 2, 2, 2>(problem, BiasedSightingCost{cost}, loss, state.unknowns.data(), pose, shift,
                                            state.biases[row.groups[0]].data(), state.biases[row.groups[1]].data(),
                                            state.biases[row.groups[2]].data());
    } else {
      add<2, kSharedNumbers, 3, 2>(problem, cost, loss, state.unknowns.data(), pose, shift);
    }
  }
  if (has_biases(settings)) add_centred(state.biases, settings.systematic_px, problem);
  add_centred(state.landmarks, 1, problem);
  if (settings.hold_all || !moves_landmarks(data)) {
    for (Eigen::Vector2d& shift : state.landmarks) problem.SetParameterBlockConstant(shift.data());
  }
  add<kSharedNumbers, kSharedNumbers>(problem, PriorCost{}, nullptr, state.unknowns.data());
  if (settings.hold_all) {
    problem.SetParameterBlockConstant(state.unknowns.data());
    return;
  }
  for (const RimRow& row : data.rims) {
    add<3, kSharedNumbers>(problem, RimCost{&data.model, &row}, nullptr, state.unknowns.data());
  }
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
  // Iterate until the rounding of the sum of squares stops it: beyond that, the answer must not depend on the start.
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
  if (moves_landmarks(data)) {
    for (Eigen::Vector2d& shift : copy.landmarks) options.parameter_blocks.push_back(shift.data());
  }
  const int wanted = kSharedNumbers + (moves_landmarks(data) ? 2 * int(copy.landmarks.size()) : 0);
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
