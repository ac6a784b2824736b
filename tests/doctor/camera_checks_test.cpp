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

const CameraCase kCameraCases[] = {
    {"another_size", {.narrower_px = 4}, "format", kFailed, "width_px: 156"},
    {"another_rate", {.reported_rate_hz = 30}, "format", kWarning, "rate_hz: 30"},
    {"control_ignored", {.controls = {{"gain", 7}}}, "control", kWarning, "gain: 7"},
    {"control_not_reported", {.controls = {{"hue", 7}}}, "control", kWarning, "image"},
    {"does_not_start",
     {.started = Error{ErrorCode::kRefused, "busy; end the other program"}},
     "stream",
     kFailed,
     "program"},
    {"too_slow", {.rate_hz = 23.1}, "rate", kFailed, "rate_hz: 23.1"},
    {"too_fast", {.rate_hz = 27.3}, "rate", kFailed, "rate_hz: 27.3"},
    {"just_right", {.rate_hz = 24.1}, "rate", kOk, ""},
    {"times_stand_still", {.stands_still = true}, "rate", kFailed, "no capture times"},
    {"trembles", {.jitter_s = 0.017}, "jitter", kWarning, "load"},
    {"trembles_little", {.jitter_s = 0.006}, "jitter", kOk, ""},
    {"loses_few", {.lose_every = 17}, "lost frames", kWarning, "cable"},
    {"loses_few_and_keeps_its_rate", {.lose_every = 17}, "rate", kOk, ""},
    {"loses_many", {.lose_every = 3}, "lost frames", kFailed, "cable"},
    {"damages", {.damage_every = 23}, "lost frames", kWarning, "cable"},
    {"skips", {.skip_every = 9}, "lost frames", kWarning, "busy"},
    {"old", {.age_s = 0.093}, "age", kWarning, "frame periods"},
    {"from_the_future", {.age_s = -0.02}, "age", kWarning, "future"},
    {"goes_away", {.dies_after = 40}, "stream", kFailed, "was disconnected"},
    {"falls_silent",
     {.dies_after = 40, .death = {ErrorCode::kTimeout, "no frame"}},
     "stream",
     kFailed,
     "sends nothing"},
    {"sends_nothing",
     {.dies_after = 0, .death = {ErrorCode::kTimeout, "no frame"}},
     "stream",
     kFailed,
     "sends nothing"},
    {"dark", {.image = image_of({.inside = 3, .outside = 3})}, "exposure", kFailed, "lens cap"},
    {"cut_off", {.image = {160, 120, PixelFormat::kRgb8, {1, 2, 3}}}, "image", kFailed, "cable"}};

INSTANTIATE_TEST_SUITE_P(Each, Cameras, testing::ValuesIn(kCameraCases),
                         [](const auto& each) { return each.param.name; });

TEST(DoctorCamera, ThatIsInOrderIsOk) {
  const Report report = checked({});
  EXPECT_EQ(report.count(kOk), report.rows().size()) << table(report);
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
  EXPECT_NE(row_of(report, "lower", "lost frames").verdict, kOk);
  EXPECT_EQ(row_of(report, "lower", "rate").verdict, kOk);
  EXPECT_EQ(row_of(report, "lower", "mirror").verdict, kWarning) << "the test pattern shows no mirror";
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
const PairCase kPairCases[] = {
    {"together_pairs", {}, {.phase_s = 0.001}, 10ms, "pairs", kOk, ""},
    {"together_unpaired", {}, {.phase_s = 0.001}, 10ms, "unpaired", kOk, ""},
    {"together_skew", {}, {.phase_s = 0.001}, 10ms, "skew", kOk, ""},
    {"free_within_limit", {}, {.phase_s = 0.007}, 10ms, "skew", kWarning, "max_skew_s: 0.024 "},
    {"free_with_a_wide_limit", {}, {.phase_s = 0.007}, 24ms, "skew", kOk, ""},
    {"goes_away", {}, {.dies_after = 30}, 20ms, "stream", kFailed, "cable"},
    {"does_not_start", {}, {.started = Error{ErrorCode::kRefused, "no bandwidth"}}, 20ms, "stream", kFailed, "one bus"},
    {"one_drifts", {}, {.rate_hz = 24.2}, 10ms, "unpaired", kWarning, "skew"},
    {"one_drifts_skew", {}, {.rate_hz = 24.2}, 10ms, "skew", kFailed, "max_skew_s: 0.024 "},
    {"slower_than_the_wheels_wait",
     {.rate_hz = 1.6},
     {.rate_hz = 1.6},
     10ms,
     "longest wait",
     kWarning,
     "command_timeout_s",
     1.6},
    {"fast_enough", {}, {}, 10ms, "longest wait", kOk, ""}};

INSTANTIATE_TEST_SUITE_P(Each, PairsOfCameras, testing::ValuesIn(kPairCases),
                         [](const auto& each) { return each.param.name; });

TEST(DoctorPair, RowsOfNoPairAtAll) {
  const PairUnderTest test{kAsked, kAsked, 4ms, 500ms};
  EXPECT_EQ(judge_pairs({.unpaired = 90}, test).at(0).verdict, kFailed);
  EXPECT_EQ(judge_skew({.unpaired = 90}, test).verdict, kFailed);
  // A wide limit then shows synchronised cameras beyond a limit that is too tight for them.
  const PairUnderTest tight{kAsked, kAsked, 500us, 500ms};
  const Row row = judge_skew({.skews_s = {0.0011, 0.0012, 0.0013}}, tight);
  EXPECT_EQ(row.verdict, kFailed);
  EXPECT_THAT(row.advice, HasSubstr("max_skew_s: 0.002"));
}

TEST(DoctorPair, SkewBeyondTheLimitIsMeasuredWithAWideOne) {
  const Report report = checked(PairCase{"", {}, {.phase_s = 0.0131}, 10ms, "", kOk, ""});
  EXPECT_EQ(row_of(report, "pair", "pairs").verdict, kFailed);
  const Row skew = row_of(report, "pair", "skew");
  EXPECT_EQ(skew.verdict, kFailed);
  EXPECT_THAT(skew.measured, HasSubstr("13.1 ms"));
  EXPECT_THAT(skew.advice, HasSubstr("max_skew_s: 0.024 (0.6 of a period)"));
}

}  // namespace
}  // namespace twocone::doctor
