// SPDX-License-Identifier: Apache-2.0
// These tests render with POV-Ray and fail where it is not installed.
#include "drivers/sim_povray/effects.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing::HasSubstr;
using testing_support::FailsWith;

const SceneAccess kAnywhere("a.pov", {});

/// A scene with a hollow floor and ceiling, a camera between them, and places for every effect.
constexpr const char* kEffectsScene = R"(#version 3.7;
global_settings {
  assumed_gamma 1
  PHOTONS
  RADIOSITY
}
camera { location <0, 2, -6> look_at <0, 1, 0> }
light_source {
  <3, 4, -4> rgb 1 LIGHT
}
plane { y, 0 hollow pigment { checker rgb 0.2 rgb 0.9 } finish { reflection 0.5 } }
plane { -y, -5 hollow pigment { rgb 0.7 } finish { reflection 0.4 } }
sphere { <0, 1, 0>, 1 pigment { rgbt <1, 0.8, 0.8, 0.8> } interior { ior 1.4 INSIDE } finish { reflection 0.2 } OBJECT }
box { <1.5, 0, 0>, <2, 2, 1> pigment { rgb <1, 0.5, 0.2> } }
AIR
)";

using Parts = std::vector<std::pair<std::string, std::string>>;

std::string scene_with(const Parts& parts) {
  std::string text = kEffectsScene;
  for (const char* name : {"PHOTONS", "RADIOSITY", "LIGHT", "INSIDE", "OBJECT", "AIR"}) {
    const auto part = std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.first == name; });
    text.replace(text.find(name), std::string_view(name).size(), part == parts.end() ? "" : part->second);
  }
  return text;
}

struct RenderedScene {
  std::string text;
  int quality = kFullQuality;
};

/// Renders all scenes at once, because POV-Ray mostly sleeps.
std::vector<Image> rendered(const std::vector<RenderedScene>& scenes) {
  const Povray povray(find_povray("povray").value(), "a.pov", std::chrono::seconds(60));
  std::vector<std::future<ImageResult>> results;
  for (const RenderedScene& scene_text : scenes) {
    ViewTemplate view_template{
        .scene = scene_text.text, .width_px = 48, .height_px = 36, .quality = scene_text.quality};
    const RenderJob job{"a", std::make_shared<const ViewTemplate>(std::move(view_template)), {}};
    results.push_back(std::async(std::launch::async, [&povray, job] { return povray.render(job, -1); }));
  }
  std::vector<Image> images;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const ImageResult image = results[i].get();
    if (!image) ADD_FAILURE() << image.error().message << "\n" << scenes[i].text;
    images.push_back(image ? **image : Image{});
  }
  return images;
}

const Parts kNothing;
const Parts kMedia{{"AIR", "media { emission 0.05 }"}, {"INSIDE", "media { absorption 1 }"}};
const Parts kFog{{"AIR", "fog { distance 9 rgb 0.5 }"}};
const Parts kPhotons{{"PHOTONS", "photons { count 3000 }"}, {"OBJECT", "photons { target refraction on }"}};
const Parts kRadiosity{{"RADIOSITY", "radiosity { count 10 }"}};
const Parts kArea{{"LIGHT", "area_light <1, 0, 0>*2, y*2, 3, 1 + 2 adaptive 1 jitter area_illumination on circular"}};
const Parts kSubsurface{
    {"PHOTONS", "subsurface { samples 5, 5 } mm_per_unit 20"},
    {"AIR", "sphere { <-2, 1, 0>, 1 pigment { rgb 1 } finish { subsurface { translucency 0.5 } } }"}};

TEST(SceneRendering, LowerQualityLeavesOutOnlyTheEffectsThatTheChoiceFinds) {
  const std::vector<Parts> plain{kNothing, kArea};
  const std::vector<Parts> full{kMedia, kFog, kPhotons, kRadiosity, kSubsurface};
  std::vector<RenderedScene> scenes;
  for (const auto& kind : {plain, full}) {
    for (const Parts& parts : kind) {
      for (const int quality : {kPlainQuality, kFullQuality, 11}) scenes.push_back({scene_with(parts), quality});
    }
  }
  const std::vector<Image> images = rendered(scenes);
  for (std::size_t i = 0; i < images.size(); i += 3) {
    const bool is_plain = i / 3 < plain.size();
    EXPECT_EQ(choose_rendering(*Scene::parse(scenes[i].text, "a.pov"), {}, kAnywhere)->quality,
              is_plain ? kPlainQuality : kFullQuality)
        << scenes[i].text;
    EXPECT_EQ(images[i] == images[i + 1], is_plain) << scenes[i].text;
    EXPECT_EQ(images[i + 1], images[i + 2]) << scenes[i].text;
  }
}

