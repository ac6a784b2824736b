// SPDX-License-Identifier: Apache-2.0
// Which files POV-Ray may read and write for an untrusted scene. The real POV-Ray renders each scene twice: confined by
// Landlock, and as on a kernel without it.
#include "base/confinement.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/scene/evaluator.h"
#include "drivers/sim_povray/scene_views.h"
#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using testing_support::FailsWith;

constexpr const char* kRoom =
    "global_settings { assumed_gamma 1 }\nlight_source { <9, 30, -9> rgb 1 }\nplane { y, 0 pigment { rgb 0.4 } }\n";

/// Has a folder for the scene, a folder that the map names, and a folder that it does not name.
class ConfinementTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (GetParam() && base::landlock_version() == 0) GTEST_SKIP() << "this kernel has no Landlock";
    for (const char* name : {"map", "map/parts", "named", "other"}) {
      std::filesystem::create_directory(folder_.path() / name);
    }
    (void)folder_.write("other/secret.inc", "sphere { 0, 1 pigment { rgb 1 } }\n");
    (void)folder_.write("other/kept.txt", "\"kept\",\n");
    (void)folder_.write("map/parts/part.inc", "sphere { 0, 1 pigment { rgb 1 } }\n");
    (void)folder_.write("named/part_of_others.inc", "sphere { 0, 1 pigment { rgb 1 } }\n");
  }

  [[nodiscard]] std::string at(const std::string& name) const { return (folder_.path() / name).string(); }

  /// Renders the scene from above with one process.
  Result<Image> render(const std::string& text, const std::vector<std::filesystem::path>& paths) {
    RenderSettings settings{.landlock = GetParam(), .timeout = 60s};
    const std::string name = fmt::format("map/{}-scene.pov", ++scenes_);
    return render_overhead(folder_.write(name, "#version 3.7;\n" + text + "\n" + kRoom), 1, {-1, 1, -1, 1, 1, 8},
                           settings, paths);
  }
  Result<Image> render(const std::string& text) { return render(text, {at("map"), at("named")}); }
  std::string refusal(const std::string& text) {
    const auto image = render(text);
    return image ? "it was rendered" : image.error().message;
  }
  /// Does the same with the reader of the native renderer.
  [[nodiscard]] std::string native_refusal(const std::string& text) const {
    SceneAccess access(at("map/scene.pov"), {at("map"), at("named")});
    const auto scene = evaluate("#version 3.7;\n" + text + "\n" + kRoom, "scene.pov", include_reader(access), {});
    return scene ? "it was read" : scene.error().message;
  }
  /// Renders several scenes at once, because POV-Ray mostly sleeps.
  std::vector<std::string> refusals(const std::vector<std::string>& texts) {
    std::vector<std::future<std::string>> futures;
    futures.reserve(texts.size());
    for (const std::string& text : texts) {
      futures.push_back(std::async(std::launch::async, [this, text] { return refusal(text); }));
    }
    std::vector<std::string> messages;
    for (auto& future : futures) messages.push_back(future.get());
    return messages;
  }
  /// Returns the names of all files in the test's folder except scenes.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
      if (entry.is_regular_file() && entry.path().extension() != ".pov")
        names.push_back(entry.path().lexically_relative(folder_.path()).string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  TemporaryFolder folder_;
  std::atomic<int> scenes_ = 0;
};
INSTANTIATE_TEST_SUITE_P(ByTheKernel, ConfinementTest, testing::Values(true, false),
                         [](const auto& way) { return way.param ? "Landlock" : "WithoutLandlock"; });

// Catches a scene that overwrites files of the user.
TEST_P(ConfinementTest, ASceneWritesNoFile) {
  const auto before = files();
  std::vector<std::string> texts;
  for (const std::string& name : {std::string("beside.txt"), at("other/new.txt"), at("other/kept.txt"),
                                  at("named/new.txt"), std::string("/dev/shm/twocone-confinement-test.txt")}) {
    for (const char* mode : {"write", "append"}) {
      texts.push_back(fmt::format("#fopen F \"{}\" {}\n#write (F, \"evil\")\n#fclose F", name, mode));
    }
  }
  for (const std::string& message : refusals(texts)) {
    EXPECT_THAT(message, AllOf(HasSubstr("scene.pov:2: POV-Ray: Parse Error: Cannot open user file"),
                               HasSubstr("(a scene may write no file)")));
  }
  EXPECT_EQ(files(), before);
  EXPECT_EQ(folder_.read("other/kept.txt"), "\"kept\",\n");
  EXPECT_FALSE(std::filesystem::exists("/dev/shm/twocone-confinement-test.txt"));
}

