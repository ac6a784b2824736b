// SPDX-License-Identifier: Apache-2.0
// The random slip of a wheel, the reading of its encoder, and the friction of two wheels on the floor.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
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

// ---- friction on the floor

/// Returns the energy of sliding after an impulse: the kinetic energy of the body relative to the motion of its rims.
double sliding_J(const WheelFriction& w, const FloorVelocity& before, const GroundSpeeds& rims, const FloorImpulse& p) {
  const BodySpeeds wanted = body_speeds(rims, w.separation_m);
  const double ahead = before.ahead_mps + p.ahead_Ns / w.mass_kg - wanted.speed_mps;
  const double left = before.left_mps + p.left_Ns / w.mass_kg;
  const double turn = before.turn_radps + p.turn_Nms / w.inertia_kgm2 - wanted.turn_radps;
  return w.mass_kg * (ahead * ahead + left * left) / 2 + w.inertia_kgm2 * turn * turn / 2;
}

// Compares with a slow search over a grid of the impulses of both wheels.
TEST(FloorFriction, WheelImpulsesMinimiseSliding) {
  const WheelFriction w{2.1, 2.1 * 0.04 / 2, 0.31, 6.0};
  constexpr double kDt_s = 0.01;
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int n = 0; n < 12; ++n) {
    const double range = n < 3 ? 0.01 : 0.2;
    const FloorVelocity before{range * any(engine), range * any(engine), 5 * range * any(engine)};
    const GroundSpeeds rims{range * any(engine), range * any(engine)};
    const double got_J = sliding_J(w, before, rims, wheel_impulse(w, before, rims, kDt_s));
    double best_J = std::numeric_limits<double>::infinity();
    constexpr int kRays = 40;
    constexpr int kRings = 6;
    for (int i = 0; i < kRays * kRings; ++i) {
      for (int j = 0; j < kRays * kRings; ++j) {
        const double l = w.most_N * kDt_s * (i / kRays + 1) / kRings;
        const double r = w.most_N * kDt_s * (j / kRays + 1) / kRings;
        const double a = 2 * std::numbers::pi * (i % kRays) / kRays;
        const double b = 2 * std::numbers::pi * (j % kRays) / kRays;
        best_J = std::min(best_J, sliding_J(w, before, rims,
                                            {l * std::cos(a) + r * std::cos(b), l * std::sin(a) + r * std::sin(b),
                                             0.155 * (r * std::cos(b) - l * std::cos(a))}));
      }
    }
    EXPECT_LE(got_J, best_J + 1e-12) << "case " << n;
  }
}

// At the minimum, the impulse of each sliding wheel has its greatest value and points against the sliding of its
// contact point. Where both wheels slide, the sum follows from these two directions. Catches an iteration that ends
// too early.
TEST(FloorFriction, WheelImpulsesMeetTheConditionsOfTheMinimum) {
  constexpr double kDt_s = 0.5e-3;
  std::mt19937_64 engine(4);
  std::uniform_real_distribution<double> any(-1, 1);
  int both_slide = 0;
  for (const double separation_m : {0.1, 0.3, 0.8, 4.0}) {  // for a body with a radius of 0.2 m
    const WheelFriction w{4, 4 * 0.04 / 2, separation_m, 12};
    for (int n = 0; n < 500; ++n) {
      const double range = std::pow(10, -2 + 2 * any(engine));
      const FloorVelocity before{range * any(engine), range * any(engine), 5 * range * any(engine)};
      const GroundSpeeds rims{range * any(engine), range * any(engine)};
      const FloorImpulse p = wheel_impulse(w, before, rims, kDt_s);
      FloorImpulse expected;
      double slowest_mps = std::numeric_limits<double>::infinity();
      for (const double side : {-1.0, 1.0}) {
        const double arm_m = side * separation_m / 2;
        const double ahead = before.ahead_mps + p.ahead_Ns / w.mass_kg +
                             arm_m * (before.turn_radps + p.turn_Nms / w.inertia_kgm2) -
                             (side < 0 ? rims.left_mps : rims.right_mps);
        const double left = before.left_mps + p.left_Ns / w.mass_kg;
        const double slide_mps = std::hypot(ahead, left);
        slowest_mps = std::min(slowest_mps, slide_mps);
        expected.ahead_Ns -= w.most_N * kDt_s * ahead / slide_mps;
        expected.left_Ns -= w.most_N * kDt_s * left / slide_mps;
        expected.turn_Nms -= arm_m * w.most_N * kDt_s * ahead / slide_mps;
      }
      if (slowest_mps < 1e-4) continue;  // one wheel grips: its impulse has any value that holds it
      ++both_slide;
      const double most_Ns = w.most_N * kDt_s;
      EXPECT_NEAR(p.ahead_Ns, expected.ahead_Ns, 1e-6 * most_Ns) << separation_m << " m, case " << n;
      EXPECT_NEAR(p.left_Ns, expected.left_Ns, 1e-6 * most_Ns) << separation_m << " m, case " << n;
      EXPECT_NEAR(p.turn_Nms, expected.turn_Nms, 1e-6 * most_Ns * separation_m) << separation_m << " m, case " << n;
    }
  }
  EXPECT_GT(both_slide, 500);
}

}  // namespace
}  // namespace twocone::sim_povray
