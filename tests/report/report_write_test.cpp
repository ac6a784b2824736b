// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/report/report.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/report/synthetic_run.h"
#include "tests/support/error_of.h"
#include "tests/support/page_data.h"

namespace twocone::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The error budget is tested in tests/error_budget. Here it has few draws, so that a report is quick.
ReportSettings quick() {
  ReportSettings settings;
  settings.error_budget_draws = 2;
  settings.error_budget_pose_step = 1000;
  return settings;
}

/// Writes the report and returns the data of its page.
Json written(const runlog::RunData& run) {
  const Result<ReportResult> report = write_report(run, quick());
  if (!report) {
    ADD_FAILURE() << report.error().message;
    return {};
  }
  EXPECT_EQ(report->html, run.folder / "report.html");
  Json data = testing_support::page_data<Json>(content_of(report->html));
  EXPECT_EQ(data["page"], "report");
  EXPECT_EQ(data["notes"].get<std::vector<std::string>>(), report->notes);
  return data;
}

std::vector<std::string> notes_of(const Json& data) { return data["notes"]; }

/// Half of the last of five digits, relatively, if the first one is 1.
constexpr double kFewDigits = 0.5e-4;
/// Likewise of eight digits.
constexpr double kDigits = 0.5e-7;

void expect_number(const Json& found, std::optional<double> wanted, double tolerance = kDigits) {
  ASSERT_EQ(found.is_null(), !wanted);
  if (!wanted) return;
  EXPECT_NEAR(found.get<double>(), *wanted, 1.001 * tolerance * std::abs(*wanted));
}

TEST(WriteReport, GivesTheNumbersOfTheTables) {
  const ScratchFolder scratch;
  const runlog::RunData run = outline_run(synthetic_run(scratch.path(), 120, 40));
  const Json data = written(run);
  EXPECT_EQ(data["summary"], Json::parse(runlog::to_json(runlog::summarise(run), run.info)));
  ASSERT_EQ(data["frame"].size(), run.frames.size());
  ASSERT_EQ(data["fixes"]["frame"].size(), run.fixes.size());
  for (std::size_t i = 0; i < run.fixes.size(); ++i) {
    EXPECT_EQ(data["fixes"]["frame"][i], run.fixes[i].frame);
    EXPECT_EQ(data["fixes"]["verdict"][i], run.fixes[i].verdict);
    expect_number(data["fixes"]["x_m"][i], run.fixes[i].x_m);
    expect_number(data["fixes"]["error_m"][i], run.fixes[i].error_m, kFewDigits);
    expect_number(data["fixes"]["cov_xy_m2"][i], run.fixes[i].cov_xy_m2, kFewDigits);
  }
  for (std::size_t i = 0; i < run.ranges.size(); ++i) {
    const std::size_t landmarks = run.map.landmarks.size();
    const Json& landmark = data["landmarks"][i % landmarks];
    ASSERT_EQ(landmark["name"], run.ranges[i].landmark);
    EXPECT_EQ(landmark["verdict"][i / landmarks], run.ranges[i].verdict);
    expect_number(landmark["range_m"][i / landmarks], run.ranges[i].range_m);
    expect_number(landmark["true_range_m"][i / landmarks], run.ranges[i].true_range_m);
    expect_number(landmark["sigma_range_m"][i / landmarks], run.ranges[i].sigma_range_m, kFewDigits);
  }
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    expect_number(data["truth"]["y_m"][i], run.truth[i].y_m);
    expect_number(data["odometry"]["x_m"][i], run.odometry[i].x_m);
  }
  EXPECT_EQ(data["frames"].size(), run.frames.size());
  EXPECT_EQ(data["images"].size(), 3U);
  EXPECT_EQ(data["landmarks"][1]["paper"]["figure"], 12);
  EXPECT_EQ(data["paper"]["position_mean_mm"], 29.97);
  EXPECT_THAT(data["repeat"]["command"].get<std::string>(),
              HasSubstr("--behaviour wander --frames 120 --method outline"));
}

