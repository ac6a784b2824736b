// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects/scene_calls.h"

#include <ctime>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing_support::FailsWith;

using Files = std::map<std::string, std::string>;

SceneCalls calls_of(std::string_view text, const Files& files = {}) {
  return find_calls(text, "a.pov", [&files](const std::string& name) -> std::optional<IncludedFile> {
    const auto found = files.find(name);
    if (found == files.end()) return std::nullopt;
    return IncludedFile{name, found->second};
  });
}

/// Returns `FILE:LINE WORD` of each call.
std::vector<std::string> words_of(std::string_view text, const Files& files = {}) {
  std::vector<std::string> result;
  for (const Call& call : calls_of(text, files).all) result.push_back(fmt::format("{} {}", call.place(), call.word));
  return result;
}

TEST(SceneCalls, FindsEachWordOfEachFeature) {
  struct Case {
    const char* text;
    Feature feature;
  };
  for (const Case& c : {
           Case{"finish { reflection 0.1 }", Feature::kReflection},
           Case{"finish { reflection { 0 1 fresnel } }", Feature::kReflection},
           Case{"finish { reflection 0 + X }", Feature::kReflection},
           Case{"light_source { 0 rgb 1 }", Feature::kShadows},
           Case{"light_source", Feature::kShadows},
           Case{"pigment { color rgbt 1 }", Feature::kTransparency},
           Case{"pigment { color Red transmit 0.5 }", Feature::kTransparency},
           Case{"pigment { color Red filter F }", Feature::kTransparency},
           Case{"pigment { image_map { \"a.png\" filter 0, 0.5 } }", Feature::kTransparency},
           Case{"interior { ior 1.5 }", Feature::kTransparency},
           Case{"light_source { 0 rgb 1 shadowless area_light x, y, 2, 2 }", Feature::kAreaLights},
           Case{"media { emission 1 }", Feature::kMedia},
           Case{"fog { distance 1 }", Feature::kMedia},
           Case{"global_settings { photons { count 9 } }", Feature::kPhotons},
           Case{"global_settings { radiosity { } }", Feature::kRadiosity},
           Case{"finish { subsurface { translucency 1 } }", Feature::kSubsurface},
           Case{"finish { crand 0.1 }", Feature::kRandom},
           Case{"sphere { clock, 1 }", Feature::kFrameNumber},
           Case{"#if (frame_number > 3) #end", Feature::kFrameNumber},
           Case{"#if (clock_on) #end", Feature::kFrameNumber},
           Case{"#declare A = 1; sphere { 0, A*final_frame }", Feature::kFrameNumber},
       }) {
    const SceneCalls calls = calls_of(c.text);
    ASSERT_THAT(calls.all, testing::SizeIs(1)) << c.text;
    EXPECT_EQ(calls.all.front().feature, c.feature) << c.text;
    EXPECT_EQ(calls.find(c.feature), &calls.all.front()) << c.text;
  }
}

TEST(SceneCalls, TextWithoutEffectRequiresNoFeature) {
  for (const char* text : {
           "// media fog clock",
           "/* photons { /* fog */ radiosity } */",
           "#debug \"media { } clock\"",
           "#if (0) media { } light_source { } #end",
           "#if (1) #else fog { } #end",
           "#if (0) #elseif (0) fog { } #end",
           "finish { reflection 0 }",
           "finish { reflection { 0.0 } }",
           "pigment { color Red transmit 0 filter 0.0 }",
           "light_source { 0 rgb 1 shadowless }",
           "sphere { 0, 1 photons { target reflection on refraction off } }#if (0) #end #macro X() #end",
           "sphere { 0, 1 radiosity { importance 0.5 } }",
           "no_reflection media_interaction radiosity_x Fog",
       }) {
    std::vector<std::string> words = words_of(text);
    std::erase(words, "a.pov:1 photons");
    EXPECT_THAT(words, IsEmpty()) << text;
  }
}

