// SPDX-License-Identifier: Apache-2.0
// Runs on devices that fail on the way: in memory, in real time, behind bad cables.
#include <atomic>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/runlog/summary/summary.h"
#include "apps/runs/run.h"
#include "drivers/memory/memory.h"
#include "tests/support/faulty_camera.h"
#include "tests/support/faulty_diffdrive.h"
#include "tests/support/memory_robot.h"
#include "tests/support/real_time_camera.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr int kFrames = 12;
constexpr std::uint64_t kGoesAfter = 5;

class DeviceRun : public testing::Test {
 protected:
  /// @param changes beside the rate of the cameras
  void write_robot(std::vector<std::pair<std::string, std::string>> changes = {}) const {
    changes.emplace_back("rate_hz: 15", "rate_hz: 50");
    testing_support::write_memory_robot(file_, changes);
  }

  void SetUp() override {
    write_robot();
    options_.frames = kFrames;
    options_.method = estimation::Method::kPaper;
    options_.out = temporary_.path() / "run";
    options_.notify = [this](const std::string& event) { told_.push_back(event); };
    options_.open = [this](const drivers::RobotSettings& settings) -> Result<Robot> {
      auto lower = std::make_unique<testing_support::FaultyCamera>(std::make_unique<testing_support::RealTimeCamera>(),
                                                                   lower_faults_, 1);
      auto upper = std::make_unique<testing_support::RealTimeCamera>();
      auto drive = std::make_unique<testing_support::FaultyDiffDrive>(
          std::make_unique<memory::MemoryDiffDrive>(clock_, settings.drive.limits), drive_faults_, 2);
      return Robot(StereoRig(std::move(lower), std::move(upper), 10ms), std::move(drive), nullptr);
    };
  }

  Result<runlog::RunInfo> go() {
    const config::Robot robot = config::read_robot(file_);
    return run(
        robot, config::read_map(robot.map), options_, [](double) {}, stop_);
  }

  /// All but the warnings about rims, of which test patterns have none.
  [[nodiscard]] std::vector<std::string> told() const {
    std::vector<std::string> events;
    for (const std::string& event : told_) {
      if (!event.starts_with("warning: ") && !event.starts_with("note: ")) events.push_back(event);
    }
    return events;
  }

  const testing_support::TemporaryFolder temporary_;
  const std::filesystem::path file_ = temporary_.path() / "robot.yaml";
  std::shared_ptr<const SteadyClock> clock_ = std::make_shared<const SteadyClock>();
  testing_support::CameraFaults lower_faults_;
  testing_support::DriveFaults drive_faults_;
  RunOptions options_;
  std::vector<std::string> told_;
  std::atomic<bool> stop_{false};
};

// Catches a run that waits for its own clock as well as for the devices'.
TEST_F(DeviceRun, RefusesRealTime) {
  options_.real_time = true;
  const auto info = go();
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().code, ErrorCode::kRefused);
  EXPECT_THAT(info.error().message, HasSubstr("real devices set the pace"));
}

TEST_F(DeviceRun, OutlivesACameraThatGoesAwayAndComesBack) {
  lower_faults_.disconnect_after = kGoesAfter;
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  // It goes away after as many frames again, and comes back each time.
  const auto events = told();
  ASSERT_GE(events.size(), 2U);
  EXPECT_THAT(events[0], AllOf(HasSubstr("lower: "), HasSubstr("the wheels are stopped")));
  EXPECT_THAT(events[1], HasSubstr("all is well again after"));
  const runlog::RunData run = runlog::read_run(options_.out);
  EXPECT_EQ(run.frames.size(), std::size_t(kFrames));
  ASSERT_TRUE(run.info.capture);
  EXPECT_GE(run.info.capture->recoveries, 1U);
  // No command is in force in the frame after the wheels were stopped.
  int rests = 0;
  for (std::size_t i = 1; i < run.drive.size(); ++i) {
    rests += run.drive[i].left_command_radps == 0 && run.drive[i].right_command_radps == 0;
  }
  EXPECT_GE(std::uint64_t(rests), run.info.capture->recoveries);
  EXPECT_LT(rests, kFrames - 1) << "it never drove, so nothing was tried";
}

// Catches requests that outlive the person: a page that was closed must not leave the wheels turning.
TEST_F(DeviceRun, APersonDrivesAndARequestGrowsOld) {
  constexpr int kLong = 50;  // one second, of which a request is valid for 0.3
  RemoteControl remote;
  options_.frames = kLong;
  options_.behaviour = "manual";
  options_.remote = &remote;
  int finished = 0;
  options_.finished = [&](const FinishedFrame& frame, const LiveFigures& figures) {
    EXPECT_EQ(frame.record.frame.frame, std::uint64_t(finished++));
    EXPECT_GE(figures.age_s, 0);
    EXPECT_FALSE(figures.late_frames);
    if (finished == 5) remote.drive({.speed = 0.5, .turn = -0.25});
  };
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  const runlog::RunData run = runlog::read_run(options_.out);
  std::vector<double> driven_at_s;
  for (const runlog::DriveRow& row : run.drive) {
    if (*row.left_command_radps != 0) driven_at_s.push_back(row.t_s);
    // To the right: the left wheel is the faster one.
    EXPECT_TRUE(*row.left_command_radps == 0 || *row.left_command_radps > *row.right_command_radps);
  }
  ASSERT_GT(driven_at_s.size(), 5U);
  constexpr double kFramesLate_s = 0.1;
  const double valid_s = std::chrono::duration<double>(RemoteControl::kValid).count();
  EXPECT_NEAR(driven_at_s.back() - driven_at_s.front(), valid_s, kFramesLate_s);
  EXPECT_EQ(*run.drive.back().left_command_radps, 0);
}