TEST(WriteReport, HasBoundsAndTheErrorBudgetBesideTheErrors) {
  const ScratchFolder scratch;
  const runlog::RunData run = outline_run(synthetic_run(scratch.path(), 60));
  const Json data = written(run);
  EXPECT_EQ(data["has_bounds"], true);
  const std::vector<runlog::FrameBound> bounds = runlog::bounds(run);
  const Eigen::Matrix3d& covariance = bounds.at(7).covariance.value();
  expect_number(data["bound_m"][7], std::sqrt(covariance(0, 0) + covariance(1, 1)), kFewDigits);
  const Json& budget = data["error_budget"];
  EXPECT_EQ(budget["noise_measured"], true);
  EXPECT_NEAR(budget["edge_noise_px"].get<double>(), 0.08, 1e-12);
  EXPECT_EQ(budget["lines"][0]["source"], "all together");
  EXPECT_GT(budget["lines"][1]["range"]["analytic_m"].get<double>(), 0);

  const Json paper = written(synthetic_run(scratch.path(), 20));
  EXPECT_EQ(paper["has_bounds"], false);
  EXPECT_FALSE(paper.contains("bound_m"));
  EXPECT_EQ(paper["error_budget"]["noise_measured"], false);
  EXPECT_GT(paper["landmarks"][0]["rounding_error_m"].get<double>(), 0);
}

TEST(WriteReport, GivesTheSameBytesForTheSameRun) {
  const ScratchFolder scratch;
  const runlog::RunData run = synthetic_run(scratch.path(), 30, 10);
  written(run);
  const std::string first = content_of(scratch.path() / "report.html");
  written(run);
  EXPECT_EQ(first, content_of(scratch.path() / "report.html"));
}

TEST(WriteReport, NeedsNoOtherFileAndShowsTheTableWithoutScripts) {
  const ScratchFolder scratch;
  const runlog::RunData run = synthetic_run(scratch.path(), 20, 10);
  written(run);
  const std::string html = content_of(scratch.path() / "report.html");
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "url(http"}) {
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  }
  std::vector<std::string> notes;
  const std::string table = table_of(run, notes);
  const std::string line = table.substr(0, table.find('\n'));
  const std::size_t noscript = html.find("<noscript>");
  EXPECT_LT(html.find(line, noscript), html.find("</noscript>")) << line;
}

// The paper's matches of figure 9 must lie where the image shows the landmarks.
TEST(WriteReport, FindsTheMatchesOfThePaper) {
  const ScratchFolder scratch;
  const runlog::RunData run = synthetic_run(scratch.path(), 120, 1);
  const Json data = written(run);
  const Json& disparity = data["disparity"];
  const auto radius = [&](const Json& px) {
    return std::hypot(px[0].get<double>() - disparity["centre_px"][0].get<double>(),
                      px[1].get<double>() - disparity["centre_px"][1].get<double>());
  };
  int matches = 0;
  for (const Json& match : disparity["matches"]) {
    if (match["verdict"] != "ok") continue;
    ++matches;
    EXPECT_GT(radius(match["lower_px"]), radius(match["upper_px"])) << match["landmark"];
  }
  EXPECT_GE(matches, 3);
  ASSERT_EQ(data["panoramas"].size(), 3U);
  EXPECT_FALSE(data["panoramas"][2]["marks"].empty());
  EXPECT_THAT(data["panoramas"][2]["upper"].get<std::string>(), testing::StartsWith("data:image/jpeg;base64,"));
}

TEST(WriteReport, HasNoErrorWithoutTruth) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 60, 20);
  remove_truth(run);
  const Json data = written(run);
  EXPECT_EQ(data["has_truth"], false);
  EXPECT_FALSE(data.contains("truth"));
  EXPECT_TRUE(data["fixes"]["error_m"][1].is_null());
  EXPECT_FALSE(data["landmarks"][0].contains("rounding_error_m"));
  EXPECT_THAT(notes_of(data), Contains(HasSubstr("no ground truth")));
}

