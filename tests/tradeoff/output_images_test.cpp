// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/show/page.h"
#include "tests/support/temporary_folder.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using testing::HasSubstr;
using twocone::testing_support::TemporaryFolder;

/// Used instead of a matcher, which would print the whole page.
testing::AssertionResult has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess() << "has: " << part;
  return testing::AssertionFailure() << "does not have: " << part;
}

void expect_well_formed(const std::string& xml) {
  std::istringstream stream(xml);
  boost::property_tree::ptree tree;
  EXPECT_NO_THROW(boost::property_tree::read_xml(stream, tree));
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// Returns the places of all matches of `pattern`, which captures two numbers.
std::vector<Pixel> places(const std::string& svg, const std::string& pattern) {
  std::vector<Pixel> found;
  const std::regex expression(pattern);
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), expression); it != std::sregex_iterator(); ++it) {
    found.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  }
  return found;
}

/// Both figures and the page, drawn once for all tests.
class Drawn : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    sweep_ = new Sweep(a_sweep());
    sweep_->robot = "robots/<b>\"R&D\"</b>'.yaml";
    sweep_->landmarks[0] = "red & <round>";
    Choice choice;
    choice.setting = sweep_->as_is;
    choice.why = "640x480 is confirmed: 0.36 < 0.5 mm";
    status_ = new Status(write_images(*sweep_, &choice, folder_->path() / "sweep"));
  }
  static void TearDownTestSuite() {
    delete status_;
    delete sweep_;
    delete folder_;
  }
  void SetUp() override { ASSERT_TRUE(*status_) << status_->error().message; }
  static std::string read(const std::string& name) { return folder_->read("sweep/" + name); }

  static inline TemporaryFolder* folder_ = nullptr;
  static inline Sweep* sweep_ = nullptr;
  static inline Status* status_ = nullptr;
};

TEST_F(Drawn, AreWholeSvgWithTheScriptsThatDrewThem) {
  for (const std::string name : {"robot_time", "simulation_time"}) {
    const std::string svg = read("figures/" + name + ".svg");
    expect_well_formed(svg);
    for (const std::string words : {"mean position error / mm", "bound (Cram\u00e9r-Rao)", "the choice", "paper",
                                    "fine", "adaptive", "method paper, measured here", "robot file, unchanged"}) {
      EXPECT_TRUE(has(svg, words)) << name;
    }
    EXPECT_TRUE(has(svg, "the paper, 2006: 30 mm, about 2 s")) << name;
    EXPECT_NE(read("figures/" + name + ".gp"), "");
  }
  EXPECT_TRUE(has(read("figures/simulation_time.svg"), "640x480 +R2 fine x4")) << "a setting of the frontier";
}

// Catches a tooltip with the numbers of another point. gnuplot places marks and margins in hundredths of a pixel, and
// spots are written likewise: in each direction at most two roundings of 0.01 px, so 0.03 px in all.
TEST_F(Drawn, SpotsLieOnTheMarks) {
  constexpr double kApart_px = 0.03;
  const std::string page = read("index.html");
  const std::vector<Pixel> spots = places(page, "class=\"spot\" cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
  const Plane robot = plane_of(*sweep_, Cost::kRobotTime), simulation = plane_of(*sweep_, Cost::kSimulationTime);
  ASSERT_EQ(spots.size(), robot.marks.size() + simulation.marks.size());
  ASSERT_EQ(robot.marks.size(), sweep_->settings.size() - 1) << "all except the one that never answers";
  for (const Plane* plane : {&robot, &simulation}) {
    const bool is_robot = plane == &robot;
    const std::vector<Pixel> drawn =
        places(read(is_robot ? "figures/robot_time.svg" : "figures/simulation_time.svg"),
               "<use xlink:href='#gpPt[0-9]+' transform='translate\\(([0-9.]+),([0-9.]+)\\)");
    for (std::size_t i = 0; i < plane->marks.size(); ++i) {
      const Pixel spot = spots[i + (is_robot ? simulation.marks.size() : 0)];
      double nearest_px = 1e9;
      for (const Pixel& mark : drawn) nearest_px = std::min(nearest_px, std::hypot(mark.x - spot.x, mark.y - spot.y));
      EXPECT_LE(nearest_px, kApart_px) << "setting " << plane->marks[i].setting << " at " << spot.x << ", " << spot.y;
    }
  }
}

TEST_F(Drawn, ThePageNeedsNoOtherFileAndEscapesNames) {
  const std::string page = read("index.html");
  expect_well_formed(page);
  EXPECT_EQ(page.find("<b>\"R"), std::string::npos);
  EXPECT_TRUE(has(page, "&lt;b&gt;&quot;R&amp;D&quot;&lt;/b&gt;&#39;.yaml"));
  EXPECT_TRUE(has(page, "red &amp; &lt;round&gt;"));
  EXPECT_TRUE(has(page, "640x480 is confirmed: 0.36 &lt; 0.5 mm"));
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("<link"), std::string::npos);
  for (const std::string file : {"tradeoff.csv", "errors.csv"}) EXPECT_TRUE(has(page, "<a href=\"" + file + "\">"));
}