TEST(SceneRendering, ASwitchedSceneLooksLikeOneWithoutTheEffect) {
  const auto off = [](bool SceneSwitches::*member) {
    SceneSwitches switches;
    switches.*member = false;
    return switches;
  };
  SceneSwitches shallow{.reflection_depth = 1};
  struct Case {
    SceneSwitches switches;
    Parts with;
    Parts without;
  };
  const std::vector<Case> cases{
      {off(&SceneSwitches::shadows), kNothing, {{"LIGHT", "shadowless"}}},
      {off(&SceneSwitches::area_lights), kArea, kNothing},
      {off(&SceneSwitches::photons), kPhotons, kNothing},
      {off(&SceneSwitches::radiosity), kRadiosity, kNothing},
      {off(&SceneSwitches::media), kMedia, kNothing},
      {off(&SceneSwitches::media), kFog, kNothing},
      {shallow, {{"PHOTONS", "max_trace_level 9"}}, {{"PHOTONS", "max_trace_level 1"}}},
  };
  std::vector<RenderedScene> scenes;
  for (const Case& c : cases) {
    const std::string with = scene_with(c.with);
    const auto scene = Scene::parse(with, "a.pov");
    const auto text = value(switched(*scene, find_calls(*scene, kAnywhere), c.switches));
    scenes.insert(scenes.end(), {{text}, {scene_with(c.without)}, {with}});
  }
  const std::vector<Image> images = rendered(scenes);
  for (std::size_t i = 0; i < images.size(); i += 3) {
    EXPECT_EQ(images[i], images[i + 1]) << scenes[i].text;
    EXPECT_NE(images[i + 1], images[i + 2]) << "the effect must be seen in this scene\n" << scenes[i + 2].text;
  }
}

// ---- the table

PlaceSettings place_of(const std::string& scene) {
  return {.scene = std::string(TWOCONE_SOURCE_DIR) + "/scenes/effects/" + scene + ".pov"};
}

EffectRow row(const std::vector<EffectRow>& table, const std::string& effect) {
  const auto found = std::find_if(table.begin(), table.end(), [&](const EffectRow& r) { return r.effect == effect; });
  return found == table.end() ? EffectRow{} : *found;
}

std::vector<std::string> on(const std::vector<EffectRow>& table) {
  std::vector<std::string> names;
  for (const EffectRow& r : table) {
    if (r.on) names.push_back(r.effect);
  }
  return names;
}

TEST(EffectTable, HasAlwaysTheSameRowsAndAReasonForEach) {
  const auto plain = effect_table(place_of("plain"), {}, {}, {}).value();
  const auto radiosity = effect_table(place_of("radiosity"), {}, {{"lower", 3, {}}}, {}).value();
  ASSERT_EQ(plain.size(), radiosity.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(plain[i].effect, radiosity[i].effect);
    EXPECT_EQ(plain[i].kind, radiosity[i].kind);
    for (const std::string& cell : {plain[i].kind, plain[i].reason, plain[i].how, plain[i].cost}) {
      EXPECT_FALSE(cell.empty()) << plain[i].effect;
    }
  }
}

TEST(EffectTable, EachSceneRequiresItsOwnEffect) {
  using testing::ElementsAre;
  const auto effects_of = [](const char* scene) { return on(effect_table(place_of(scene), {}, {}, {}).value()); };
  EXPECT_THAT(effects_of("plain"), ElementsAre("reflection depth"));
  EXPECT_THAT(effects_of("shadows"), ElementsAre("reflection depth", "shadows"));
  EXPECT_THAT(effects_of("glass"), ElementsAre("reflection depth", "refraction, transparency"));
  EXPECT_THAT(effects_of("area_light"), ElementsAre("reflection depth", "shadows", "area lights"));
  EXPECT_THAT(effects_of("radiosity"), ElementsAre("reflection depth", "radiosity"));
}