TEST(WriteReport, HandlesWhatIsMissing) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 20);
  run.odometry.clear();
  run.drive.clear();
  run.map.scene = scratch.path() / "gone.pov";
  for (runlog::FixRow& fix : run.fixes) {
    fix.verdict = "too_few";
    fix.x_m = fix.y_m = fix.error_m = std::nullopt;
  }
  run.info.finished = false;
  run.info.frames_wanted = 450;
  run.info.events = {"The lower camera was disconnected after 2.6 s."};
  const Json data = written(run);
  EXPECT_FALSE(data.contains("odometry"));
  EXPECT_FALSE(data.contains("overhead"));
  EXPECT_TRUE(data["disparity"].is_null());
  EXPECT_TRUE(data["images"].empty());
  EXPECT_EQ(data["finished"], false);
  EXPECT_EQ(data["summary"]["fix"]["frames_with_fix"], 0);
  EXPECT_EQ(data["events"][0], "The lower camera was disconnected after 2.6 s.");
  EXPECT_THAT(notes_of(data), Contains(HasSubstr("gone.pov")));
  EXPECT_THAT(notes_of(data), Contains(HasSubstr("no images")));
}

TEST(WriteReport, HandlesOneFrameAndNone) {
  for (const int frames : {1, 0}) {
    const ScratchFolder scratch;
    const Json data = written(synthetic_run(scratch.path(), frames, 1));
    EXPECT_EQ(data["frame"].size(), std::size_t(frames));
    EXPECT_EQ(data["summary"]["frames"], frames);
    EXPECT_EQ(data["images"].size(), std::size_t(frames));
  }
}

TEST(WriteReport, HasBothAnswersOfAnAmbiguousFrame) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 30);
  runlog::FixRow second = run.fixes[7];
  run.fixes[7].verdict = second.verdict = "ambiguous";
  second.error_m = 9.0;
  run.fixes.insert(run.fixes.begin() + 8, second);
  const Json data = written(run);
  EXPECT_EQ(data["fixes"]["frame"].size(), 31U);
  EXPECT_EQ(data["fixes"]["error_m"][8], 9.0);
  EXPECT_EQ(data["summary"]["fix"]["position_error"]["max_m"], 9.0) << "the worse answer counts";
}

// Only every n-th frame of a long run has its images and all of its telemetry; the figures have every frame.
TEST(WriteReport, HasEveryFrameOfALongRunInItsFigures) {
  const ScratchFolder scratch;
  const Json data = written(synthetic_run(scratch.path(), 1000));
  EXPECT_EQ(data["every"], 4);
  EXPECT_EQ(data["frames"].size(), 250U);
  EXPECT_EQ(data["frame"].size(), 1000U);
  EXPECT_EQ(data["landmarks"][0]["range_m"].size(), 1000U);
}

TEST(WriteReport, HasTheBaselineOrNotesThatItCannotBeRead) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 10);
  EXPECT_FALSE(written(run).contains("baseline"));
  run.method = "outline";
  std::filesystem::create_directories(scratch.path() / "methods" / "paper");
  EXPECT_THAT(notes_of(written(run)), Contains(HasSubstr("The baseline, method paper, cannot be read")));
}

TEST(WriteReport, ReportsTheTimesOfVisionAndLocalisation) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 3);
  EXPECT_EQ(written(run)["repeat"]["exact"], true);
  run.method = "outline";
  run.robot.estimator.stage = "adaptive";
  run.robot.estimator.budget_s = 0.02;
  for (const runlog::FrameRow& frame : run.frames) {
    run.timing.push_back({frame.frame, frame.t_s, 0.01234, 0.000567, 0.0131, 3, "kept"});
  }
  const Json data = written(run);
  EXPECT_EQ(data["repeat"]["exact"], false) << "a time budget is never repeated exactly";
  EXPECT_THAT(data["facts"].dump(), HasSubstr("vision median 12.34 ms, localisation median 0.57 ms"));
  EXPECT_THAT(data["facts"].dump(), HasSubstr("time budget of 20 ms kept in 3 of 3 frames\""));
}

// A user chooses the names: each may reach a page as a name only.
TEST(WriteReport, TakesAnyNameAsAName) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 30, 10);
  const std::vector<std::string> names{
      "<b>&\"quoted\"", "</script><script>alert(1)</script>", "../../up", "<!--", "gr\u00fcn \xFF\n\x01", ""};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string old = run.map.landmarks[i].name;
    run.map.landmarks[i].name = names[i];
    for (runlog::RangeRow& row : run.ranges) {
      if (row.landmark == old) row.landmark = names[i];
    }
  }
  run.robot.name = run.info.compiler = "</title><script>alert(1)</script>";
  run.info.events = {"<img src=x>"};
  const Json data = written(run);
  EXPECT_EQ(data["landmarks"][1]["name"], names[1]);
  EXPECT_EQ(data["landmarks"][4]["name"], "gr\u00fcn \uFFFD\n\x01");
  const std::string html = content_of(scratch.path() / "report.html");
  EXPECT_EQ(html.find("<script>alert"), std::string::npos);
  EXPECT_EQ(html.find("<img"), std::string::npos);
  EXPECT_EQ(html.find("<!--", html.find("<body>")), std::string::npos);
}