TEST_P(ConfinementTest, FilesThatTheMapNamesAreRead) {
  const std::vector<std::string> texts{
      std::string("#include \"parts/part.inc\""), fmt::format("#include \"{}\"", at("named/part_of_others.inc")),
      std::string("#include \"part_of_others.inc\""),  // searched for in the folders that the map names
      std::string("#include \"colors.inc\"\n#include \"shapes.inc\""),
      std::string("text { ttf \"timrom.ttf\" \"a\" 1, 0 pigment { rgb 1 } }")};
  EXPECT_THAT(refusals(texts), testing::Each("it was rendered"));
}

// Catches reading of other files, by every way in which a scene can name a file, and a refusal without advice.
TEST_P(ConfinementTest, OtherFilesAreNotReadAndTheLineForTheMapIsReported) {
  std::filesystem::create_symlink(at("other/secret.inc"), at("map/linked.inc"));
  std::filesystem::copy_file("/usr/share/povray-3.7/include/bumpmap_.png", at("other/image.png"));
  const std::string line = fmt::format("add to the map: scene_paths: [{}]", at("other"));
  const std::vector<std::string> texts{
      fmt::format("#include \"{}\"", at("other/secret.inc")), std::string("#include \"../other/secret.inc\""),
      std::string("#include \"linked.inc\""), fmt::format("#fopen F \"{}\" read", at("other/kept.txt")),
      fmt::format("sphere {{ 0, 1 pigment {{ image_map {{ png \"{}\" }} }} }}", at("other/image.png"))};
  EXPECT_THAT(refusals(texts), testing::Each(AllOf(HasSubstr("scene.pov:2: "), HasSubstr(line))));
}

// Catches a native renderer that reads what POV-Ray may not, or not what it may.
TEST_P(ConfinementTest, TheNativeRendererReadsTheSameFiles) {
  std::filesystem::create_symlink(at("other/secret.inc"), at("map/linked.inc"));
  for (const std::string& text :
       {std::string("#include \"parts/part.inc\""), fmt::format("#include \"{}\"", at("named/part_of_others.inc")),
        std::string("#include \"part_of_others.inc\""), std::string("#include \"colors.inc\"")}) {
    EXPECT_EQ(native_refusal(text), "it was read") << text;
  }
  const std::string line = fmt::format("add to the map: scene_paths: [{}]", at("other"));
  for (const std::string& text :
       {fmt::format("#include \"{}\"", at("other/secret.inc")), std::string("#include \"../other/secret.inc\""),
        std::string("#include \"linked.inc\""), fmt::format("#include concat(\"{}/sec\", \"ret.inc\")", at("other"))}) {
    EXPECT_THAT(native_refusal(text), AllOf(StartsWith("scene.pov:2: "), HasSubstr(line))) << text;
  }
  EXPECT_EQ(native_refusal("#include \"nowhere.inc\""), "scene.pov:2: the file \"nowhere.inc\" cannot be read");
  EXPECT_EQ(native_refusal("#include \"parts\""), "scene.pov:2: the file \"parts\" cannot be read");
}

// The scene composes a name while it is parsed, so that only the kernel sees it.
TEST_P(ConfinementTest, ANameThatIsPutTogetherIsRefusedByLandlock) {
  const std::string message = refusal(fmt::format("#include concat(\"{}/sec\", \"ret.inc\")", at("other")));
  if (GetParam()) {
    EXPECT_THAT(message, HasSubstr(fmt::format("scene_paths: [{}]", at("other"))));
  } else {
    EXPECT_EQ(message, "it was rendered") << "if this is refused too, describe_confinement() must state it";
  }
}

TEST_P(ConfinementTest, AMissingFileIsReportedWithTheFoldersThatWereSearched) {
  EXPECT_THAT(refusal("#include \"nowhere.inc\""),
              AllOf(HasSubstr("Cannot open include file nowhere.inc"), HasSubstr("looked for in " + at("map")),
                    HasSubstr(at("named")), HasSubstr("add that folder to the map: scene_paths: [FOLDER]")));
}

