// SPDX-License-Identifier: Apache-2.0
#include "apps/config/key_change.h"

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::vector<KeyChange> changes(std::initializer_list<std::string_view> texts) {
  std::vector<KeyChange> parsed;
  for (const std::string_view text : texts) parsed.push_back(parse_change(text));
  return parsed;
}

Robot good_robot_with(std::initializer_list<std::string_view> texts) {
  return read_robot(data("good_robot.yaml"), changes(texts));
}

std::string refusal_of(std::initializer_list<std::string_view> texts) {
  return message_of([&] { static_cast<void>(good_robot_with(texts)); });
}

TEST(KeyChange, AltersItsKeyAndNoOther) {
  Robot wanted = read_robot(data("good_robot.yaml"));
  const Robot robot = good_robot_with({"cameras.lower.rate_hz=10.25", "cameras.upper.rate_hz=10.25",
                                       "cameras.aft_2.rate_hz=10.25", "waypoints_m=[[0.1, 0.2]]"});
  for (drivers::CameraPart* camera : {&wanted.lower, &wanted.upper, &wanted.others.at(0).part}) {
    camera->settings.rate_hz = 10.25;
  }
  wanted.waypoints = {{0.1, 0.2}};
  wanted.changes = robot.changes;
  EXPECT_EQ(robot, wanted);
  EXPECT_EQ(to_string(robot.changes.at(3)), "waypoints_m=[[0.1, 0.2]]") << "as run.yaml records it";
}

TEST(KeyChange, TheLastOfOneKeyCounts) {
  EXPECT_EQ(good_robot_with({"body.radius_m=0.3", "body.radius_m=0.31"}).body_radius_m, 0.31);
}

TEST(KeyChange, AddsASectionThatTheFileDoesNotHave) {
  EXPECT_EQ(good_robot_with({"estimator.budget_s=0.125", "estimator.stage=adaptive"}).estimator.budget_s, 0.125);
}

TEST(KeyChange, TakesAnOldNameAsThePresentOne) {
  EXPECT_EQ(parse_change("effects.camera.exposures=4").key, "effects.camera.shutter_samples");
  EXPECT_EQ(good_robot_with({"effects.camera.exposures=4"}).lower.effects.shutter_samples, 4);
  EXPECT_EQ(good_robot_with({"cameras.lower.effects.exposures=4"}).lower.effects.shutter_samples, 4);
}

TEST(KeyChange, LeavesTheOtherUseOfAnAnchorAsItIs) {
  const testing_support::TemporaryFolder folder;
  std::string text = good_robot_text();
  text = with(text, "lower: {driver: sim_povray, width_px: 641, height_px: 479, rate_hz: 12.5, antialias: 2}",
              "lower: &camera {driver: sim_povray, width_px: 641, height_px: 479, rate_hz: 12.5}");
  text = with(text, "{driver: sim_povray, width_px: 80, height_px: 60, rate_hz: 12.5, effects: {distortion: []}}",
              "*camera");
  const Robot robot = read_robot(folder.write("robot.yaml", text), changes({"cameras.lower.width_px=320"}));
  EXPECT_EQ(robot.lower.settings.width_px, 320);
  EXPECT_EQ(robot.others.at(0).part.settings.width_px, 641);
}

// ---- messages name the change in place of a line of the file

TEST(KeyChange, AMessageNamesIt) {
  EXPECT_THAT(refusal_of({"cameras.lower.widht_px=320"}),
              StartsWith("--set cameras.lower.widht_px=320: cameras.lower.widht_px"));
  EXPECT_THAT(refusal_of({"cameras.lower.width_px=wide"}),
              StartsWith("--set cameras.lower.width_px=wide: cameras.lower.width_px is 'wide'"));
  EXPECT_THAT(refusal_of({"body.radius_m=-0.2"}), StartsWith("--set body.radius_m=-0.2: body.radius_m is -0.2 m"));
  EXPECT_THAT(refusal_of({"name.first=nina"}), HasSubstr("--set name.first=nina: name is not a section"));
  EXPECT_THAT(refusal_of({"cameras.lower=320"}), StartsWith("--set cameras.lower=320: cameras.lower"));
  EXPECT_THAT(refusal_of({"boddy.radius_m=0.2"}), StartsWith("--set boddy.radius_m=0.2: boddy"));
}

TEST(KeyChange, EveryWrongOneIsNamed) {
  const std::string message = refusal_of({"body.radius_m=-0.2", "latency_frames=-1"});
  EXPECT_THAT(message, StartsWith("--set latency_frames=-1: latency_frames is -1"));
  EXPECT_THAT(message, HasSubstr("\n--set body.radius_m=-0.2: body.radius_m is -0.2 m")) << "a line for each";
}

TEST(KeyChange, OtherTextIsRefused) {
  for (const std::string_view text : {"", "=", "=1", "name", "name=", ".name=x", "name.=x", "a..b=1", "a b=1"}) {
    EXPECT_EQ(message_of([&] { static_cast<void>(parse_change(text)); }),
              fmt::format("--set {}: must be KEY=VALUE, such as cameras.lower.antialias=3", text));
  }
  EXPECT_THAT(message_of([] { static_cast<void>(parse_change("waypoints_m=[1")); }),
              StartsWith("--set waypoints_m=[1:"));
}

TEST(KeyChange, KeysHaveItAsTheirPlace) {
  const Robot robot = good_robot_with({"effects.slip=0.02"});
  EXPECT_EQ(key_places(robot, read_map(data("good_map.yaml"))).at("effects.slip"), "--set effects.slip=0.02");
}

}  // namespace
}  // namespace twocone::config