TEST_F(DeviceRun, APersonStopsTheWheelsOfAnyBehaviour) {
  RemoteControl remote;
  options_.frames = 3 * kFrames;
  options_.remote = &remote;
  int finished = 0;
  options_.finished = [&](const FinishedFrame&, const LiveFigures&) {
    if (++finished == kFrames) remote.hold(true);
    if (finished == 2 * kFrames) remote.hold(false);
  };
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  const runlog::RunData run = runlog::read_run(options_.out);
  const auto moves = [&](std::size_t row) { return *run.drive[row].left_command_radps != 0; };
  EXPECT_TRUE(moves(kFrames - 2));
  EXPECT_FALSE(moves(2 * kFrames - 2));
  EXPECT_TRUE(moves(3 * kFrames - 2));
  EXPECT_THAT(told(), Contains(HasSubstr("a person stopped the wheels")));
  EXPECT_THAT(told(), Contains(HasSubstr("a person freed the wheels")));
}

TEST_F(DeviceRun, ManualNeedsAPerson) {
  options_.behaviour = "manual";
  EXPECT_THROW((void)go(), std::invalid_argument);
}

TEST_F(DeviceRun, WritesTelemetryBesideTheTables) {
  options_.telemetry = true;
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  const runlog::RunData run = runlog::read_run(options_.out);
  EXPECT_TRUE(run.info.telemetry);
  std::ifstream file(options_.out / "telemetry.jsonl");
  std::vector<nlohmann::json> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(lines.size(), 1U + kFrames);
  EXPECT_EQ(lines[0]["schema"], "twocone.telemetry/1");
  EXPECT_EQ(lines[0]["name"], "run");
  EXPECT_FALSE(lines[0]["sensors"]["truth"]);
  EXPECT_TRUE(lines[0]["sensors"]["skew"]);
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    EXPECT_EQ(lines[i + 1]["frame"], run.frames[i].frame);
    EXPECT_EQ(lines[i + 1]["t_s"], run.frames[i].t_s);
    EXPECT_EQ(lines[i + 1]["drive"]["left_rad"], run.drive[i].left_rad);
  }
}

// On the images of one run both methods; who has the budget has verdicts, and an event if one of them is `over`.
TEST_F(DeviceRun, TellsWhatEachFramesAnswerTook) {
  options_.method = estimation::Method::kOutline;
  config::Robot robot = estimation::with_budget(config::read_robot(file_), estimation::Method::kOutline, 0.02);
  const auto info = run(
      robot, config::read_map(robot.map), options_, [](double) {}, stop_);
  ASSERT_TRUE(info) << info.error().message;
  const runlog::RunData full = runlog::read_run(options_.out);
  ASSERT_EQ(full.timing.size(), std::size_t(kFrames));
  EXPECT_EQ(full.robot.estimator, robot.estimator);
  int over = 0;
  for (const runlog::TimingRow& row : full.timing) {
    EXPECT_TRUE(row.verdict == "kept" || row.verdict == "over") << row.verdict;
    over += row.verdict == "over";
  }
  int told_of = 0;
  for (const std::string& event : full.info.events) told_of += event.starts_with("over time budget: ");
  EXPECT_EQ(told_of, over > 0 ? 1 : 0);
  const runlog::RunData paper = runlog::read_run(options_.out, "paper");
  ASSERT_EQ(paper.timing.size(), std::size_t(kFrames));
  EXPECT_EQ(paper.timing[0].verdict, "");
  EXPECT_EQ(paper.timing.back().frame, std::uint64_t(kFrames - 1));
}

TEST_F(DeviceRun, AFailureThatLastsEndsItAndIsTold) {
  drive_faults_.disconnect_after = 4 * kGoesAfter;  // for good, and after the first frames were looked at
  options_.patience = 300ms;
  const auto info = go();
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(info.error().message, AllOf(HasSubstr("drive: "), HasSubstr("and so it stayed for 0.3 s")));
  const runlog::RunData run = runlog::read_run(options_.out);
  EXPECT_FALSE(run.info.finished);
  EXPECT_THAT(run.info.events.back(), HasSubstr("and so it stayed"));
}