TEST_P(ConfinementTest, AFolderThatDoesNotExistIsRefused) {
  EXPECT_THAT(render("", {at("map"), at("nowhere")}), FailsWith(ErrorCode::kNotFound, HasSubstr(at("nowhere"))));
}

// Catches an included scene that does not find the files beside it, and a scene that extends its own permissions. The
// folder of an included file is searched, but only if it lies below a folder that the map names.
TEST_P(ConfinementTest, TheFolderOfAnIncludedSceneIsSearched) {
  std::filesystem::create_directories(folder_.path() / "named/deep");
  (void)folder_.write("named/deep/theirs.pov", "#include \"beside.inc\"\nBeside\n");
  (void)folder_.write("named/deep/beside.inc",
                      "#declare Beside = sphere { 0, 1 pigment { image_map { png \"image.png\" } } }\n");
  std::filesystem::copy_file("/usr/share/povray-3.7/include/bumpmap_.png", at("named/deep/image.png"));
  const std::string wrapper = fmt::format("#include \"{}\"", at("named/deep/theirs.pov"));
  const auto image = render(wrapper);
  EXPECT_TRUE(image) << image.error().message;
  const auto closed = render(wrapper, {at("map")});
  ASSERT_FALSE(closed);
  EXPECT_THAT(closed.error().message, HasSubstr(fmt::format("scene_paths: [{}]", at("named/deep"))));
}

// Catches held processes that are confined differently from others, and pixels that depend on the confinement.
TEST_P(ConfinementTest, HeldProcessesAreConfinedAndRenderTheSame) {
  const auto scene = std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/sim_povray/scenes/tiny.pov";
  const std::vector<View> views{View(scene, "lower", 40, 30)};
  const PlaceSettings place{.scene = scene, .render = {.processes = 2, .landlock = GetParam()}};
  auto povray = value(confined_povray(place, {}));
  const auto confined = make_renderer(povray, place.render);
  const auto free = make_renderer(Povray(find_povray("povray").value(), scene, 60s), place.render);
  const auto expected = images(*free, views, 3);
  const auto got = images(*confined, views, 3);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_TRUE(expected[i]) << expected[i].error().message;
    ASSERT_TRUE(got[i]) << got[i].error().message;
    EXPECT_TRUE((*got[i])->bytes == (*expected[i])->bytes) << i;
  }
  EXPECT_THAT(confined->describe(), HasSubstr(GetParam() ? "are held between images" : "no Landlock"));

  const auto before = files();
  ViewTemplate view_template = views[0].view_template();
  view_template.scene += fmt::format("\n#fopen F \"{}\" write\n", at("other/new.txt"));
  View evil = views[0];
  evil.set(view_template);
  for (const auto& image : images(*confined, {evil}, 2)) {
    ASSERT_FALSE(image);
    EXPECT_THAT(image.error().message, HasSubstr("a scene may write no file"));
  }
  EXPECT_EQ(files(), before);
}

TEST_P(ConfinementTest, TheConfinementIsDescribed) {
  PlaceSettings place{.scene = at("map/scene.pov"), .scene_paths = {at("map"), at("named")}};
  place.render.landlock = GetParam();
  const std::string description = describe_confinement(place);
  EXPECT_THAT(description, AllOf(HasSubstr(at("map")), HasSubstr(at("named"))));
  EXPECT_THAT(description, HasSubstr(GetParam() ? "by the kernel (Landlock" : "this kernel has no Landlock"));
}

// Catches a scene that changes the text which other processes of its view read: POV-Ray gets it as an open file.
TEST(SealedFile, CanBeReadAndNotWritten) {
  const base::UniqueFd file = base::sealed_file("scene.pov", "text");
  const std::filesystem::path path = fmt::format("/proc/self/fd/{}", file.get());
  EXPECT_EQ(read_file(path), "text");
  std::ofstream(path, std::ios::binary | std::ios::in) << "evil";
  std::ofstream(path, std::ios::app) << "evil";
  std::ofstream(path, std::ios::trunc) << "evil";
  EXPECT_EQ(read_file(path), "text");
}

