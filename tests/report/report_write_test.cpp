// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include "apps/report/page.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/report/synthetic_run.h"
#include "tests/support/error_of.h"

namespace twocone::report {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Used instead of a matcher, which would print the whole page.
testing::AssertionResult has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess() << "has: " << part;
  return testing::AssertionFailure() << "does not have: " << part;
}

void expect_well_formed(const std::string& xml, const std::string& what) {
  std::istringstream stream(xml);
  boost::property_tree::ptree tree;
  EXPECT_NO_THROW(boost::property_tree::read_xml(stream, tree)) << what;
}

/// Checks all files of the figures folder and returns their names in order.
std::vector<std::string> figures_in(const std::filesystem::path& run) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(run / "figures")) {
    names.push_back(entry.path().filename());
    if (entry.path().extension() == ".svg") expect_well_formed(content_of(entry.path()), entry.path());
    EXPECT_NE(entry.path().extension(), ".part") << "left over: " << entry.path();
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The error budget is tested in tests/error_budget. Here it has few draws, so that a report is quick.
ReportSettings quick() {
  ReportSettings settings;
  settings.error_budget_draws = 2;
  settings.error_budget_pose_step = 1000;
  return settings;
}

/// Writes the report, checks what every report must fulfil, and returns its text.
std::string written(const runlog::RunData& run, ReportResult* result = nullptr,
                    const ReportSettings& settings = quick()) {
  const Result<ReportResult> report = write_report(run, settings);
  if (!report) {
    ADD_FAILURE() << report.error().message;
    return "";
  }
  if (result != nullptr) *result = *report;
  for (const std::string& note : report->notes) EXPECT_THAT(note, Not(HasSubstr("gnuplot")));
  EXPECT_EQ(report->html, run.folder / "report.html");
  std::string html = content_of(report->html);
  expect_well_formed(html, "report.html");
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "url(http"}) EXPECT_FALSE(has(html, outside));
  for (const char* bad : {">nan", " nan ", ">NaN", " inf "}) EXPECT_FALSE(has(html, bad));
  return html;
}

TEST(WriteReport, GivesEveryFigureAndOnePage) {
  const ScratchFolder scratch;
  const runlog::RunData run = synthetic_run(scratch.path(), 200, 10);
  const std::string html = written(run);
  const std::vector<std::string> names = figures_in(scratch.path());
  for (const char* name : {"fig07_trajectory.svg", "fig08_geometry.svg", "fig08_resolution.svg", "fig09_disparity.svg",
                           "fig11_range_red.svg", "fig12_range_green.svg", "fig13_range_blue.svg",
                           "fig14_range_cyan.svg", "fig15_range_magenta.svg", "fig16_range_yellow.svg",
                           "fig17_error.svg", "fig18_paths.svg", "views_unwrapped.svg"}) {
    EXPECT_THAT(names, Contains(name));
  }
  constexpr std::size_t kLargestPage = 4'000'000;
  EXPECT_LT(html.size(), kLargestPage);
  for (int figure = 7; figure <= 18; ++figure) {
    if (figure == 10) continue;  // the circles are explained in the text of the method, not measured
    EXPECT_TRUE(has(html, fmt::format("The paper&#39;s Figure {}. ", figure)));
  }
  EXPECT_THAT(
      html,
      HasSubstr("twocone run --robot robots/lab_sim.yaml --behaviour wander --frames 200 --method paper --seed 7"));
  EXPECT_TRUE(has(html, "29.97"));
}

// gnuplot silently leaves out a label that does not fit below the plot.
TEST(WriteReport, LabelsEveryAxis) {
  const ScratchFolder scratch;
  written(synthetic_run(scratch.path(), 60));
  for (const auto& [name, labels] : std::map<std::string, std::vector<std::string>>{
           {"fig07_trajectory", {"x / m", "y / m"}},
           {"fig18_paths", {"x / m", "y / m"}},
           {"fig08_geometry", {"distance from the axis / m", "height above the floor / m"}},
           {"fig08_resolution", {"true range / m", "range error / mm"}},
           {"fig11_range_red", {"frame", "range / m", "error / mm"}},
           {"fig17_error", {"frame", "position error / mm"}}}) {
    const std::string svg = content_of(scratch.path() / "figures" / (name + ".svg"));
    for (const std::string& label : labels) EXPECT_TRUE(has(svg, "<text>" + label + "</text>")) << name;
  }
}

TEST(WriteReport, GivesTheSameBytesForTheSameRun) {
  const ScratchFolder scratch;
  const runlog::RunData run = synthetic_run(scratch.path(), 30, 10);
  const std::string first = written(run);
  EXPECT_EQ(first, written(run));
}