TEST(WriteReport, KeepsAndReusesTheImageFromAbove) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 20);
  run.map.scene = scratch.path() / "gone.pov";  // so that rendering would fail and be noted
  std::filesystem::create_directories(scratch.path() / "figures");
  const auto cache = scratch.path() / "figures" / "overhead.png";
  runlog::write_image(cache, {1000, 836, PixelFormat::kGrey8, std::vector<std::uint8_t>(836'000, 90)});
  const Json data = written(run);
  EXPECT_THAT(notes_of(data), Not(Contains(HasSubstr("gone.pov"))));
  EXPECT_TRUE(data.contains("overhead"));

  runlog::write_image(cache, {1000, 600, PixelFormat::kGrey8, std::vector<std::uint8_t>(600'000, 90)});
  EXPECT_THAT(notes_of(written(run)), Contains(HasSubstr("gone.pov"))) << "the image of another room was used";
}

// The image is neither mirrored nor turned: world x points to the right, y up.
TEST(WriteReport, PutsTheRenderedArenaTheRightWayRound) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 3);
  run.map.scene = scratch.path() / "plate.pov";
  run.map.unit_m = 0.1;
  std::ofstream(*run.map.scene)
      << "#version 3.7;\nglobal_settings { assumed_gamma 1 }\nbackground { rgb 1 }\n"
         "box { <10, 0, 5> <20, 1, 15> pigment { rgb <1, 0, 0> } finish { ambient 1 diffuse 0 } }\n";
  EXPECT_THAT(notes_of(written(run)), Not(Contains(HasSubstr("from above"))));
  const auto stored = runlog::read_rgb(scratch.path() / "figures" / "overhead.png");
  ASSERT_TRUE(stored) << stored.error().message;
  const cv::Mat& image = *stored;
  const auto at = [&](double x_m, double y_m) {  // bounds are 6.1 m by 5.1 m about the origin
    return image.at<cv::Vec3b>(int((2.55 - y_m) / 5.1 * image.rows), int((x_m + 3.05) / 6.1 * image.cols));
  };
  EXPECT_EQ(at(1.5, 1.0), cv::Vec3b(255, 0, 0));
  for (const auto& [x_m, y_m] : {std::pair{-1.5, 1.0}, {1.5, -1.0}, {-1.5, -1.0}, {0.5, 1.9}}) {
    EXPECT_EQ(at(x_m, y_m), cv::Vec3b(255, 255, 255)) << x_m << ", " << y_m;
  }
}

TEST(WriteReport, ReportsProgressFromBeginningToEnd) {
  const ScratchFolder scratch;
  std::vector<double> fractions;
  ReportSettings settings = quick();
  settings.progress = [&](double fraction) { fractions.push_back(fraction); };
  ASSERT_TRUE(write_report(synthetic_run(scratch.path(), 5), settings));
  ASSERT_GE(fractions.size(), 5U);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.front(), 0);
  EXPECT_EQ(fractions.back(), 1);
}

TEST(WriteReport, ReportsWhatCannotBeWritten) {
  const ScratchFolder scratch;
  std::filesystem::create_directories(scratch.path() / "report.html" / "in the way");
  const auto blocked = write_report(synthetic_run(scratch.path(), 5), quick());
  ASSERT_FALSE(blocked);
  EXPECT_THAT(blocked.error().message, HasSubstr("report.html"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "report.html.part"));
}

TEST(WriteReport, RefusesBadArguments) {
  ReportSettings settings;
  settings.error_budget_draws = 0;
  EXPECT_THAT(testing_support::error_of<std::invalid_argument>(
                  [&] { (void)write_report(synthetic_run("/no/such/run", 1), settings); }),
              testing::AllOf(HasSubstr("error_budget_draws is 0, must be >= 1"), HasSubstr("/no/such/run")));
}

}  // namespace
}  // namespace twocone::report