TEST(SceneCalls, ALightIsShadowlessOnlyByAWordThatCertainlyBelongsToIt) {
  EXPECT_THAT(words_of("light_source { 0 rgb 1\n#if (X) shadowless #end }"), ElementsAre("a.pov:1 light_source"));
  EXPECT_THAT(words_of("light_source { 0 rgb 1\nlooks_like { light_source { 0 shadowless } } }"),
              ElementsAre("a.pov:1 light_source"));
  EXPECT_THAT(words_of("light_source { 0 rgb 1 #if (X) } #else shadowless } #end"),
              ElementsAre("a.pov:1 light_source"));
}

TEST(SceneCalls, ADeclarationCountsOnlyIfActiveTextNamesIt) {
  const std::string declared =
      "#declare Smoke = media { emission 1 }\n"
      "#declare Glass = texture { pigment { rgbt 1 } } texture { pigment { rgbf 1 } }\n"
      "#macro Lamp(X) light_source { X rgb 1 } #end\n"
      "#declare Room = union { #local I = 0; #while (I < 2) object { Wall texture { Glass } } #local I = I + 1; #end "
      "}\n"
      "#declare Now = function(x, y) { x + clock }\n"
      "#declare C = Red filter 0.5;\n"
      "#local D[2] = C;\n";
  EXPECT_THAT(words_of(declared), IsEmpty());
  EXPECT_THAT(words_of(declared + "sphere { 0, 1 interior { Smoke } }"), ElementsAre("a.pov:1 media"));
  EXPECT_THAT(words_of(declared + "object { Room }"), ElementsAre("a.pov:2 rgbt", "a.pov:2 rgbf")) << "through Room";
  EXPECT_THAT(words_of(declared + "Lamp(x)"), ElementsAre("a.pov:3 light_source"));
  EXPECT_THAT(words_of(declared + "#if (Now(1, 2) > 3) #end"), ElementsAre("a.pov:5 clock"));
  EXPECT_THAT(words_of(declared + "pigment { D[1] }"), ElementsAre("a.pov:6 filter"));
  EXPECT_THAT(words_of(declared + "#declare Smoke = 1; #if (0) Smoke #end // Smoke"), IsEmpty());
}

TEST(SceneCalls, ADeclarationEndsTooEarlyRatherThanTooLate) {
  for (const char* text : {
           "#declare A = 5\nmedia { }",
           "#declare A = 5;\nmedia { }",
           "#declare A = B(1)\nmedia { }",
           "#declare A = <1, 2, 3>*2\nmedia { }",
           "#declare A = union { }\nmedia { }",
           "#declare A = texture { } media { }",
           "#declare A = function { x } media { }",
           "#declare A = array[2] { 1, 2 } media { }",
           "#declare A = union { #if (X) } #else } #end\nmedia { }",
           "#declare A = union { #if (X) sphere { #else box { #end } }\nmedia { }",
           "#macro Close() } #end #declare A = union { Close() media { }",
           "#macro Close() } #end #macro Both() Close() #end #declare A = union { Both() media { }",
           "#declare (A, B) = media { }",
           "#declare A = #if (X) 1 #else 2 #end media { }",
           "#macro A() media { }",
           "#declare A = (1 media { }",
           "#declare A = <1, 2 media { }",
       }) {
    std::vector<std::string> words = words_of(text);
    ASSERT_THAT(words, testing::SizeIs(1)) << text;
    EXPECT_THAT(words.front(), HasSubstr("media")) << text;
  }
}

TEST(SceneCalls, ReadsIncludes) {
  const Files files{{"a.inc", "#include \"b.inc\"\n#declare T = texture { rgbt 1 }"},
                    {"b.inc", "#ifndef (B)\n#declare B = 1;\nlight_source { 0 }\n#include \"a.inc\"\n#end"},
                    {"open.inc", "}"}};
  EXPECT_THAT(words_of("#include \"a.inc\"\n", files), ElementsAre("b.inc:3 light_source"));
  EXPECT_THAT(words_of("#include \"a.inc\"\nT", files), ElementsAre("b.inc:3 light_source", "a.inc:2 rgbt"));
  EXPECT_THAT(words_of("#if (0)\n#include \"a.inc\"\n#end", files), IsEmpty());
  EXPECT_THAT(words_of("#macro M()\n#include \"a.inc\"\n#end", files), IsEmpty());
  EXPECT_THAT(words_of("#macro M()\n#include \"a.inc\"\n#end\nM()", files), ElementsAre("b.inc:3 light_source"));
  EXPECT_THAT(words_of("#declare X = union {\n#include \"open.inc\"\nmedia { }", files), ElementsAre("a.pov:3 media"));
  EXPECT_TRUE(calls_of("#include \"a.inc\"", files).all.front().included);
  EXPECT_FALSE(calls_of("fog { }").all.front().included);
}

