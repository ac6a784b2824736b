// SPDX-License-Identifier: Apache-2.0
// Measures the cost of one stereo frame above the HAL. Quote ratios from one run of this program. Compare
// OutlineOfAPair with PairToHsv, OpenCV's conversion of the same pair from BGR to HSV in one thread. Compare others
// with DecodePngPair, the work of reading the same two images from a run folder. Quote medians:
// --benchmark_repetitions=9 --benchmark_report_aggregates_only=true

#include <array>
#include <functional>

#include <benchmark/benchmark.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/estimation/estimator.h"
#include "localisation/least_squares_fix.h"
#include "localisation/paper_trilateration.h"
#include "tests/support/synthetic_lab.h"
#include "vision/outline_ranging.h"
#include "vision/paper_ranging.h"
#include "vision/rim.h"
#include "vision/unwrap.h"

namespace {

using namespace twocone;  // NOLINT(google-build-using-namespace): a program of its own

const cv::Size kSize(640, 480);

vision::Rig lab_rig() {
  vision::MirrorViewSettings s{.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
                               .lens_height_m = 0.25,
                               .centre_px = {319.5, 239.5},
                               .rim_radius_px = 236};
  const vision::MirrorView lower(s);
  s.lens_height_m = 0.55;
  return {lower, vision::MirrorView(s)};
}

std::vector<Landmark> six_targets() {
  return {{"red", {1, 0, 0}, 0, 0, 0.15},  {"green", {0, 1, 0}, 0, 0, 0.15},   {"blue", {0, 0, 1}, 0, 0, 0.15},
          {"cyan", {0, 1, 1}, 0, 0, 0.15}, {"magenta", {1, 0, 1}, 0, 0, 0.15}, {"yellow", {1, 1, 0}, 0, 0, 0.15}};
}

/// Returns six spokes on grey, from the tip out to `radius_px`: similar to landmarks, with as many coloured pixels.
cv::Mat image(double radius_px) {
  const cv::Vec3b colours[] = {{200, 20, 20},  {20, 200, 20},  {20, 20, 200},
                               {20, 200, 200}, {200, 20, 200}, {200, 200, 20}};
  cv::Mat p(kSize, CV_8UC3);
  for (int row = 0; row < p.rows; ++row) {
    for (int column = 0; column < p.cols; ++column) {
      const double dx = column - 319.5;
      const double dy = row - 239.5;
      const double turn = std::atan2(dy, dx) / (2 * std::numbers::pi) * 6 + 3;
      const bool spoke = std::abs(turn - std::floor(turn) - 0.5) < 0.05 && std::hypot(dx, dy) < radius_px;
      const auto grey = static_cast<std::uint8_t>(120 + (row * 7 + column * 13) % 64);
      p.at<cv::Vec3b>(row, column) = spoke ? colours[static_cast<std::size_t>(turn) % 6] : cv::Vec3b::all(grey);
    }
  }
  return p;
}

void DecodePngPair(benchmark::State& state) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", image(130), png, {cv::IMWRITE_PNG_COMPRESSION, 1});
  for (auto _ : state) {
    benchmark::DoNotOptimize(cv::imdecode(png, cv::IMREAD_COLOR));
    benchmark::DoNotOptimize(cv::imdecode(png, cv::IMREAD_COLOR));
  }
}
BENCHMARK(DecodePngPair)->Unit(benchmark::kMillisecond);

void PaperRangingOfAPair(benchmark::State& state) {
  const vision::PaperRanging ranging(lab_rig(), six_targets(), kSize, kSize);
  const cv::Mat lower = image(130);
  const cv::Mat upper = image(60);
  for (auto _ : state) benchmark::DoNotOptimize(ranging.measure(lower, upper));
}
BENCHMARK(PaperRangingOfAPair)->Unit(benchmark::kMillisecond);

void FixByTriangle(benchmark::State& state) {
  const std::vector<localisation::LandmarkRange> ranges = {{{-2.6, -0.35}, 2.81}, {{-1.45, 2.1}, 2.43},
                                                           {{1.6, 2.1}, 2.69},    {{2.6, 0.3}, 2.55},
                                                           {{1.35, -2.1}, 2.51},  {{-1.55, -2.1}, 2.66}};
  for (auto _ : state) benchmark::DoNotOptimize(localisation::fix_by_triangle(ranges));
}
BENCHMARK(FixByTriangle)->Unit(benchmark::kMicrosecond);

/// The lab's six landmarks in a room of the lab's brightness, with the noise of a camera.
struct LabPair {
  testing_support::SyntheticRig rig{vision::lab_rig(), {.level = 0.45, .cells = 24, .contrast = 0.3}};
  std::vector<testing_support::SyntheticLandmark> landmarks = testing_support::six_landmarks();
  testing_support::SyntheticRig::Pair images;
  LabPair() {
    std::mt19937_64 random(1);
    images = rig.take({testing_support::seen_from(landmarks, {0.13, -0.21}, 0.37), {}, {}}, {1, 1}, random);
  }
};
const LabPair& lab_pair() {
  static const LabPair pair;
  return pair;
}

