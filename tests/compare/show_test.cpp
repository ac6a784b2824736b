// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <cmath>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include "apps/compare/show/sections.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/compare/a_comparison.h"
#include "tests/support/temporary_folder.h"

namespace twocone::compare {
namespace {

using testing_support::TemporaryFolder;

/// Used instead of a matcher, which would print the whole page.
testing::AssertionResult has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess() << "has: " << part;
  return testing::AssertionFailure() << "does not have: " << part;
}

std::string without(std::string text, const std::string& part) {
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at)) text.erase(at, part.size());
  return text;
}

/// Returns the page after the checks that apply to every page.
std::string page_of(const Comparison& comparison, const TemporaryFolder& folder) {
  const Status written = write_page(comparison, folder.path());
  if (!written) ADD_FAILURE() << written.error().message;
  std::string page = folder.read("compare.html");
  std::istringstream stream(page);
  boost::property_tree::ptree tree;
  EXPECT_NO_THROW(boost::property_tree::read_xml(stream, tree));
  const std::string own = without(without(page, "http://www.w3.org/2000/svg"), "http://www.w3.org/1999/xlink");
  for (const char* outside : {"http", "@import", "src=", "<link"}) EXPECT_FALSE(has(own, outside));
  for (const char* bad : {">nan", " nan ", ">NaN", " inf ", "\u00b1\u00a0nan"}) EXPECT_FALSE(has(page, bad));
  return page;
}

/// Draws a grey image with a bright wedge to the right of its middle: at bearing 0 of the body if azimuth_rad is 0.
std::filesystem::path image(const TemporaryFolder& folder, const std::string& name, cv::Size size, double wedge_rad,
                            int grey = 100) {
  cv::Mat pixels(size, CV_8UC3);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const double angle_rad = std::atan2(row - size.height / 2.0, column - size.width / 2.0);
      const bool bright = std::abs(std::remainder(angle_rad - wedge_rad, 2 * M_PI)) < 0.2;
      pixels.at<cv::Vec3b>(row, column) = cv::Vec3b::all(std::uint8_t(grey + (bright ? 100 : 0)));
    }
  }
  std::filesystem::path file = folder.path() / name;
  runlog::write_image(file, estimation::as_image(pixels));
  return file;
}

/// Returns a robot whose mirrors fill images of that size.
config::Robot robot_for(cv::Size size) {
  config::Robot robot;
  for (config::RigView* view : {&robot.rig.lower, &robot.rig.upper}) {
    view->mirror_radius_m = 0.06;
    view->lens_to_tip_m = 0.2;
    view->centre_px = {size.width / 2.0, size.height / 2.0};
    view->rim_radius_px = size.height * 0.45;
  }
  robot.rig.mirror_separation_m = 0.3;
  robot.rig.lens_height_m = 0.1;
  return robot;
}

TEST(ComparePage, NamesTheDifferencesInTheFirstSentenceWithNumberSigmaAndUnit) {
  EXPECT_EQ(headline(a_comparison()),
            "Differs: lower focal length (rim radius +2.00\u00a0\u00b1\u00a00.10\u00a0px), upper noise "
            "(+3.50\u00a0\u00b1\u00a00.05\u00a0grey).");
  EXPECT_EQ(headline_tests(a_comparison()),
            "1 other source tested without a difference; 1 cannot be determined from these data.");
  Comparison equal = a_comparison();
  equal.sources = {equal.sources[1]};
  EXPECT_EQ(headline(equal), "No difference found.");
  equal.sources.clear();
  EXPECT_EQ(headline(equal), "No source of a difference could be tested.")
      << "no test is not the same as no difference";
}