TEST(SceneCalls, ReportsFilesThatItCouldNotRead) {
  EXPECT_THAT(calls_of("\n#include \"c.inc\"\n#include \"c.inc\"").unread,
              ElementsAre("a.pov:2: \"c.inc\" cannot be read"));
  EXPECT_THAT(calls_of("#include Name").unread, ElementsAre(HasSubstr("has to be evaluated")));
  EXPECT_THAT(calls_of("#include concat(\"a\", \".inc\")").unread, ElementsAre(HasSubstr("has to be evaluated")));
  EXPECT_THAT(calls_of("#if (0)\n#include \"c.inc\"\n#end #macro M()\n#include \"c.inc\"\n#end").unread, IsEmpty());
  EXPECT_THAT(calls_of("#include \"d.inc\"", {{"d.inc", "\nfog { } /*"}}).unread, ElementsAre(HasSubstr("d.inc:2")));
}

TEST(SceneCalls, AnIncludeThatIncludesItselfEnds) {
  EXPECT_THAT(words_of("#include \"a.inc\"", {{"a.inc", "fog { }\n#include \"a.inc\"\n"}}), ElementsAre("a.inc:1 fog"));
  // A chain of includes that is longer than POV-Ray allows.
  int files = 0;
  const SceneCalls calls = find_calls("#include \"0\"", "a.pov", [&](const std::string&) {
    ++files;
    return std::optional(IncludedFile{fmt::format("{}", files), fmt::format("#include \"{}\"", files)});
  });
  EXPECT_LT(files, 40);
  EXPECT_THAT(calls.unread, ElementsAre(HasSubstr("too many files deep")));
}

TEST(SceneCalls, TheLastLiteralReflectionDepthCounts) {
  EXPECT_EQ(calls_of("global_settings { max_trace_level 4 }").max_trace_level, 4);
  EXPECT_EQ(calls_of("global_settings { max_trace_level 4 } global_settings { max_trace_level 7 }").max_trace_level, 7);
  EXPECT_EQ(calls_of("global_settings { max_trace_level 4*2 }").max_trace_level, std::nullopt);
  EXPECT_EQ(calls_of("#if (0) global_settings { max_trace_level 4 } #end").max_trace_level, std::nullopt);
}

/// A scene often needs only a few colours from POV-Ray's own files, which declare hundreds of textures.
TEST(SceneCalls, PovRaysOwnIncludesRequireNothingByThemselves) {
  for (const char* name : {"colors", "textures", "glass", "metals", "woods", "stones", "skies", "shapes", "functions",
                           "transforms", "math", "rand", "stdinc", "rad_def"}) {
    const auto scene = Scene::parse(fmt::format("#include \"{}.inc\"\nsphere {{ 0, 1 }}\n", name), "a.pov");
    ASSERT_TRUE(scene) << name;
    const SceneCalls calls = find_calls(*scene, SceneAccess(scene->path(), {}));
    EXPECT_THAT(calls.all, IsEmpty()) << name << " " << (calls.all.empty() ? "" : calls.all.front().place());
    EXPECT_THAT(calls.unread, IsEmpty()) << name;
  }
  const auto scene = Scene::parse("#include \"glass.inc\"\nsphere { 0, 1 texture { T_Glass3 } }", "a.pov");
  const SceneCalls calls = find_calls(*scene, SceneAccess(scene->path(), {}));
  EXPECT_NE(calls.find(Feature::kTransparency), nullptr);
  EXPECT_NE(calls.find(Feature::kReflection), nullptr);
}