// The paper's matches of figure 9 must lie where the image shows the landmarks: circles in the landmark's colour.
TEST(WriteReport, CirclesTheMatches) {
  const ScratchFolder scratch;
  written(synthetic_run(scratch.path(), 120, 1));
  const std::string svg = content_of(scratch.path() / "figures" / "fig09_disparity.svg");
  std::size_t circles = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1)) ++circles;
  EXPECT_GE(circles, 4U * 3U) << "two circles, each with a halo, for at least three landmarks";
  EXPECT_TRUE(has(svg, "stroke=\"#ff0000\""));
}

TEST(WriteReport, ReportsWhatToInstallWithoutGnuplot) {
  const ScratchFolder scratch;
  ReportSettings settings;
  settings.gnuplot = "/no/such/gnuplot";
  const auto report = write_report(synthetic_run(scratch.path(), 5), settings);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(report.error().message, HasSubstr("gnuplot is not installed"));
  EXPECT_THAT(report.error().message, HasSubstr("apt install gnuplot-nox"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "report.html"));
}

TEST(WriteReport, DoesNotTakeAnotherProgramForGnuplot) {
  const ScratchFolder scratch;
  ReportSettings settings;
  settings.gnuplot = "true";
  EXPECT_FALSE(write_report(synthetic_run(scratch.path(), 5), settings));
}

TEST(WriteReport, WritesNoErrorWithoutTruth) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 60, 20);
  remove_truth(run);
  ReportResult result;
  const std::string html = written(run, &result);
  EXPECT_TRUE(has(html, "No ground truth"));
  EXPECT_FALSE(has(html, "error / mm"));
  EXPECT_FALSE(has(html, "Precision of the truth"));
  EXPECT_THAT(figures_in(scratch.path()), Not(Contains("fig17_error.svg")));
  EXPECT_THAT(result.notes, Contains(HasSubstr("no ground truth")));
}

TEST(WriteReport, PutsBoundsAndTheBudgetBesideTheErrors) {
  const ScratchFolder scratch;
  const runlog::RunData run = outline_run(synthetic_run(scratch.path(), 120, 40));
  ReportSettings settings = quick();
  settings.error_budget_draws = 8;
  const std::string html = written(run, nullptr, settings);
  const std::vector<std::string> names = figures_in(scratch.path());
  for (const char* name : {"bound_position.svg", "bound_normalised.svg", "error_budget.svg"}) {
    EXPECT_THAT(names, Contains(name));
  }
  EXPECT_TRUE(has(html, "rmse / bound"));
  EXPECT_TRUE(has(html, "in 95\u00a0% ellipse"));
  EXPECT_TRUE(has(html, "Heading, difference from the true one in degrees"));
  EXPECT_TRUE(has(html, "Left out of fixes as outliers, in frames: blue 1."));
  EXPECT_TRUE(has(html, "noise of the outlines 0.080 px (measured)"));
  EXPECT_TRUE(has(html, "centre, upper mirror"));
  EXPECT_TRUE(has(html, "The Monte Carlo uses 8 draws, so its relative statistical error is 25.0 %."));
  for (const auto& [name, label] : {std::pair{"bound_position", "position error / mm"},
                                    {"bound_normalised", "range error / its sigma"},
                                    {"error_budget", "root mean square / mm"},
                                    {"error_budget", "tilt, lower mirror: 0.1 degree"}}) {
    EXPECT_TRUE(has(content_of(scratch.path() / "figures" / (std::string(name) + ".svg")),
                    std::string("<text>") + label + "</text>"));
  }
}

// Catches verdicts of one method explained in the terms of the other, and ranges that no verdict accounts for.
TEST(WriteReport, ExplainsVerdictsAsTheMethodMeansThem) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 60);
  EXPECT_TRUE(has(written(run), "</b>: it reaches the lower rim: too near for its top to be seen"));
  run.method = "outline";
  run.fixes.front().verdict = "too_few";
  int hidden = 0;
  int with_range = 0;
  for (runlog::RangeRow& row : run.ranges) {
    if (row.landmark != "cyan" || row.verdict != "ok" || hidden == 15) continue;
    row.verdict = "occluded";
    if (++hidden > 5) row.range_m.reset();
    with_range += row.range_m ? 1 : 0;
  }
  ASSERT_EQ(hidden, 15);
  ASSERT_EQ(with_range, 5);
  const std::string html = written(run);
  EXPECT_TRUE(has(html, "occluded 15 (5 with a range)"));
  EXPECT_TRUE(has(html, "</b>: something hides a part of its outline: a range without a bearing"));
  EXPECT_TRUE(has(html, "</b>: too few measurements to determine a position"));
  EXPECT_TRUE(has(html, "</b>: it reaches the rims: too near for its top to be seen"));
  EXPECT_FALSE(has(html, "the lower rim: too near"));
}