TEST_F(Drawn, ThePageHasTheRuleFirstAndEverySetting) {
  const std::string page = read("index.html");
  EXPECT_LT(page.find("Rule: a setting is on a frontier"), page.find("<svg"));
  EXPECT_LT(page.find("exact to 1e-9 m"), page.find("<svg"));
  EXPECT_EQ(count_of(page, "<tr data-setting="), sweep_->settings.size());
  const auto on_either = std::count_if(sweep_->settings.begin(), sweep_->settings.end(), [](const SettingResult& r) {
    return r.on_robot_frontier || r.on_simulation_frontier;
  });
  EXPECT_EQ(count_of(page, "class=\"frontier\">"), std::size_t(on_either));
  EXPECT_EQ(count_of(page, "scope=\"col\""),
            count_of(page.substr(page.find("<tr data-setting"),
                                 page.find("</tr>", page.find("<tr data-setting")) - page.find("<tr data-setting")),
                     "<td>") +
                1)
      << "heads and cells of a row";
  EXPECT_TRUE(has(page, sweep_->repeat));
}

TEST(Tooltip, ContainsSettingErrorAndCosts) {
  const Sweep sweep = a_sweep();
  const std::string text = tooltip(sweep.settings[*sweep.as_is]);
  EXPECT_THAT(text, HasSubstr("640x480"));
  EXPECT_THAT(text, HasSubstr("error: mean 0.313 (0.285 to 0.341) mm; 95 % below 0.719 mm; max 1.06 mm"));
  EXPECT_THAT(text, HasSubstr("answered: 96 of 96 frames; 95 % ellipses contain the truth in 94 % (88 to 97)"));
  EXPECT_THAT(text, HasSubstr("bound (Cram\u00e9r-Rao), rms: 0.252 mm"));
  EXPECT_THAT(text, HasSubstr("vision 1.84 ms"));
  EXPECT_THAT(text, HasSubstr("MiB"));
  EXPECT_THAT(tooltip(sweep.settings.back()), HasSubstr("answered: 0 of 96 frames\n"));
}

TEST(Plane, MapsDecadesEvenly) {
  const LogAxis axis{0.1, 1000, 80, 640};
  EXPECT_DOUBLE_EQ(axis.px(0.1), 80);
  EXPECT_DOUBLE_EQ(axis.px(1000), 640);
  constexpr double kRounding_px = 1e-9;  // rounding of two logarithms, over 560 pixels
  EXPECT_NEAR(axis.px(10), 360, kRounding_px);
  EXPECT_EQ(axis.tics().front().second, "0.1");
  EXPECT_EQ(axis.tics().back().second, "1000");
}

TEST(Plane, ContainsEveryMarkAndThePapersPoint) {
  Sweep sweep = a_sweep();
  sweep.settings[1].robot.p95_s.value = 0;  // cannot be drawn on a logarithmic axis
  for (const Cost cost : {Cost::kRobotTime, Cost::kSimulationTime}) {
    const Plane plane = plane_of(sweep, cost);
    std::vector<PlanePoint> points = plane.bound;
    for (const Mark& mark : plane.marks) points.push_back(mark.at);
    points.push_back(plane.paper);
    for (const PlanePoint& point : points) {
      EXPECT_GT(point.x, plane.x.low);
      EXPECT_LT(point.x, plane.x.high);
      EXPECT_GT(point.y, plane.y.low);
      EXPECT_LT(point.y, plane.y.high);
    }
    for (std::size_t i = 1; i < plane.bound.size(); ++i) EXPECT_LT(plane.bound[i].y, plane.bound[i - 1].y);
  }
  EXPECT_EQ(plane_of(sweep, Cost::kRobotTime).marks.size(), sweep.settings.size() - 2);
}

TEST(Plane, OfNoSettingsShowsOnlyThePapersPoint) {
  const Plane plane = plane_of(Sweep{}, Cost::kRobotTime);
  EXPECT_TRUE(plane.marks.empty());
  EXPECT_LT(plane.x.low, plane.paper.x);
  EXPECT_LT(plane.paper.x, plane.x.high);
}

TEST(Placing, PutsWordsOnFreePlacesAndNotOnEachOther) {
  Placing placing({0, 0, 200, 200});
  placing.keep_clear({94, 94, 106, 106}, 3);
  std::vector<Pixel> middles;
  for (int i = 0; i < 5; ++i) middles.push_back(placing.place({100, 100}, 30, 13));
  EXPECT_LT(middles[0].x, 100) << "the first goes to the left";
  EXPECT_LE(middles[0].x + 15, 94) << "it covers the mark";
  for (std::size_t i = 0; i < middles.size(); ++i) {
    EXPECT_TRUE(middles[i].x >= 15 && middles[i].x <= 185 && middles[i].y >= 6.5 && middles[i].y <= 193.5);
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_TRUE(std::abs(middles[i].x - middles[k].x) >= 30 || std::abs(middles[i].y - middles[k].y) >= 13)
          << "words " << i << " and " << k;
    }
  }
}

TEST(WriteImages, WithoutGnuplotNamesThePackageToInstall) {
  const TemporaryFolder folder;
  const char* path = ::getenv("PATH");
  const std::string before = path != nullptr ? path : "";
  ::setenv("PATH", folder.path().c_str(), 1);
  const Status status = write_images(a_sweep(), nullptr, folder.path());
  ::setenv("PATH", before.c_str(), 1);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(status.error().message, HasSubstr("apt install gnuplot-nox"));
}

}  // namespace
}  // namespace twocone::tradeoff