TEST(ComparePage, HoldsVerdictsLightsGapsAndAdvice) {
  const TemporaryFolder folder;
  const std::string page = page_of(a_comparison(), folder);
  EXPECT_TRUE(has(page, headline(a_comparison())));
  for (const char* part :
       {"use more light; in the simulation set full_well_electrons",
        "put the real numbers into the real robot&#39;s `rig:`", "71\u00a0% of range", "\u22122\u00a0% of odometry",
        "5.5e-89", "p &lt; 0.00033", "lower tilt", "Tested without a difference: 1", "Cannot be determined: 1",
        "the robot never turned fast enough", "no clock is common to both", "given trajectory",
        "280 frames by time, 291 by pose"}) {
    EXPECT_TRUE(has(page, part));
  }
  // Each light has a word and a shape, so that its colour is not needed.
  for (const char* light : {"\u25cf\u00a0green", "\u25b2\u00a0amber", "\u25a0\u00a0red"}) {
    EXPECT_TRUE(has(page, light));
  }
  EXPECT_LT(page.find("focal length</th>"), page.find("upper noise</th>")) << "the larger share first";
  for (const char* figure : {"residuals_time", "residuals_range", "paths"}) {
    EXPECT_TRUE(has(page, "id=\"" + std::string(figure) + "\""));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "figures" / (std::string(figure) + ".gp")));
  }
}

TEST(ComparePage, EscapesNames) {
  const TemporaryFolder folder;
  const std::string page = page_of(a_comparison(), folder);
  for (const char* raw : {"<sim>", "<red>", "<of a pixel>"}) EXPECT_FALSE(has(page, raw));
  EXPECT_TRUE(has(page, "runs/&lt;sim&gt; &amp; &quot;co&quot;"));
}

TEST(ComparePage, IsWrittenForAnEmptyComparison) {
  const TemporaryFolder folder;
  const std::string page = page_of(Comparison{}, folder);
  for (const char* part : {"No source of a difference could be tested.", "No stage was compared.",
                           "No gap was measured.", "No frames are shown", "No paths are shown."}) {
    EXPECT_TRUE(has(page, part));
  }
}

TEST(ComparePage, LeavesOutNumbersThatAreNotFinite) {
  const TemporaryFolder folder;
  Comparison c = a_comparison();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  c.gaps.front() = {Quantity::kRange, "mm", nan, inf, -1, nan};
  c.rows.front().simulated = nan;
  c.rows.front().gap_sigma = 0;
  c.sources.front().components.front().sigma = nan;
  c.sources.front().shares.front().share = nan;
  c.simulated_path.front().x_m = nan;
  c.real_residuals.front().before_m = inf;
  c.real_residuals.back().landmark = 77;  // not in the map
  EXPECT_TRUE(has(page_of(c, folder), "landmark 77"));
}

TEST(ComparePage, DrawsPathsOverThePlanWhereTheArenaCannotBeRendered) {
  const TemporaryFolder folder;
  Comparison c = a_comparison();
  c.map.scene = folder.path() / "nowhere.pov";
  const std::string page = page_of(c, folder);
  EXPECT_TRUE(has(page, "The paths are drawn over a plan instead of an image of the arena from above: "));
  EXPECT_TRUE(has(page, "Over the plan drawn from the map."));
}

TEST(ComparePage, ShowsFramesAndNamesThoseThatAreMissing) {
  const TemporaryFolder folder;
  const cv::Size kSize(320, 240), kOther(200, 160);
  Comparison c = a_comparison();
  c.simulated_robot = robot_for(kSize);
  c.real_robot = robot_for(kOther);
  c.real_robot.rig.lower.mirrored = true;
  Exhibit whole;
  whole.simulated_images.fill(image(folder, "s.png", kSize, 0));
  whole.real_images[0] = image(folder, "r.png", kOther, 0);
  whole.real_images[1] = folder.path() / "r<2>.png";
  c.exhibits = {whole, {}};
  c.exhibits[1].simulated_images[0] = folder.write("bad.png", "no image");
  const std::string page = page_of(c, folder);
  EXPECT_TRUE(has(page, "The real upper image is missing: " + (folder.path() / "r&lt;2&gt;.png").string()));
  EXPECT_TRUE(has(page, "The simulated lower image cannot be read: "));
  EXPECT_TRUE(has(page, "200 \u00d7 160 px, is drawn at the size of the simulated one, 320 \u00d7 240 px"));
  EXPECT_TRUE(has(page, "id=\"e0-lower-difference-strip\""));
  EXPECT_FALSE(has(page, "id=\"e0-upper-difference-strip\"")) << "one of both is missing";
  EXPECT_TRUE(has(page, "<use class=\"over\" href=\"#e0-lower-real\"/>"));
  EXPECT_EQ(page, page_of(c, folder)) << "the same bytes twice";
}