TEST(WriteReport, AssumesTheNoiseOfARunWithoutSightings) {
  const ScratchFolder scratch;
  const std::string html = written(synthetic_run(scratch.path(), 20));
  EXPECT_TRUE(has(html, "noise of the outlines 0.100 px (assumed)"));
  EXPECT_FALSE(has(html, "rmse / bound"));
  EXPECT_THAT(figures_in(scratch.path()), Not(Contains("bound_position.svg")));
}

TEST(WriteReport, ReportsThatARunWasCutOff) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 40);
  run.info.finished = false;
  run.info.frames_wanted = 450;
  run.info.events = {"The lower camera was disconnected after 2.6 s."};
  const std::string html = written(run);
  EXPECT_TRUE(has(html, "cut off after 40 of 450 frames"));
  EXPECT_TRUE(has(html, "The lower camera was disconnected after 2.6 s."));
}

TEST(WriteReport, HandlesOneFrameAndNone) {
  for (const int frames : {1, 0}) {
    const ScratchFolder scratch;
    const std::string html = written(synthetic_run(scratch.path(), frames, 1));
    EXPECT_THAT(figures_in(scratch.path()), Contains("fig18_paths.svg")) << frames << " frames";
    EXPECT_TRUE(has(html, frames == 0 ? "This run has no frames." : "1 of 1")) << frames << " frames";
  }
}

TEST(WriteReport, HandlesALandmarkThatWasNeverSeenAndAFrameWithTwoAnswers) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 30);
  for (runlog::RangeRow& row : run.ranges) {
    if (row.landmark != "blue") continue;
    row.verdict = "not_seen";
    row.range_m = row.bearing_rad = row.disparity_px = std::nullopt;
  }
  runlog::FixRow second = run.fixes[7];
  run.fixes[7].verdict = second.verdict = "ambiguous";
  second.x_m = *second.x_m + 9;  // far outside figure 18
  second.error_m = 9.0;
  run.fixes.insert(run.fixes.begin() + 8, second);
  const std::string html = written(run);
  EXPECT_TRUE(has(html, "not_seen 30"));
  EXPECT_TRUE(has(html, "1 of them lie outside this figure"));
  EXPECT_TRUE(has(html, "9000.00")) << "the worse answer counts";
  EXPECT_THAT(figures_in(scratch.path()), Contains("fig13_range_blue.svg"));
}

// An axis that ends before an error must say so.
TEST(WriteReport, MarksErrorsBeyondAnAxis) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 120);
  for (runlog::RangeRow& row : run.ranges) {
    if (row.frame == 50 && row.landmark == "cyan") row.range_m = *row.true_range_m + 1.4;
  }
  *run.fixes[50].error_m = 1.037;
  const std::string html = written(run);
  EXPECT_TRUE(has(html, "1 error lies beyond the error axis: a triangle at its edge."));
  EXPECT_TRUE(has(html, "1 of the errors lie beyond the axis, up to 1037 mm: triangles at its edge."));
}

TEST(WriteReport, NotesABaselineThatCannotBeRead) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 10);
  run.method = "outline";
  run.fixes.front().verdict = "too_few";
  std::filesystem::create_directories(scratch.path() / "methods" / "paper");
  ReportResult result;
  written(run, &result);
  EXPECT_THAT(result.notes, Contains(HasSubstr("The baseline, method paper, cannot be read")));
}

TEST(Page, PutsTheBaselineBesideAMethodOfOurs) {
  runlog::RunData run = synthetic_run("unused", 30);
  run.method = "outline";
  run.fixes.front().verdict = "too_few";
  const runlog::Summary summary = runlog::summarise(run);
  runlog::Summary baseline = summary;
  baseline.method = "paper";
  baseline.fix_error->mean = 0.0777;
  baseline.landmarks[0].error->max = 0.8765;
  const std::string html = page({run, summary, &baseline, {}, {}, {}});
  EXPECT_TRUE(has(html, "fix, method paper"));
  EXPECT_TRUE(has(html, "77.70"));
  EXPECT_TRUE(has(html, "876.50"));
  expect_well_formed(html, "page");
}

TEST(Page, ReportsTheTimesOfVisionAndLocalisation) {
  runlog::RunData run = synthetic_run("unused", 3);
  const auto text = [&run] { return page({run, runlog::summarise(run), nullptr, {}, {}, {}}); };
  EXPECT_THAT(text(), Not(HasSubstr("vision and localisation, per frame")));
  EXPECT_THAT(text(), HasSubstr("repeats the run byte for byte:"));
  run.method = "outline";
  run.fixes.front().verdict = "too_few";
  run.robot.estimator.stage = "adaptive";
  run.robot.estimator.budget_s = 0.02;
  for (const runlog::FrameRow& frame : run.frames) {
    run.timing.push_back({frame.frame, frame.t_s, 0.01234, 0.000567, 0.0131, 3, "kept"});
  }
  EXPECT_THAT(text(), HasSubstr("vision median 12.34 ms, localisation median 0.57 ms"));
  EXPECT_THAT(text(), HasSubstr("time budget of 20 ms kept in 3 of 3 frames</dd>"));
  EXPECT_THAT(text(), HasSubstr("byte for byte, unless the time limit cuts an answer short:"));
}