/// Computes the fix from measurements of the lab's landmarks.
localisation::Fix fix_of(const std::vector<vision::RangeMeasurement>& measured, const LabPair& lab) {
  std::vector<localisation::LandmarkMeasurement> measurements;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (!measured[k].covariance) continue;
    measurements.push_back(
        {lab.landmarks[k].centre_m, measured[k].range_m, measured[k].bearing_rad, *measured[k].covariance});
  }
  return localisation::fix_by_least_squares(measurements);
}

/// Measures vision and localisation of one stereo frame.
void OutlineOfAPair(benchmark::State& state) {
  const LabPair& lab = lab_pair();
  const vision::OutlineRanging ranging(lab.rig.rig, testing_support::targets_of(lab.landmarks), kSize, kSize);
  for (auto _ : state) {
    auto fix = fix_of(ranging.measure(lab.images.lower, lab.images.upper), lab);
    if (fix.used < 6) state.SkipWithError("not all six landmarks were used");
    benchmark::DoNotOptimize(fix);
  }
}
BENCHMARK(OutlineOfAPair)->Unit(benchmark::kMillisecond);

/// Measures as OutlineOfAPair, with all landmarks measured to a stage.
void StageOfAPair(benchmark::State& state, vision::Stage stage) {
  const LabPair& lab = lab_pair();
  const vision::OutlineRanging ranging(lab.rig.rig, testing_support::targets_of(lab.landmarks), kSize, kSize);
  constexpr std::array<std::size_t, 6> kAll{0, 1, 2, 3, 4, 5};
  for (auto _ : state) {
    vision::FrameObservation observation = ranging.look(lab.images.lower, lab.images.upper);
    observation.take(kAll, stage);
    auto fix = fix_of(observation.measurements(), lab);
    if (fix.used < 6) state.SkipWithError("not all six landmarks were used");
    benchmark::DoNotOptimize(fix);
  }
}
void FoundOfAPair(benchmark::State& state) { StageOfAPair(state, vision::Stage::kFound); }
BENCHMARK(FoundOfAPair)->Unit(benchmark::kMillisecond);
void CoarseOfAPair(benchmark::State& state) { StageOfAPair(state, vision::Stage::kCoarse); }
BENCHMARK(CoarseOfAPair)->Unit(benchmark::kMillisecond);

/// Measures as OutlineOfAPair, refined until the position's sigma is this number of tenths of a millimetre; 0: all
/// landmarks.
void AdaptiveOfAPair(benchmark::State& state) {
  const LabPair& lab = lab_pair();
  const vision::OutlineRanging ranging(lab.rig.rig, testing_support::targets_of(lab.landmarks), kSize, kSize);
  std::vector<Eigen::Vector2d> landmarks_m;
  for (const auto& landmark : lab.landmarks) landmarks_m.push_back(landmark.centre_m);
  const std::array<Eigen::Vector2d, 2> centres_px{lab.rig.rig.lower.settings().centre_px,
                                                  lab.rig.rig.upper.settings().centre_px};
  const std::function<double()> no_clock;
  const double enough_m = 1e-4 * double(state.range(0)) + 1e-9;
  int refined = 0;
  for (auto _ : state) {
    vision::FrameObservation observation = ranging.look(lab.images.lower, lab.images.upper);
    auto answer =
        estimation::refine_adaptively(observation, landmarks_m, {}, centres_px, {.enough_m = enough_m}, no_clock, 0);
    refined = observation.refined();
    if (answer.fix.verdict != localisation::FixVerdict::kOk) state.SkipWithError("no fix");
    benchmark::DoNotOptimize(answer.fix);
  }
  state.counters["refined"] = refined;
}
BENCHMARK(AdaptiveOfAPair)->Arg(0)->Arg(2)->Arg(5)->Arg(10)->Arg(20)->Unit(benchmark::kMillisecond);

void PairToHsv(benchmark::State& state) {
  const LabPair& lab = lab_pair();
  cv::setNumThreads(1);
  cv::Mat lower;
  cv::Mat upper;
  for (auto _ : state) {
    cv::cvtColor(lab.images.lower, lower, cv::COLOR_BGR2HSV);
    cv::cvtColor(lab.images.upper, upper, cv::COLOR_BGR2HSV);
    benchmark::DoNotOptimize(lower.data);
    benchmark::DoNotOptimize(upper.data);
  }
}
BENCHMARK(PairToHsv)->Unit(benchmark::kMillisecond);

void Unwrap(benchmark::State& state) {
  const auto rig = lab_rig();
  const cv::Mat p = image(130);
  for (auto _ : state) benchmark::DoNotOptimize(vision::unwrap(p, rig.lower, 1440));
}
BENCHMARK(Unwrap)->Unit(benchmark::kMillisecond);

void FindRim(benchmark::State& state) {
  const cv::Mat p = image(236);
  for (auto _ : state) benchmark::DoNotOptimize(vision::find_rim(p, {{319.5, 239.5}, 236, 0}));
}
BENCHMARK(FindRim)->Unit(benchmark::kMillisecond);

}  // namespace