/// Where a scene can be evaluated, what a condition excludes does not count.
TEST(SceneCalls, EvaluationExcludesBranchesThatAreNotTaken) {
  const auto calls_in = [](const std::string& text) {
    return find_calls(*Scene::parse("#version 3.7;\n" + text, "a.pov"), SceneAccess("a.pov", {}));
  };
  const std::string options =
      "#declare Smoke = 0;\n"
      "#declare Depth = 3 + 4;\n"
      "#macro Lamp(P) light_source { P, rgb 1 } #end\n"
      "#if (Smoke) fog { distance 9 } Lamp(x) global_settings { max_trace_level 2 } #end\n"
      "global_settings { max_trace_level Depth }\n"
      "sphere { 0, 1 }\n";
  EXPECT_THAT(calls_in(options).all, IsEmpty());
  EXPECT_EQ(calls_in(options).max_trace_level, 7);
  const SceneCalls lit = calls_in(options + "#if (Depth > 6) Lamp(y) #end");
  ASSERT_THAT(lit.all, testing::SizeIs(1));
  EXPECT_EQ(lit.all.front().place(), "a.pov:4");
  // The reader of the native renderer does not know these, so that the text alone counts.
  for (const char* more : {"blob { threshold 1 }", "#if (image_width > 0) #end", "#if (clock > 3) #end"}) {
    const SceneCalls calls = calls_in(options + more);
    EXPECT_NE(calls.find(Feature::kMedia), nullptr) << more;
    EXPECT_NE(calls.find(Feature::kShadows), nullptr) << more;
    EXPECT_EQ(calls.max_trace_level, 2) << more;
  }
}

// ---- switches

Result<std::string> switch_off(const std::string& text, const SceneSwitches& switches) {
  const auto scene = Scene::parse(text, "a.pov");
  return switched(*scene, calls_of(text), switches);
}
constexpr auto kNo = [](auto member) {
  SceneSwitches switches;
  switches.*member = false;
  return switches;
};

TEST(SceneSwitches, KeepEverythingElseAtItsPlace) {
  // The text between [[ and ]] is removed.
  const struct {
    bool SceneSwitches::*member;
    std::string text;
  } cases[] = {
      {&SceneSwitches::area_lights,
       "light_source { 0 [[area_light <1, 0,\n 0> <0, 0, 1>*2, N+1, f(2, 3)]] [[adaptive 1]] [[jitter]] }"},
      {&SceneSwitches::area_lights, "light_source { 0 [[jitter]] [[area_light x y 2 2]] rgb 1 [[circular]] }"},
      {&SceneSwitches::area_lights, "light_source { 0 [[area_light x*2, y*3 2 2]] [[area_illumination on]] rgb 1 }"},
      {&SceneSwitches::area_lights, "#macro A() [[area_light x, y, 2, 2]] [[adaptive 1]] #end orient"},
      {&SceneSwitches::photons, "global_settings { [[photons {\n count 9 }]] a } sphere { [[photons { target }]] }"},
      {&SceneSwitches::radiosity, "global_settings { [[radiosity { count 9 }]] }"},
      {&SceneSwitches::media, "interior { [[media { }]] }\n[[fog { }]] sphere { }"},
      {&SceneSwitches::media, "#declare M = media { }\ninterior { [[media { M }]] }"},
      {&SceneSwitches::media, "// media { }\n\"fog { }\""},
      {&SceneSwitches::shadows, "// light_source { 0 }\nlight_source { 0 shadowless }"},
  };
  for (const auto& c : cases) {
    std::string text;
    std::string expected;
    bool removed = false;
    for (std::size_t i = 0; i < c.text.size(); ++i) {
      if (c.text.compare(i, 2, "[[") == 0 || c.text.compare(i, 2, "]]") == 0) {
        removed = c.text[i++] == '[';
        continue;
      }
      text += c.text[i];
      expected += removed && c.text[i] != '\n' ? ' ' : c.text[i];
    }
    const auto result = switch_off(text, kNo(c.member));
    ASSERT_TRUE(result) << text << ": " << result.error().message;
    EXPECT_EQ(*result, expected) << text;
  }
}

TEST(SceneSwitches, EveryLightBecomesShadowless) {
  EXPECT_EQ(
      switch_off("light_source {\n 0 rgb 1 }\n#declare L = light_source { x }", kNo(&SceneSwitches::shadows)).value(),
      "light_source {\n 0 rgb 1  shadowless }\n#declare L = light_source { x  shadowless }");
}

