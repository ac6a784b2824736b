// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate/calibrate.h"

#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "tests/support/lab_robot.h"
#include "tests/vision/drive_among_landmarks.h"

namespace twocone::calibrate {
namespace {

using testing::HasSubstr;
using testing::Not;

config::Robot lab_robot() {
  config::Robot robot = testing_support::lab_robot("memory");
  robot.file = "robots/mine.yaml";
  return robot;
}

runlog::RunData run_of(int frames, double first_angle_rad = 0) {
  runlog::RunData run;
  run.folder = "runs/mine";
  run.robot = lab_robot();
  run.map.file = "scenes/room.map.yaml";
  run.map.bounds = {-3, 3, -3, 3};
  run.map.landmarks = {{"red", {1, 0, 0}, -2.4, 0.3, 0.1, 0.9}, {"blue", {0, 0, 1}, 1.1, 2.2, 0.12, 0.8}};
  for (int i = 0; i < frames; ++i) {
    runlog::FrameRow frame;
    frame.frame = std::uint64_t(i);
    frame.t_s = i / 15.0;
    run.frames.push_back(frame);
    run.drive.push_back({frame.t_s, 1, 1, first_angle_rad + 0.1 * i, first_angle_rad + 0.2 * i});
  }
  return run;
}

/// Returns a report for a world whose lower view differs from the belief. The results from images are invented.
Report report_of(bool still) {
  vision::DriveSettings world;
  vision::MirrorViewSettings lower = vision::lab_view(0.25);
  lower.centre_px += Eigen::Vector2d(2.2, -1.4);
  world.rig.lower = vision::MirrorView(lower);
  world.still = still;
  world.duration_s = 12;
  world.outlier_share = still ? 0 : 0.03;
  vision::CalibrationProblem problem{vision::lab_rig(),
                                     vision::WheelBelief{0.05, 0.30},
                                     world.landmarks,
                                     vision::drive_among_landmarks(world),
                                     {},
                                     {}};
  const config::Robot robot = lab_robot();
  Report report{.runs = {"runs/mine"},
                .robot = "robots/mine.yaml",
                .result = vision::calibrate(problem),
                .problem = problem,
                .circles = {},
                .before = problem.rig,
                .after = problem.rig,
                .rig = robot.rig,
                .drive = robot.drive,
                .slip = 0.01};
  if (report.result.rig) report.after = *report.result.rig;
  report.circles[0].rim = vision::RimMeasurement{{321.71, 238.12}, 236.04, 0.05, 0.06, 0.2, 0.93};
  return report;
}

TEST(CalibrateFrames, AreSpreadEvenlyWithAllWheelReadingsBetween) {
  const std::vector<runlog::RunData> runs{run_of(100), run_of(50, 7)};
  const ChosenFrames chosen = choose_frames(runs, 30);
  ASSERT_EQ(chosen.frames.size(), 30U);
  EXPECT_EQ(chosen.landmarks.size(), 2U) << "both runs are in one room";
  EXPECT_DOUBLE_EQ(chosen.landmarks[1].top_m, 0.8);
  std::size_t last = 0;
  for (std::size_t i = 0; i < 30; ++i) {
    const ChosenFrames::Frame& frame = chosen.frames[i];
    const bool second = i >= 20;
    EXPECT_EQ(frame.run, &runs[second ? 1 : 0]) << i;
    EXPECT_EQ(frame.first_landmark, 0U) << i;
    if (i == 0 || i == 20) {
      EXPECT_EQ(frame.row, 0U);
      EXPECT_TRUE(frame.wheels.empty()) << "the way from one run to another is unknown";
    } else {
      ASSERT_EQ(frame.wheels.size(), frame.row - last + 1) << i;
      EXPECT_DOUBLE_EQ(frame.wheels.front().left_rad, frame.run->drive[last].left_rad) << i;
      EXPECT_DOUBLE_EQ(frame.wheels.back().right_rad, frame.run->drive[frame.row].right_rad) << i;
    }
    last = frame.row;
  }
  EXPECT_EQ(chosen.frames[19].row, 99U);
  EXPECT_EQ(chosen.frames[29].row, 49U);
}

TEST(CalibrateFrames, AreAllFramesIfMoreAreRequested) {
  const std::vector<runlog::RunData> runs{run_of(7)};
  EXPECT_EQ(choose_frames(runs, 90).frames.size(), 7U);
}

TEST(Calibrate, RefusesInOneLine) {
  const auto message = [](std::vector<runlog::RunData> runs, const config::Robot& robot) -> std::string {
    const auto report = calibrate(runs, robot, {});
    return report ? "a report" : report.error().message;
  };
  if (!vision::can_calibrate()) {
    EXPECT_THAT(message({run_of(9)}, lab_robot()), HasSubstr("built without Ceres"));
    GTEST_SKIP() << "the other checks need Ceres, which is not in this build";
  }
  EXPECT_THAT(message({run_of(3)}, lab_robot()), HasSubstr("runs/mine has 3 frames, a calibration needs 4"));
  runlog::RunData one = run_of(9);
  one.map.landmarks.pop_back();
  EXPECT_THAT(message({one}, lab_robot()), HasSubstr("1 of 1 landmarks have a height"));
  config::Robot other = lab_robot();
  other.upper.settings.width_px = 800;
  EXPECT_THAT(message({run_of(9)}, other), HasSubstr("images of another size than robots/mine.yaml says"));
  const std::string no_image = message({run_of(9)}, lab_robot());
  EXPECT_THAT(no_image, HasSubstr("runs/mine/lower/000000.png"));
  EXPECT_THAT(no_image, Not(HasSubstr("\n")));
  EXPECT_THROW((void)calibrate({}, lab_robot(), {}), std::invalid_argument);
}

class CalibrateReport : public testing::Test {
 protected:
  void SetUp() override {
    if (!vision::can_calibrate()) GTEST_SKIP() << "this needs Ceres, which is not in this build";
  }
};

TEST_F(CalibrateReport, TableSaysWhatWasFoundAndWhatWasNot) {
  const std::string text = table(report_of(true));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("twocone")) continue;  // the compiler's name has any length
    EXPECT_LE(line.size(), 110U) << line;
  }
  EXPECT_THAT(text, testing::ContainsRegex("lower.centre.column +px +319.5[0-9]* +321.[67]"));
  EXPECT_THAT(text, testing::ContainsRegex("wheel_radius +mm +50.[0-9]+ +kept +1.5[0-9]* +not observed"));
  EXPECT_THAT(text, testing::ContainsRegex("lower.azimuth +deg +0.0[0-9]* +kept"));
  EXPECT_THAT(text, HasSubstr("rim centre (321.71, 238.12) +- 0.05, radius 236.04 +- 0.06 px, 93 % of it seen"));
  EXPECT_THAT(text, HasSubstr("upper   no rim is seen"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST_F(CalibrateReport, JsonHoldsEveryParameterOnce) {
  const Report report = report_of(false);
  const auto json = nlohmann::json::parse(to_json(report));
  ASSERT_EQ(json["parameters"].size(), report.result.parameters.size());
  std::set<std::string> names;
  for (const auto& p : json["parameters"]) {
    names.insert(p["name"].get<std::string>());
    for (const char* field : {"before", "after", "sigma", "prior_sigma", "change_in_sigmas"}) {
      EXPECT_TRUE(p[field].is_number()) << p;
    }
    if (p["name"] == "lower.centre_px.column") {
      EXPECT_TRUE(p["observed"].get<bool>());
      EXPECT_NEAR(p["after"].get<double>(), 321.7, 4 * p["sigma"].get<double>());
    }
  }
  EXPECT_EQ(names.size(), report.result.parameters.size());
  EXPECT_TRUE(names.contains("upper.axis_offset_m.x"));
  EXPECT_GT(json["views"]["lower"]["rms_before_px"].get<double>(),
            3 * json["views"]["lower"]["rms_after_px"].get<double>());
}

TEST_F(CalibrateReport, FigureDrawsEachSightingBeforeAndAfter) {
  const Report report = report_of(false);
  const std::string svg = residual_figure(report, vision::Side::kLower);
  const auto count = [&svg](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = svg.find(part); at != std::string::npos; at = svg.find(part, at + 1)) ++found;
    return found;
  };
  std::size_t lower = 0;
  std::size_t outliers = 0;
  for (const vision::SightingResidual& r : report.result.residuals) {
    if (report.problem.frames[r.frame].sightings[r.sighting].side != vision::Side::kLower) continue;
    ++lower;
    outliers += r.outlier ? 1 : 0;
  }
  EXPECT_EQ(count("r=\"1.2\""), 2 * lower);
  EXPECT_EQ(count("stroke=\"#cc3311\""), 2 * outliers);
  EXPECT_GT(outliers, 0U);
  EXPECT_THAT(svg, HasSubstr("before: rms"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

}  // namespace
}  // namespace twocone::calibrate
