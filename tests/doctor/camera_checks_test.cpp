// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/memory/memory.h"
#include "tests/doctor/bench_devices.h"
#include "tests/support/faulty_camera.h"

namespace twocone::doctor {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr CameraSettings kAsked{160, 120, 25};
constexpr double kSeconds = 3;

CameraUnderTest lower() {
  return {"lower",
          {.driver = "v4l2_camera", .settings = kAsked, .device = {"/dev/video9", "", {{"gain", 3}}}},
          vision::RimCircle{{79.5, 59.5}, 50, 0}};
}

Report checked(CameraTruth truth) {
  FakeSurroundings fake;
  if (truth.controls.empty()) truth.controls = {{"gain", 3}};
  const auto streams = std::make_shared<int>(0);
  BenchCamera camera(fake.clock, truth, streams);
  Report report;
  check_camera(lower(), camera, kSeconds, fake.surroundings(), report);
  EXPECT_EQ(*streams, 0) << "streams on";
  return report;
}

struct CameraCase {
  const char* name;
  CameraTruth truth;
  const char* check;
  Verdict verdict;
  const char* advice;
};
void PrintTo(const CameraCase& c, std::ostream* out) { *out << c.name; }

class Cameras : public testing::TestWithParam<CameraCase> {};

TEST_P(Cameras, AreJudged) {
  const CameraCase& c = GetParam();
  const Report report = checked(c.truth);
  const Row row = row_of(report, "lower", c.check);
  EXPECT_EQ(row.verdict, c.verdict) << row.check << ": " << row.measured;
  EXPECT_THAT(row.advice, HasSubstr(c.advice)) << row.measured;
}

INSTANTIATE_TEST_SUITE_P(
    Each, Cameras,
    testing::Values(
        CameraCase{"another_size", {.narrower_px = 4}, "format", Verdict::kFailed, "width_px: 156"},
        CameraCase{"another_rate", {.reported_rate_hz = 30}, "format", Verdict::kWarning, "rate_hz: 30"},
        CameraCase{"control_ignored", {.controls = {{"gain", 7}}}, "control", Verdict::kWarning, "gain: 7"},
        CameraCase{"control_not_reported", {.controls = {{"hue", 7}}}, "control", Verdict::kWarning, "image"},
        CameraCase{"does_not_start",
                   {.started = Error{ErrorCode::kRefused, "busy; end the other program"}},
                   "stream",
                   Verdict::kFailed,
                   "program"},
        CameraCase{"too_slow", {.rate_hz = 23.1}, "rate", Verdict::kFailed, "rate_hz: 23.1"},
        CameraCase{"too_fast", {.rate_hz = 27.3}, "rate", Verdict::kFailed, "rate_hz: 27.3"},
        CameraCase{"just_right", {.rate_hz = 24.1}, "rate", Verdict::kOk, ""},
        CameraCase{"times_stand_still", {.stands_still = true}, "rate", Verdict::kFailed, "no capture times"},
        CameraCase{"trembles", {.jitter_s = 0.017}, "jitter", Verdict::kWarning, "load"},
        CameraCase{"trembles_little", {.jitter_s = 0.006}, "jitter", Verdict::kOk, ""},
        CameraCase{"loses_few", {.lose_every = 17}, "lost frames", Verdict::kWarning, "cable"},
        CameraCase{"loses_few_and_keeps_its_rate", {.lose_every = 17}, "rate", Verdict::kOk, ""},
        CameraCase{"loses_many", {.lose_every = 3}, "lost frames", Verdict::kFailed, "cable"},
        CameraCase{"damages", {.damage_every = 23}, "lost frames", Verdict::kWarning, "cable"},
        CameraCase{"skips", {.skip_every = 9}, "lost frames", Verdict::kWarning, "busy"},
        CameraCase{"old", {.age_s = 0.093}, "age", Verdict::kWarning, "frame periods"},
        CameraCase{"from_the_future", {.age_s = -0.02}, "age", Verdict::kWarning, "future"},
        CameraCase{"goes_away", {.dies_after = 40}, "stream", Verdict::kFailed, "was disconnected"},
        CameraCase{"falls_silent",
                   {.dies_after = 40, .death = {ErrorCode::kTimeout, "no frame"}},
                   "stream",
                   Verdict::kFailed,
                   "sends nothing"},
        CameraCase{"sends_nothing",
                   {.dies_after = 0, .death = {ErrorCode::kTimeout, "no frame"}},
                   "stream",
                   Verdict::kFailed,
                   "sends nothing"},
        CameraCase{"dark", {.image = image_of({.inside = 3, .outside = 3})}, "exposure", Verdict::kFailed, "lens cap"},
        CameraCase{
            "cut_off", {.image = {160, 120, PixelFormat::kRgb8, {1, 2, 3}}}, "image", Verdict::kFailed, "cable"}),
    [](const auto& each) { return each.param.name; });

TEST(DoctorCamera, ThatIsInOrderIsOk) {
  const Report report = checked({});
  EXPECT_EQ(report.count(Verdict::kOk), report.rows().size()) << table(report);
  EXPECT_GE(report.rows().size(), 9U);
}

TEST(DoctorCamera, MeasuresRateAndAge) {
  const Report report = checked({.rate_hz = 24.4, .age_s = 0.0312});
  EXPECT_THAT(row_of(report, "lower", "rate").measured, HasSubstr("24.40 Hz"));
  EXPECT_THAT(row_of(report, "lower", "age").measured, HasSubstr("median 31.2 ms"));
}

TEST(DoctorCamera, StopsWhenItIsInterrupted) {
  FakeSurroundings fake;
  fake.stop = true;
  const auto streams = std::make_shared<int>(0);
  BenchCamera camera(fake.clock, {}, streams);
  Report report;
  EXPECT_THROW(check_camera(lower(), camera, kSeconds, fake.surroundings(), report), Interrupted);
  EXPECT_EQ(*streams, 0);
}

TEST(DoctorCamera, ABadCableIsReported) {
  FakeSurroundings fake;
  testing_support::CameraFaults faults;
  faults.bad_data_chance = 0.04;
  faults.lost_chance = 0.04;
  testing_support::FaultyCamera camera(std::make_unique<memory::MemoryCamera>(fake.clock), faults, 42);
  Report report;
  check_camera(lower(), camera, 20, fake.surroundings(), report);
  EXPECT_NE(row_of(report, "lower", "lost frames").verdict, Verdict::kOk);
  EXPECT_EQ(row_of(report, "lower", "rate").verdict, Verdict::kOk);
  EXPECT_EQ(row_of(report, "lower", "mirror").verdict, Verdict::kWarning) << "the test pattern shows no mirror";
}

// ---- pairs

struct PairCase {
  const char* name;
  CameraTruth lower, upper;
  std::chrono::milliseconds max_skew;
  const char* check;
  Verdict verdict;
  const char* advice;
  double rate_hz = 25;
};
void PrintTo(const PairCase& c, std::ostream* out) { *out << c.name; }

class PairsOfCameras : public testing::TestWithParam<PairCase> {};

Report checked(const PairCase& c) {
  FakeSurroundings fake;
  CameraSettings asked = kAsked;
  asked.rate_hz = c.rate_hz;
  const auto streams = std::make_shared<int>(0);
  Report report;
  check_pair(
      {asked, asked, c.max_skew, 500ms},
      [&](std::chrono::nanoseconds max_skew) -> Result<StereoRig> {
        return StereoRig(std::make_unique<BenchCamera>(fake.clock, c.lower, streams),
                         std::make_unique<BenchCamera>(fake.clock, c.upper, streams), max_skew);
      },
      kSeconds, fake.surroundings(), report);
  EXPECT_EQ(*streams, 0) << "streams on";
  return report;
}

TEST_P(PairsOfCameras, AreJudged) {
  const PairCase& c = GetParam();
  const Row row = row_of(checked(c), "pair", c.check);
  EXPECT_EQ(row.verdict, c.verdict) << row.check << ": " << row.measured;
  EXPECT_THAT(row.advice, HasSubstr(c.advice)) << row.measured;
}

// Waiting for a pair that the limit excludes takes real time.
INSTANTIATE_TEST_SUITE_P(
    Each, PairsOfCameras,
    testing::Values(
        PairCase{"together_pairs", {}, {.phase_s = 0.001}, 10ms, "pairs", Verdict::kOk, ""},
        PairCase{"together_unpaired", {}, {.phase_s = 0.001}, 10ms, "unpaired", Verdict::kOk, ""},
        PairCase{"together_skew", {}, {.phase_s = 0.001}, 10ms, "skew", Verdict::kOk, ""},
        PairCase{"free_within_limit", {}, {.phase_s = 0.007}, 10ms, "skew", Verdict::kWarning, "max_skew_s: 0.024 "},
        PairCase{"free_with_a_wide_limit", {}, {.phase_s = 0.007}, 24ms, "skew", Verdict::kOk, ""},
        PairCase{"goes_away", {}, {.dies_after = 30}, 20ms, "stream", Verdict::kFailed, "cable"},
        PairCase{"does_not_start",
                 {},
                 {.started = Error{ErrorCode::kRefused, "no bandwidth"}},
                 20ms,
                 "stream",
                 Verdict::kFailed,
                 "one bus"},
        PairCase{"one_drifts", {}, {.rate_hz = 24.2}, 10ms, "unpaired", Verdict::kWarning, "skew"},
        PairCase{"one_drifts_skew", {}, {.rate_hz = 24.2}, 10ms, "skew", Verdict::kFailed, "max_skew_s: 0.024 "},
        PairCase{"slower_than_the_wheels_wait",
                 {.rate_hz = 1.6},
                 {.rate_hz = 1.6},
                 10ms,
                 "longest wait",
                 Verdict::kWarning,
                 "command_timeout_s",
                 1.6},
        PairCase{"fast_enough", {}, {}, 10ms, "longest wait", Verdict::kOk, ""}),
    [](const auto& each) { return each.param.name; });

TEST(DoctorPair, RowsOfNoPairAtAll) {
  const PairUnderTest test{kAsked, kAsked, 4ms, 500ms};
  EXPECT_EQ(judge_pairs({.unpaired = 90}, test).at(0).verdict, Verdict::kFailed);
  EXPECT_EQ(judge_skew({.unpaired = 90}, test).verdict, Verdict::kFailed);
  // A wide limit then shows synchronised cameras beyond a limit that is too tight for them.
  const PairUnderTest tight{kAsked, kAsked, 500us, 500ms};
  const Row row = judge_skew({.skews_s = {0.0011, 0.0012, 0.0013}}, tight);
  EXPECT_EQ(row.verdict, Verdict::kFailed);
  EXPECT_THAT(row.advice, HasSubstr("max_skew_s: 0.002"));
}

TEST(DoctorPair, SkewBeyondTheLimitIsMeasuredWithAWideOne) {
  const Report report = checked(PairCase{"", {}, {.phase_s = 0.0131}, 10ms, "", Verdict::kOk, ""});
  EXPECT_EQ(row_of(report, "pair", "pairs").verdict, Verdict::kFailed);
  const Row skew = row_of(report, "pair", "skew");
  EXPECT_EQ(skew.verdict, Verdict::kFailed);
  EXPECT_THAT(skew.measured, HasSubstr("13.1 ms"));
  EXPECT_THAT(skew.advice, HasSubstr("max_skew_s: 0.024 (0.6 of a period)"));
}

}  // namespace
}  // namespace twocone::doctor