TEST_F(DeviceRun, WritesWhatItHandledIntoItsLog) {
  lower_faults_.disconnect_after = kGoesAfter;
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  std::ifstream in(options_.out / "run.log");
  const std::string log{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(log, HasSubstr(" warning cameras: lower: disconnected; it will be started again\n"));
  EXPECT_THAT(log, ContainsRegex(" warning run: frame [0-9]+: lower: .*; tried again\n"));
  // The terminal gets the events alone.
  for (const std::string& event : told_) EXPECT_THAT(event, Not(HasSubstr("tried again")));
}

// There is no folder for a log, so the reasons would be lost.
TEST_F(DeviceRun, ThatFailsBeforeItsFirstFrameReportsItsLog) {
  lower_faults_.disconnect_after = 0;
  options_.patience = 0ms;
  EXPECT_FALSE(go());
  EXPECT_FALSE(std::filesystem::exists(options_.out));
  EXPECT_THAT(told(), Contains(HasSubstr(" warning cameras: lower: disconnected")));
}

// The folder of a start that failed barred the same command.
TEST_F(DeviceRun, ThatFailsBeforeItsFirstFrameLeavesNoFolder) {
  drive_faults_.disconnect_after = 0;
  options_.patience = 0ms;
  EXPECT_FALSE(go());
  EXPECT_FALSE(std::filesystem::exists(options_.out));
  drive_faults_ = {};
  const auto info = go();
  EXPECT_TRUE(info) << info.error().message;
}

TEST_F(DeviceRun, WithoutPatienceTheFirstFailureEndsIt) {
  lower_faults_.disconnect_after = kGoesAfter;
  options_.patience = 0ms;
  const auto info = go();
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(info.error().message, AllOf(StartsWith("frame "), HasSubstr(": lower: "), Not(HasSubstr("stayed"))));
}

TEST_F(DeviceRun, CanBeStoppedWhileItWaits) {
  drive_faults_.disconnect_after = kGoesAfter;
  options_.patience = 10min;
  options_.notify = [this](const std::string& event) {
    if (event.find("the wheels are stopped") != std::string::npos) stop_ = true;
  };
  const auto info = go();
  ASSERT_FALSE(info);
  EXPECT_THAT(info.error().message, HasSubstr("stopped from outside"));
}

// Catches a damaged image that ends the run, or gets into its tables.
TEST_F(DeviceRun, DamagedImagesAreTakenAgain) {
  lower_faults_.cut_chance = 0.3;
  lower_faults_.bad_data_chance = 0.1;
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  EXPECT_EQ(runlog::read_run(options_.out).frames.size(), std::size_t(kFrames));
  EXPECT_FALSE(told().empty()) << "nothing was damaged";
  for (const std::string& event : told()) EXPECT_THAT(event, HasSubstr("lower: "));
}

// Catches a program that goes on driving by an image from before its camera went away.
TEST_F(DeviceRun, AnImageOlderThanTheDeadManTimeMovesNoWheel) {
  write_robot({{"command_timeout_s: 0.5", "command_timeout_s: 0.001"}});  // no image is looked at so fast
  const auto info = go();
  ASSERT_TRUE(info) << info.error().message;
  ASSERT_EQ(told().size(), 1U);
  EXPECT_THAT(told()[0], HasSubstr("longer than command_timeout_s of 0.001 s: the wheels are stopped"));
  const runlog::RunData run = runlog::read_run(options_.out);
  const auto first_looked_at = std::size_t(run.robot.latency_frames) + 1;
  ASSERT_GT(run.drive.size(), first_looked_at);
  for (std::size_t i = first_looked_at; i < run.drive.size(); ++i) {
    EXPECT_EQ(run.drive[i].left_command_radps, 0) << i;
    EXPECT_EQ(run.drive[i].right_command_radps, 0) << i;
  }
}

TEST(Capture, IsSummarisedByHand) {
  runlog::RunData run;
  EXPECT_FALSE(runlog::summarise_capture(run)) << "a simulated robot has none";
  run.info.capture = runlog::CaptureCounts{1, 2, 3, 4};
  for (const double t_s : {0.0, 0.10, 0.20, 0.35, 0.45}) {
    runlog::FrameRow row;
    row.t_s = t_s;
    row.skew_s = t_s == 0.2 ? -0.03 : 0.01;
    row.lower_lost = 1;
    row.upper_lost = 2;
    run.frames.push_back(row);
  }
  const auto capture = runlog::summarise_capture(run);
  ASSERT_TRUE(capture);
  EXPECT_NEAR(capture->rate_hz, 10, 1e-9);
  EXPECT_NEAR(capture->jitter_p95_s, 0.05, 1e-12);
  EXPECT_NEAR(capture->skew_median_s, 0.01, 1e-15);
  EXPECT_NEAR(capture->skew_max_s, 0.03, 1e-15);
  EXPECT_EQ(capture->lower_lost, 5U);
  EXPECT_EQ(capture->upper_lost, 10U);
  EXPECT_EQ(capture->counts.unpaired, 3U);
}

}  // namespace
}  // namespace twocone::runs