TEST(EffectTable, NamesWhereEachIsRequiredAndSwitchedOff) {
  PlaceSettings place = place_of("shadows");
  place.switches.shadows = false;
  place.switches.reflection_depth = 2;
  place.moving.push_back({"trolley", {{0, 0}, {1, 0}}, 0.1, true, 0.2});
  const SessionSettings session{.body = {.radius_m = 0.2, .wheels = {.slip = 0.01}}};
  const ViewSettings lower{"lower", 3, {.vignetting = 0.3, .colour_gain = {1.1, 1, 0.9}, .flicker = 0.05}};
  const ViewSettings upper{
      "upper",
      1,
      {.vignetting = 0.2, .exposure_time_s = 0.01, .shutter_samples = 5, .stamp_late_s = 0.02, .jpeg_quality = 85}};
  const KeyPlaces places{{"map.effects.shadows", "m.yaml:7"},
                         {"effects.slip", "r.yaml:3"},
                         {"effects.camera.vignetting", "r.yaml:4"},
                         {"cameras.upper.effects.exposure_time_s", "r.yaml:5"},
                         {"cameras.upper.effects.stamp_late_s", "r.yaml:8"},
                         {"cameras.lower.antialias", "r.yaml:6"}};
  const auto table = effect_table(place, session, {lower, upper}, places).value();
  EXPECT_FALSE(row(table, "shadows").on);
  EXPECT_THAT(row(table, "shadows").reason, HasSubstr("m.yaml:7: switched off"));
  EXPECT_THAT(row(table, "shadows").reason, HasSubstr("shadows.pov:"));
  EXPECT_THAT(row(table, "reflection depth").reason, HasSubstr("2 deep: map.effects.reflection_depth"));
  EXPECT_THAT(row(table, "photons").reason, HasSubstr("no `photons` in"));
  EXPECT_EQ(row(table, "vignetting").reason, "r.yaml:4: vignetting of lower, upper");
  EXPECT_EQ(row(table, "motion blur").reason, "r.yaml:5: exposure_time_s of upper");
  EXPECT_EQ(row(table, "motion blur").cost, "5 images for one");
  EXPECT_EQ(row(table, "late stamps").reason, "r.yaml:8: stamp_late_s of upper");
  EXPECT_EQ(row(table, "late stamps").cost, "none");
  EXPECT_EQ(row(table, "colour of the lamps").reason, "effects.camera.colour_gain: colour_gain of lower");
  EXPECT_EQ(row(table, "flickering lamps").reason, "effects.camera.flicker: flicker of lower");
  EXPECT_EQ(row(table, "JPEG").reason, "effects.camera.jpeg_quality: jpeg_quality of upper");
  EXPECT_EQ(row(table, "anti-aliasing").reason, "r.yaml:6: lower 3 x 3");
  EXPECT_EQ(row(table, "wheel slip").reason, "r.yaml:3: 0.01 of the way");
  EXPECT_EQ(row(table, "moving things").reason, "map.moving: trolley");
  EXPECT_TRUE(row(table, "contact").on) << "a moving thing can be touched";
  EXPECT_FALSE(row(table, "mass and friction").on);
}

TEST(EffectTable, IsRefusedWhereOpeningIsRefused) {
  EXPECT_THAT(effect_table(place_of("none"), {}, {}, {}), FailsWith(ErrorCode::kNotFound));
}

Result<std::vector<Verification>> verified(const PlaceSettings& place) {
  return verify_effects(place, {.name = "plain"}, {{"lower", 1, {}}}, {.width_px = 64, .height_px = 48});
}

/// Returns the scene `plain` with an addition before its background.
PlaceSettings plain_with(const TemporaryFolder& folder, const std::string& name, const std::string& more) {
  PlaceSettings place = place_of("plain");
  place.scene_paths = {place.scene.parent_path(), folder.path()};
  std::string text = read_file(place.scene);
  text.insert(text.find("background"), more + "\n");
  place.scene = folder.write(name, text);
  return place;
}

/// Two mirrors that face each other, and a trace level that does not reach all reflections.
constexpr const char* kDeep =
    "global_settings { max_trace_level 2 }\n#declare Facing = texture { pigment { rgb 0.1 } finish { ambient 0.1 "
    "reflection 0.9 } }\nbox { <-30, 0, 20>, <30, 30, 21> texture { Facing } }\nbox { <-30, 0, -21>, <30, 30, -20> "
    "texture { Facing } }\nsphere { <7, 8, 14>, 3 pigment { rgb x } finish { ambient 1 } }\n";

