// SPDX-License-Identifier: Apache-2.0
#include "apps/config/to_layers.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "tests/config/fixtures.h"

namespace twocone::config {
namespace {

TEST(KeyPlaces, AreTheLinesOfTheKeysNotOfTheirValues) {
  const Robot robot = read_robot(data("good_robot.yaml"));
  const Map map = read_map(data("good_map.yaml"));
  const sim_povray::KeyPlaces places = key_places(robot, map);
  const auto expect = [&](const std::string& key, const std::filesystem::path& file, int line) {
    const auto place = places.find(key);
    ASSERT_NE(place, places.end()) << key;
    EXPECT_EQ(place->second, fmt::format("{}:{}", file.string(), line)) << key;
  };
  expect("name", robot.file, 2);
  expect("drive", robot.file, 7);
  expect("drive.command_timeout_s", robot.file, 12);
  expect("cameras.upper.effects.gain", robot.file, 15);
  expect("effects", robot.file, 35);
  expect("effects.slip", robot.file, 36);
  expect("effects.camera.late_probability", robot.file, 53);
  expect("map", robot.file, 3);
  expect("map.obstacles", map.file, 8);
  expect("map.obstacles[0]", map.file, 9);
  expect("map.moving", map.file, 11);
  expect("map.effects.shadows", map.file, 14);
  EXPECT_FALSE(places.contains("map.moving.name")) << "keys inside lists have no unique place";
  EXPECT_FALSE(places.contains("effects.wheel_friction"));
}

TEST(KeyPlaces, OfAMissingFileAreAFileError) {
  Robot robot = read_robot(data("good_robot.yaml"));
  const Map map = read_map(data("good_map.yaml"));
  robot.file = "absent.yaml";
  EXPECT_EQ(message_of([&] { key_places(robot, map); }), "absent.yaml: no such file");
}

}  // namespace
}  // namespace twocone::config
