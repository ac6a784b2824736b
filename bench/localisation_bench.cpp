// SPDX-License-Identifier: Apache-2.0
// Measures the cost of one fix. Quote the ratio to SvdOfMatrix3d from one run of this program, and medians:
// --benchmark_repetitions=9 --benchmark_report_aggregates_only=true
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "localisation/least_squares_fix.h"
#include "localisation/paper_trilateration.h"

namespace {

using namespace twocone;  // NOLINT(google-build-using-namespace): a program of its own

/// Measures the reference: one Jacobi SVD with both bases.
void SvdOfMatrix3d(benchmark::State& state) {
  Eigen::Matrix3d m;
  m << 0.83, -1.27, 0.41, 2.13, 0.37, -0.59, -0.71, 1.91, 1.13;
  for (auto _ : state) {
    benchmark::DoNotOptimize(m);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    benchmark::DoNotOptimize(svd.singularValues().data());
    benchmark::DoNotOptimize(svd.matrixU().data());
    benchmark::DoNotOptimize(svd.matrixV().data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(SvdOfMatrix3d);

/// Returns landmarks round a room, seen from (0.21, -0.34) m at 0.7 rad with errors of about a sigma: 3 mm + 2 mm/m,
/// 1.5 mrad.
std::vector<localisation::LandmarkMeasurement> sightings(int count, bool has_bearings) {
  std::vector<localisation::LandmarkMeasurement> all;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.3999632 * i;  // the golden angle avoids symmetry
    const double error = std::sin(17.0 * i + 1);
    localisation::LandmarkMeasurement m;
    m.landmark_m = {2.7 * std::cos(turn), 2.2 * std::sin(turn) + 0.05 * i / count};
    const Eigen::Vector2d to = m.landmark_m - Eigen::Vector2d(0.21, -0.34);
    const double sigma_m = 0.003 + 0.002 * to.norm();
    m.range_m = to.norm() + sigma_m * error;
    if (has_bearings) m.bearing_rad = std::atan2(to.y(), to.x()) - 0.7 - 0.0015 * std::cos(5.0 * i);
    m.covariance << sigma_m * sigma_m, 0.2 * sigma_m * 0.0015, 0.2 * sigma_m * 0.0015, 0.0015 * 0.0015;
    all.push_back(m);
  }
  return all;
}

void fix_of(benchmark::State& state, const std::vector<localisation::LandmarkMeasurement>& measurements) {
  const auto verdict = localisation::fix_by_least_squares(measurements).verdict;
  if (verdict != localisation::FixVerdict::kOk) state.SkipWithError("no fix");
  for (auto _ : state) benchmark::DoNotOptimize(localisation::fix_by_least_squares(measurements));
}

void FixByLeastSquares(benchmark::State& state) { fix_of(state, sightings(int(state.range(0)), true)); }
BENCHMARK(FixByLeastSquares)->Arg(3)->Arg(6)->Arg(32)->Arg(33)->Arg(1000);

void FixByRangesOnly(benchmark::State& state) { fix_of(state, sightings(int(state.range(0)), false)); }
BENCHMARK(FixByRangesOnly)->Arg(6);

void FixWithTwoOutliersOfSix(benchmark::State& state) {
  auto measurements = sightings(6, true);
  *measurements[1].range_m += 0.5;
  *measurements[4].range_m -= 0.5;
  fix_of(state, measurements);
}
BENCHMARK(FixWithTwoOutliersOfSix);

/// Measures sets whose minima need a search: some landmarks have a range only, others a bearing only.
void FixOfMixed(benchmark::State& state) {
  const int ranges = int(state.range(0));
  auto measurements = sightings(ranges + int(state.range(1)), true);
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    (i < std::size_t(ranges) ? measurements[i].bearing_rad : measurements[i].range_m).reset();
  }
  for (auto _ : state) benchmark::DoNotOptimize(localisation::fix_by_least_squares(measurements));
}
BENCHMARK(FixOfMixed)->Args({1, 2})->Args({1, 3})->Args({2, 2})->Args({3, 3});

/// Measures sets in which every third or fourth landmark is elsewhere.
void FixWithOutliers(benchmark::State& state) {
  auto measurements = sightings(int(state.range(0)), true);
  const std::size_t step = std::size_t(state.range(0) / state.range(1));
  for (std::size_t i = 0; i < measurements.size() && i / step < std::size_t(state.range(1)); i += step) {
    measurements[i].landmark_m += Eigen::Vector2d(0.4 + 0.1 * std::sin(3.0 * double(i)), 0.5);
  }
  fix_of(state, measurements);
}
BENCHMARK(FixWithOutliers)->Args({32, 8})->Args({1000, 300});

void FixByTriangle(benchmark::State& state) {
  std::vector<localisation::LandmarkRange> ranges;
  for (const auto& m : sightings(6, false)) ranges.push_back({m.landmark_m, *m.range_m});
  for (auto _ : state) benchmark::DoNotOptimize(localisation::fix_by_triangle(ranges));
}
BENCHMARK(FixByTriangle);

void PoseBound(benchmark::State& state) {
  std::vector<Eigen::Vector2d> landmarks_m;
  std::vector<Eigen::Matrix2d> information;
  for (const auto& m : sightings(6, true)) {
    landmarks_m.push_back(m.landmark_m);
    information.emplace_back(m.covariance.inverse());
  }
  for (auto _ : state) benchmark::DoNotOptimize(localisation::pose_bound({0.21, -0.34, 0.7}, landmarks_m, information));
}
BENCHMARK(PoseBound);

}  // namespace