// Catches a difference without an explanation: two images of a scene that draws random numbers are never equal.
TEST(VerifyEffects, RandomNumbersAreNamedAndADifferenceIsNotIntended) {
  const TemporaryFolder folder;
  const auto result = value(verified(
      plain_with(folder, "random.pov",
                 kDeep + std::string("box { <7, 5, 14>, <14, 12, 15> pigment { rgb 0.5 } finish { crand 0.3 } }"))));
  const Verification& seen = result.front();
  EXPECT_GT(seen.different, 0);
  EXPECT_THAT(seen.why, HasSubstr("random.pov:"));
  EXPECT_THAT(seen.why, HasSubstr("crand draws random numbers"));
  EXPECT_FALSE(seen.is_asked_for);
}

// Catches a comparison that counts other pixels than it marks, or that trusts an image that differs.
TEST(CompareRenderers, CountsAndMarksThePixelsThatDiffer) {
  const TemporaryFolder folder;
  const CameraSettings size{.width_px = 64, .height_px = 48};
  const auto compared = [&](const PlaceSettings& place) {
    return value(compare_renderers(place, {.name = "plain"}, {"lower", 1, {}}, size));
  };
  EXPECT_TRUE(compared(place_of("plain")).is_trusted);
  // POV-Ray shows only what is within the bounds.
  const auto cut = compared(plain_with(folder, "cut.pov",
                                       "union { box { <-90, 0, 20> <90, 60, 22> } sphere { 0, 1 } pigment { rgb y } "
                                       "bounded_by { sphere { 0, 2 } } }"));
  EXPECT_EQ(cut.unknown, "");
  EXPECT_FALSE(cut.is_trusted);
  EXPECT_GT(cut.different, 0U);
  EXPECT_LT(cut.different, cut.pixels);
  std::size_t red = 0;
  for (std::size_t i = 0; i < cut.differences.bytes.size(); i += 3) red += cut.differences.bytes[i] == 255 ? 1 : 0;
  EXPECT_EQ(red, cut.different);
  EXPECT_THAT(compared(place_of("glass")).unknown, HasSubstr("glass.pov:"));
}

// Catches a report that the choice is wrong where the scene itself limits the depth: two mirrors face each other.
TEST(VerifyEffects, ReflectionsBeyondTheScenesDepthAreTriedOut) {
  const TemporaryFolder folder;
  const auto result = value(verified(plain_with(folder, "deep.pov", kDeep)));
  const Verification& seen = result.front();
  EXPECT_GT(seen.different, 0) << "the scene shows nothing deep";
  EXPECT_THAT(seen.why, HasSubstr("more than 2 surfaces"));
  EXPECT_TRUE(seen.is_asked_for);
}

TEST(VerifyEffects, OnlyEffectsThatTheMapSwitchesOffChangePixels) {
  auto plain = std::async(std::launch::async, [] { return verified(place_of("plain")); });
  // Radiosity gathers light over the whole image.
  auto radiosity = std::async(std::launch::async, [] { return verified(place_of("radiosity")); });
  PlaceSettings switched_off = place_of("shadows");
  switched_off.switches.shadows = false;
  const auto missed = verified(switched_off);
  const auto same = plain.get();
  const auto gathered = value(radiosity.get());
  EXPECT_EQ(gathered.front().different, 0);
  ASSERT_TRUE(same) << same.error().message;
  ASSERT_TRUE(missed) << missed.error().message;

  ASSERT_EQ(same->size(), 1U);
  EXPECT_EQ(same->front().view, "lower");
  EXPECT_GT(same->front().pixels, 1000);  // of 64 x 48, or of the mirror's circle with a radius of 23.6 px
  EXPECT_EQ(same->front().different, 0);
  EXPECT_EQ(same->front().greatest, 0);
  EXPECT_EQ(same->front().mean, 0);
  EXPECT_GT(same->front().everything_s, 0);
  EXPECT_GT(same->front().choice_s, 0);

  EXPECT_GT(missed->front().different, 0);
  EXPECT_TRUE(missed->front().is_asked_for) << missed->front().why;
  EXPECT_GT(missed->front().greatest, 0);
  EXPECT_GT(missed->front().mean, 0);
  EXPECT_LT(missed->front().mean, missed->front().greatest);
}

}  // namespace
}  // namespace twocone::sim_povray
