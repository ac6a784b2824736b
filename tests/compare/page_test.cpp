// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/compare/compare.h"
#include "apps/compare/exhibits.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/compare/a_comparison.h"
#include "tests/support/page_data.h"
#include "tests/support/temporary_folder.h"

namespace twocone::compare {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using testing_support::page_data;
using testing_support::TemporaryFolder;

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

TEST(ComparePage, HoldsTheJsonAndTheTable) {
  const TemporaryFolder folder;
  const std::string text = page(a_comparison(), folder.path());
  json data = page_data(text);
  EXPECT_EQ(data["page"], "compare");
  EXPECT_EQ(text, page(a_comparison(), folder.path())) << "the same bytes twice";
  EXPECT_THAT(text, HasSubstr("simulated runs/&lt;sim&gt; &amp; \"co\" (300 frames)"));
  for (const char* key : {"page", "difference_scale", "page_notes"}) data.erase(key);
  EXPECT_EQ(data, json::parse(to_json(a_comparison())));
}

TEST(ComparePage, NamesCannotEndTheScript) {
  const TemporaryFolder folder;
  Comparison c = a_comparison();
  c.map.landmarks[0].name = "</script><script>alert(1)</script><!--";
  c.simulated = "</title><script>";
  const std::string text = page(c, folder.path());
  EXPECT_EQ(text.find("alert(1)</script"), std::string::npos);
  EXPECT_EQ(text.find("</title><script>"), std::string::npos);
  EXPECT_EQ(page_data(text)["map"]["landmarks"][0]["name"], c.map.landmarks[0].name);
  EXPECT_EQ(page_data(text)["simulated"], c.simulated);
}

TEST(ComparePage, IsWrittenForAnEmptyComparison) {
  const TemporaryFolder folder;
  const json data = page_data(page({}, folder.path()));
  for (const char* list : {"rows", "sources", "gaps", "exhibits"}) EXPECT_EQ(data[list], json::array()) << list;
  EXPECT_FALSE(data.contains("overhead"));
}

TEST(ComparePage, NamesTheReasonWhereTheArenaCannotBeRendered) {
  const TemporaryFolder folder;
  Comparison c = a_comparison();
  c.map.scene = folder.path() / "nowhere.pov";
  EXPECT_THAT(page_data(page(c, folder.path()))["page_notes"].at(0).get<std::string>(),
              StartsWith("The paths are drawn over a plan instead of an image of the arena from above: "));
}

TEST(ComparePage, ShowsFramesAndNamesThoseThatAreMissing) {
  const TemporaryFolder folder;
  const cv::Size kSize(640, 480), kOther(200, 160);
  Comparison c = a_comparison();
  c.simulated_robot = robot_for(kSize);
  c.real_robot = robot_for(kOther);
  Exhibit whole;
  whole.simulated_images.fill(image(folder, "s.png", kSize, 0));
  whole.real_images[0] = image(folder, "r.png", kOther, 0);
  whole.real_images[1] = folder.path() / "r<2>.png";
  c.exhibits = {whole, {}};
  c.exhibits[1].simulated_images[0] = folder.write("bad.png", "no image");
  const json exhibits = page_data(page(c, folder.path()))["exhibits"];
  const json &lower = exhibits[0]["views"]["lower"], &upper = exhibits[0]["views"]["upper"];
  for (const char* kind : {"simulated", "real", "simulated_strip", "real_strip", "difference"}) {
    EXPECT_THAT(lower[kind].get<std::string>(), StartsWith("data:image/jpeg;base64,")) << kind;
  }
  EXPECT_THAT(lower["notes"], ElementsAre("The real lower image, 200 \u00d7 160 px, is drawn at the size of the "
                                          "simulated one, 640 \u00d7 480 px, so that both can be blended."));
  EXPECT_THAT(upper["notes"], ElementsAre("The real upper image is missing: " + whole.real_images[1].string()));
  EXPECT_TRUE(upper["difference"].is_null() && upper["real"].is_null()) << "one of both is missing";
  EXPECT_THAT(exhibits[1]["views"]["lower"]["notes"].at(0).get<std::string>(),
              StartsWith("The simulated lower image cannot be read: "));
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

}  // namespace
}  // namespace twocone::compare