TEST(SceneAccess, FollowsLinksAndIsNotFooledByNames) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "a/b");
  std::filesystem::create_directories(folder.path() / "ab");
  std::filesystem::create_directory_symlink(folder.path() / "ab", folder.path() / "a/link");
  const SceneAccess access(folder.path() / "a/scene.pov", {});
  EXPECT_THAT(access.readable(), ElementsAre(std::filesystem::canonical(folder.path() / "a")));
  EXPECT_TRUE(access.may_read(folder.path() / "a/b/x.inc"));
  EXPECT_TRUE(access.may_read(folder.path() / "a/b/../y.inc"));
  EXPECT_FALSE(access.may_read(folder.path() / "ab/x.inc")) << "its name only begins alike";
  EXPECT_FALSE(access.may_read(folder.path() / "a/../ab/x.inc"));
  EXPECT_FALSE(access.may_read(folder.path() / "a/link/x.inc"));
  EXPECT_FALSE(access.may_read("/etc/passwd"));
  EXPECT_TRUE(access.may_read("/usr/share/povray-3.7/include/colors.inc"));
}

TEST(SceneAccess, GivesNoAdviceOnOtherErrors) {
  const SceneAccess access("/nowhere/scene.pov", {});
  EXPECT_THAT(access.advice("a.pov:3: POV-Ray: Parse Error: Undeclared identifier 'Blue'"), IsEmpty());
  EXPECT_THAT(access.advice(""), IsEmpty());
  EXPECT_THAT(access.advice("Cannot open include file colors.inc."), IsEmpty()) << "it is there and may be read";
  EXPECT_THAT(access.advice("Cannot find file 'x.png', even after"), StartsWith("looked for in /nowhere"));
}

// ---- the place of a camera in the scene

TEST(ShownCamera, IsAtThePlaceOfItsStatement) {
  const TemporaryFolder folder;
  // A little more than a quarter turn, so that no axis keeps its direction.
  PlaceSettings place;
  place.scene =
      folder.write("scene.pov", fmt::format("#version 3.7;\n{}union {{\n //*PMName robot\n sphere {{ 0, 1 }} }}\n"
                                            "#declare Turn = 103;\ncamera {{\n //*PMName lower\n perspective "
                                            "location <1, 2, 0.5> direction y up -z right 4/3*x rotate Turn*y "
                                            "translate <3, 0, -7>\n}}\n",
                                            kRoom));
  place.unit_m = 0.05;
  const auto shown = value(shown_camera(place, "robot", "lower", {}));
  // POV-Ray is left-handed: turning about y by t takes x to (cos t, -sin t) in (x, z), which are the world's x and y.
  const double t = 103 * std::acos(-1.0) / 180;
  constexpr double kDigits = 1e-8;  // nine digits of a few units; 20 units are one metre
  EXPECT_NEAR(shown.x_m, 0.05 * (std::cos(t) + 0.5 * std::sin(t) + 3), kDigits);
  EXPECT_NEAR(shown.y_m, 0.05 * (-std::sin(t) + 0.5 * std::cos(t) - 7), kDigits);
  ASSERT_TRUE(shown.x_axis_rad);
  EXPECT_NEAR(*shown.x_axis_rad, -t, kDigits);
}

TEST(ShownCamera, ReportsWhyItCannotBeComputed) {
  const TemporaryFolder folder;
  PlaceSettings place;
  place.scene =
      folder.write("scene.pov", std::string("#version 3.7;\n") + kRoom +
                                    "union {\n //*PMName robot\n sphere { 0, 1 } }\n#declare Own = camera {\n "
                                    "location y }\ncamera {\n //*PMName lower\n Own\n}\n");
  EXPECT_THAT(shown_camera(place, "robot", "lower", {}),
              FailsWith(ErrorCode::kRefused, HasSubstr("begins with 'Own'")));
}

// Catches a request that cannot be cancelled: POV-Ray may parse a scene without end.
TEST(ShownCamera, StopsOnRequest) {
  const TemporaryFolder folder;
  PlaceSettings place;
  place.scene = folder.write("scene.pov", std::string("#version 3.7;\n#while (1) #end\n") +
                                              "union {\n //*PMName robot\n sphere { 0, 1 } }\ncamera {\n //*PMName "
                                              "lower\n location y\n}\n");
  std::stop_source source;
  std::jthread stopper([&source] {
    std::this_thread::sleep_for(300ms);
    source.request_stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(shown_camera(place, "robot", "lower", source.get_token()), FailsWith(ErrorCode::kDisconnected));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
}

}  // namespace
}  // namespace twocone::sim_povray