// A user chooses the names: each may reach a script, a page or a path as a name only.
TEST(WriteReport, TakesAnyNameAsAName) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 30, 10);
  const std::vector<std::string> names{"<b>&\"quoted\"",          "it's `touch pwned` \\", "../../up",
                                       "$(id) @x {/:Bold y}_2^3", "gr\u00fcn \xFF\n\x01",  ""};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string old = run.map.landmarks[i].name;
    run.map.landmarks[i].name = names[i];
    for (runlog::RangeRow& row : run.ranges) {
      if (row.landmark == old) row.landmark = names[i];
    }
  }
  run.robot.name = run.info.compiler = "</title><script>alert(1)</script>";
  run.info.events = {"<img src=x>"};
  for (runlog::FixRow& fix : run.fixes) {
    if (fix.verdict == "gap") fix.verdict = "a'; system 'id' #";
  }
  const std::string html = written(run);
  EXPECT_FALSE(has(html, "<script>alert"));
  EXPECT_FALSE(has(html, "<img"));
  EXPECT_TRUE(has(html, "&lt;b&gt;&amp;&quot;quoted&quot;"));
  const std::vector<std::string> files = figures_in(scratch.path());
  EXPECT_THAT(files, Contains("range_02_______up.svg"));
  EXPECT_THAT(files, Contains("range_05__.svg"));
  EXPECT_TRUE(has(content_of(scratch.path() / "figures" / "range_03___id___x____bold_y__2_3.svg"), "$(id) @x"));
  EXPECT_FALSE(std::filesystem::exists("pwned"));
}

TEST(WriteReport, NotesWhatIsMissing) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 20);
  run.map.scene = scratch.path() / "gone.pov";
  ReportResult result;
  const std::string html = written(run, &result);
  EXPECT_THAT(result.notes, Contains(HasSubstr("gone.pov")));
  EXPECT_THAT(result.notes, Contains(HasSubstr("no images")));
  EXPECT_TRUE(has(html, "gone.pov"));
}

TEST(WriteReport, KeepsAndReusesTheImageFromAbove) {
  const ScratchFolder scratch;
  runlog::RunData run = synthetic_run(scratch.path(), 20);
  run.map.scene = scratch.path() / "gone.pov";  // so that rendering would fail and be noted
  std::filesystem::create_directories(scratch.path() / "figures");
  const auto cache = scratch.path() / "figures" / "overhead.png";
  runlog::write_image(cache, {1000, 836, PixelFormat::kGrey8, std::vector<std::uint8_t>(836 * 1000, 90)});
  ReportResult result;
  written(run, &result);
  EXPECT_THAT(result.notes, Not(Contains(HasSubstr("gone.pov"))));
  EXPECT_TRUE(has(content_of(scratch.path() / "figures" / "fig07_trajectory.svg"), "data:image/jpeg;base64,"));

  runlog::write_image(cache, {1000, 600, PixelFormat::kGrey8, std::vector<std::uint8_t>(600 * 1000, 90)});
  written(run, &result);
  EXPECT_THAT(result.notes, Contains(HasSubstr("gone.pov"))) << "the image of another room was used for this one";
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
  ReportResult result;
  written(run, &result);
  for (const std::string& note : result.notes) EXPECT_THAT(note, Not(HasSubstr("from above")));
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
  written(synthetic_run(scratch.path(), 5), nullptr, settings);
  ASSERT_GE(fractions.size(), 5U);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.front(), 0);
  EXPECT_EQ(fractions.back(), 1);
}

TEST(WriteReport, ReportsWhatCannotBeWritten) {
  const ScratchFolder scratch;
  std::ofstream(scratch.path() / "figures") << "a file where the folder should be";
  const auto report = write_report(synthetic_run(scratch.path(), 5));
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message, HasSubstr("figures"));

  const ScratchFolder other;
  std::filesystem::create_directories(other.path() / "report.html" / "in the way");
  const auto blocked = write_report(synthetic_run(other.path(), 5), quick());
  ASSERT_FALSE(blocked);
  EXPECT_THAT(blocked.error().message, HasSubstr("report.html"));
  EXPECT_FALSE(std::filesystem::exists(other.path() / "report.html.part"));
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