TEST(CompareImages, LinesUpBearingsOfTheWorld) {
  const TemporaryFolder folder;
  const cv::Size kSize(320, 240);
  // One object at one bearing of the world, seen by two robots at one place with different headings.
  constexpr double kSimulated_rad = 0.4, kReal_rad = -2.9, kThing_rad = 0.7;
  Comparison c;
  c.simulated_robot = c.real_robot = robot_for(kSize);
  Exhibit exhibit;
  exhibit.simulated.heading_rad = kSimulated_rad;
  exhibit.real.heading_rad = kReal_rad;
  exhibit.simulated_images[0] = image(folder, "s.png", kSize, kThing_rad - kSimulated_rad);
  exhibit.real_images[0] = image(folder, "r.png", kSize, kThing_rad - kReal_rad);
  // Aligned, only the wedge's ragged edges differ. Unaligned, two wedges of 0.4 rad differ by 100 grey: 12.7 on
  // average.
  constexpr double kMostAligned_grey = 1.0, kLeastTurned_grey = 6.0;
  EXPECT_LT(read_images(c, exhibit)[0].mean_difference_grey.value(), kMostAligned_grey);
  exhibit.simulated.heading_rad = kReal_rad;
  EXPECT_GT(read_images(c, exhibit)[0].mean_difference_grey.value(), kLeastTurned_grey);
}

TEST(CompareImages, ShowsWhichSideIsBrighter) {
  const TemporaryFolder folder;
  const cv::Size kSize(320, 240);
  constexpr int kBrighter_grey = 30;
  Comparison c;
  c.simulated_robot = c.real_robot = robot_for(kSize);
  Exhibit exhibit;
  exhibit.simulated_images[0] = image(folder, "s.png", kSize, 0);
  exhibit.real_images[0] = image(folder, "r.png", kSize, 0, 100 + kBrighter_grey);
  const ExhibitView view = read_images(c, exhibit)[0];
  EXPECT_EQ(view.difference.at<cv::Vec3b>(10, 10), difference_colour(kBrighter_grey));
  constexpr double kRounding_grey = 0.5;  // by unrolling, for a pixel
  EXPECT_NEAR(view.mean_difference_grey.value(), kBrighter_grey, kRounding_grey);
  const cv::Vec3b warm = difference_colour(kStrongestDifference_grey), cool = difference_colour(-64);
  EXPECT_GT(warm[0], warm[2]) << "real brighter: red above blue";
  EXPECT_GT(cool[2], cool[0]);
}

TEST(CompareWording, RoundsToTheSigma) {
  EXPECT_EQ(with_sigma(-0.01234, 0.00056), "\u22120.0123\u00a0\u00b1\u00a00.0006");
  EXPECT_EQ(with_sigma(1234.5, 56), "+1234\u00a0\u00b1\u00a056");
  EXPECT_EQ(with_sigma(2, 0), "+2") << "no sigma is stated";
  EXPECT_EQ(percent(-0.034), "\u22123\u00a0%");
  EXPECT_EQ(percent(0.004), "<\u00a01\u00a0%");
  EXPECT_EQ(chance(0), "<\u00a01e-99");
  const Source centre{Cause::kCentre, vision::Side::kUpper, "", SourceVerdict::kDiffers, {}};
  EXPECT_EQ(short_name(centre, {"upper.centre_px.column", "px", 0, 0, 1}), "column");
  EXPECT_EQ(short_name(centre, {"upper.centre_pixels", "px", 0, 0, 1}), "pixels");
}

}  // namespace
}  // namespace twocone::compare
