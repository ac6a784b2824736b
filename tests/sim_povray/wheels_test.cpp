// SPDX-License-Identifier: Apache-2.0
// The random slip of a wheel, and the reading of its encoder.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sim_povray/world/wheel.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {
namespace {

// ---- the slip process

struct Sample {
  double mean = 0;
  double deviation = 0;
};
Sample statistics(const std::vector<double>& values) {
  Sample s;
  for (const double v : values) s.mean += v / double(values.size());
  for (const double v : values) s.deviation += (v - s.mean) * (v - s.mean) / double(values.size() - 1);
  s.deviation = std::sqrt(s.deviation);
  return s;
}

constexpr int kSlipDraws = 20000;
constexpr int kSeeds = 4000;  // seeding takes longer than drawing
// Five standard deviations: the seeds are fixed, so that these tests fail always or never. A correct process fails with
// one of 2e6 seeds.
constexpr double kSlipSigmas = 5;

TEST(Slip, HasTheStatedDeviationFromTheFirstStepOn) {
  std::vector<double> first;
  for (int seed = 0; seed < kSeeds; ++seed) {
    first.push_back(Slip(0.03, 2.0, engine_for(std::uint64_t(seed), Purpose::kLeftSlip)).value());
  }
  const Sample s = statistics(first);
  EXPECT_NEAR(s.mean, 0, kSlipSigmas * 0.03 / std::sqrt(double(kSeeds)));
  EXPECT_NEAR(s.deviation, 0.03, kSlipSigmas * 0.03 / std::sqrt(2.0 * kSeeds));
}

// Catches a wrong driving noise (1 - a for 1 - a^2, or a forgotten root): the deviation would drift from sigma.
TEST(Slip, KeepsItsDeviationForEveryStep) {
  for (const double dt_s : {0.03, 0.7, 9.0}) {
    Slip slip(0.03, 2.0, engine_for(5, Purpose::kLeftSlip));
    std::vector<double> values;
    for (int i = 0; i < kSlipDraws; ++i) {
      slip.advance(dt_s);
      values.push_back(slip.value());
    }
    // If a is the correlation of successive draws, n draws determine the mean like n (1 - a) / (1 + a) independent
    // ones, and the variance like n (1 - a^2) / (1 + a^2).
    const double a = std::exp(-dt_s / 2.0);
    const double for_mean = kSlipDraws * (1 - a) / (1 + a);
    const double for_deviation = kSlipDraws * (1 - a * a) / (1 + a * a);
    const Sample s = statistics(values);
    EXPECT_NEAR(s.mean, 0, kSlipSigmas * 0.03 / std::sqrt(for_mean)) << "dt = " << dt_s << " s";
    EXPECT_NEAR(s.deviation, 0.03, kSlipSigmas * 0.03 / std::sqrt(2 * for_deviation)) << "dt = " << dt_s << " s";
  }
}

TEST(Slip, DecaysWithItsTimeConstant) {
  constexpr double kStep_s = 0.9;
  const double a = std::exp(-kStep_s / 2.0);
  Slip slip(1.0, 2.0, engine_for(6, Purpose::kLeftSlip));
  double products = 0;
  double squares = 0;
  for (int i = 0; i < kSlipDraws; ++i) {
    const double before = slip.value();
    slip.advance(kStep_s);
    products += before * slip.value();
    squares += before * before;
  }
  EXPECT_NEAR(products / squares, a, kSlipSigmas * std::sqrt((1 - a * a) / kSlipDraws));
}

TEST(Slip, TheTwoWheelsAreIndependent) {
  double products = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    products += Slip(1.0, 2.0, engine_for(std::uint64_t(seed), Purpose::kLeftSlip)).value() *
                Slip(1.0, 2.0, engine_for(std::uint64_t(seed), Purpose::kRightSlip)).value();
  }
  EXPECT_NEAR(products / kSeeds, 0, kSlipSigmas / std::sqrt(double(kSeeds)));
}

TEST(Slip, ZeroIsExactlyZero) {
  Slip slip(0, 2.0, engine_for(1, Purpose::kLeftSlip));
  slip.advance(0.1);
  EXPECT_EQ(slip.value(), 0);
}

// ---- encoders

TEST(Encoder, CountsDownwards) {
  constexpr double kCount_rad = 2 * std::numbers::pi / 1024;
  EXPECT_EQ(encoder_reading_rad(0, 1024), 0);
  EXPECT_DOUBLE_EQ(encoder_reading_rad(10.4 * kCount_rad, 1024), 10 * kCount_rad);
  EXPECT_DOUBLE_EQ(encoder_reading_rad(10.9 * kCount_rad, 1024), 10 * kCount_rad);
  EXPECT_DOUBLE_EQ(encoder_reading_rad(-0.1 * kCount_rad, 1024), -1 * kCount_rad);
  EXPECT_DOUBLE_EQ(encoder_reading_rad(5000.5 * kCount_rad, 1024), 5000 * kCount_rad) << "angles do not wrap";
}

TEST(Encoder, WithoutCountsIsExact) { EXPECT_EQ(encoder_reading_rad(1.2345, 0), 1.2345); }

}  // namespace
}  // namespace twocone::sim_povray