TEST(SceneSwitches, RefuseWithFileAndLineWhereTheyCannotSwitch) {
  const struct {
    bool SceneSwitches::*member;
    std::string text;
    const char* why;
  } cases[] = {
      {&SceneSwitches::shadows, "\nlight_source { #if (X) } #else } #end", "a.pov:2"},
      {&SceneSwitches::shadows, "#include \"lamp.inc\"", "lamp.inc:2"},
      {&SceneSwitches::shadows, "#include \"none.inc\"", "none.inc"},
      {&SceneSwitches::area_lights, "\n\nlight_source { 0 area_light x, y, #if (X) 2 #else 3 #end, 2 }", "a.pov:3"},
      {&SceneSwitches::media, "media { #declare A = 1; }", "a.pov:1"},
      {&SceneSwitches::media, "#macro M() } #end interior { media { M() }", "a.pov:1"},
  };
  for (const auto& c : cases) {
    const auto scene = Scene::parse(c.text, "a.pov");
    ASSERT_TRUE(scene) << c.text << ": " << scene.error().message;
    EXPECT_THAT(switched(*scene, calls_of(c.text, {{"lamp.inc", "\nlight_source { 0 }"}}), kNo(c.member)),
                FailsWith(ErrorCode::kRefused, HasSubstr(c.why)))
        << c.text;
  }
}

TEST(SceneSwitches, ReflectionDepthComesLast) {
  SceneSwitches switches{.reflection_depth = 3};
  const auto result = switch_off("global_settings { max_trace_level 9 } // end", switches);
  ASSERT_TRUE(result);
  EXPECT_EQ(calls_of(*result).max_trace_level, 3);
}

// ---- choice

TEST(RenderChoice, EnablesOnlyWhatTheSceneRequires) {
  const auto choose = [](const std::string& text, const SceneSwitches& switches) {
    return choose_rendering(*Scene::parse(text, "a.pov"), switches, SceneAccess("a.pov", {})).value();
  };
  EXPECT_EQ(choose("light_source { 0 area_light x, y, 2, 2 } sphere { 0, 1 finish { reflection 1 } }", {}).quality,
            kPlainQuality);
  for (const char* text : {"fog { }", "media { }", "global_settings { photons { } }",
                           "global_settings { radiosity { } }", "finish { subsurface { } }", "#include X"}) {
    EXPECT_EQ(choose(text, {}).quality, kFullQuality) << text;
  }
  EXPECT_EQ(choose("fog { }", kNo(&SceneSwitches::media)).quality, kPlainQuality);
  EXPECT_THAT(choose("light_source { 0 area_light x, y, 2, 2 } fog { }", {}).why_whole, IsEmpty());
  for (const char* text :
       {"light_source { 0 area_light x, y, 2, 2 jitter }", "finish { crand 0.1 }", "#include X",
        "global_settings { photons { } }", "global_settings { radiosity { } }", "finish { subsurface { } }"}) {
    EXPECT_THAT(choose(text, {}).why_whole, HasSubstr("a.pov:1")) << text;
  }
  EXPECT_THAT(choose("sphere { 0, 1 }", {}).one_shot, IsEmpty());
  EXPECT_THAT(choose("\nsphere { 0, clock }", {}).one_shot, HasSubstr("a.pov:2: clock"));
  EXPECT_THAT(choose("#include X", {}).one_shot, Not(IsEmpty()));
}

/// Repeated reading would make the time grow with the square of the text.
TEST(SceneCalls, TimeIsProportionalToTheText) {
  // Each text takes about 0.1 s, and 2 s under a sanitizer. A time that grows with the square of 50 000 would be
  // minutes.
  constexpr double kLimit_s = 20;
  for (const char* word : {"area_light <", "area_light + ", "light_source { ", "#declare A = union { ", "#if (X) { ",
                           "( ", "< ", "#declare A = - ", "reflection { ", "#macro A() { "}) {
    std::string text;
    for (int i = 0; i < 50'000; ++i) text += word;
    // The processor time of this process: other programs do not count.
    const std::clock_t begin = std::clock();
    static_cast<void>(calls_of(text));
    static_cast<void>(Scene::parse(text, "a.pov"));
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, kLimit_s) << word;
  }
}

}  // namespace
}  // namespace twocone::sim_povray
