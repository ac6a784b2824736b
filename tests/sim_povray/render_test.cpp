// SPDX-License-Identifier: Apache-2.0
// These tests run POV-Ray itself behind the HAL. They fail where it is not installed: `apt install povray`.
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/scene_views.h"
#include "drivers/sim_povray/simulation.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::error_of;
using testing_support::FailsWith;

constexpr double kRoomUnit_m = 0.05;

struct Settings {
  PlaceSettings place{};
  SessionSettings session{};
};

std::unique_ptr<Simulation> opened(const Settings& settings) {
  return value(Simulation::open(settings.place, settings.session));
}

Frame grabbed(Camera& camera) { return value(camera.grab(kRenderLimit)); }

Image pixels(const Frame& frame) { return *value(frame.image(kRenderLimit)); }

/// Returns the first image of a scene's lower camera.
ImageResult first_image(const std::filesystem::path& path, const CameraSettings& size = {32, 24, 15}) {
  Settings settings;
  settings.place.scene = path;
  auto simulation = Simulation::open(settings.place, settings.session);
  if (!simulation) return simulation.error();
  return grabbed(*streaming(**simulation, {"lower", 1, {}}, size)).image(kRenderLimit);
}

// ---- the same pixels

/// Returns all images of a short run, both views in turn.
std::vector<Image> run(int processes, int run_ahead_frames) {
  const auto simulation =
      opened({.place = {.scene = scene_of_tests("tiny.pov"), .render = {.processes = processes}},
              .session = {.body = {.wheels = {.slip = 0.05}, .seed = 3}, .run_ahead_frames = run_ahead_frames}});
  auto lower = streaming(*simulation, {"lower", 1, {}}, {64, 48, 15});
  auto upper = streaming(*simulation, {"upper", 2, {}}, {64, 48, 15});
  auto drive = simulation->open_drive();
  std::vector<Frame> frames;
  for (int i = 0; i < 3; ++i) {
    (void)drive->set_speeds({4, 7});
    frames.push_back(grabbed(*lower));
    frames.push_back(grabbed(*upper));
  }
  std::vector<Image> images;
  for (const Frame& frame : frames) images.push_back(pixels(frame));
  return images;
}

TEST(RenderTest, PixelsDoNotDependOnTheWayOfRendering) {
  const auto one_by_one = run(1, 1);
  const auto ahead = run(4, 6);
  ASSERT_EQ(one_by_one.size(), ahead.size());
  for (std::size_t i = 0; i < ahead.size(); ++i) EXPECT_TRUE(one_by_one[i] == ahead[i]) << "image " << i;
  EXPECT_FALSE(ahead[0] == ahead[2]) << "the robot does not move";
  EXPECT_FALSE(ahead[0] == ahead[1]) << "the two views are the same";
}

TEST(RenderTest, AStampOnePeriodLateShowsThePreviousImage) {
  Settings settings;
  settings.place.scene = scene_of_tests("tiny.pov");
  const auto simulation = opened(settings);
  CameraEffects effects{.stamp_late_s = 0.1};
  auto in_time = streaming(*simulation, {"lower", 1, {}}, {64, 48, 10});
  auto late = streaming(*simulation, {"lower", 1, effects}, {64, 48, 10});
  auto drive = simulation->open_drive();
  std::vector<Frame> now;
  std::vector<Frame> then;
  for (int i = 0; i < 3; ++i) {
    (void)drive->set_speeds({7.0 + i, 9});
    now.push_back(grabbed(*in_time));
    then.push_back(grabbed(*late));
    EXPECT_EQ(then.back().header().captured.since_zero, now.back().header().captured.since_zero);
  }
  EXPECT_TRUE(pixels(then[0]) == pixels(now[0])) << "before time 0 the robot stands";
  for (std::size_t i = 1; i < now.size(); ++i) {
    EXPECT_TRUE(pixels(then[i]) == pixels(now[i - 1])) << "image " << i;
    EXPECT_FALSE(pixels(then[i]) == pixels(now[i])) << "image " << i << ": the robot does not move";
  }
}

TEST(RenderTest, SoftShadowsAreReproducible) {
  // Threads would share blocks of 32 x 32 pixels; this image has 35 of them.
  constexpr CameraSettings kManyBlocks{200, 150, 15};
  const auto first = first_image(scene_of_tests("soft_shadow.pov"), kManyBlocks);
  const auto second = first_image(scene_of_tests("soft_shadow.pov"), kManyBlocks);
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_TRUE(**first == **second);
}

// Catches an image that depends on the user: POV-Ray takes defaults from ./povray.ini, the home folder and POVINI.
TEST(RenderTest, SettingsOfTheUserDoNotChangeTheImage) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(scene_of_tests("tiny.pov"), folder.path() / "tiny.pov");
  std::filesystem::create_directories(folder.path() / ".povray/3.7");
  for (const char* name : {"povray.ini", ".povray/3.7/povray.ini", "mine.ini"}) {
    (void)folder.write(name, "Antialias=On\nQuality=0\nStart_Row=5\n");
  }
  const auto expected = first_image(scene_of_tests("tiny.pov"));
  const std::optional<std::string> home =
      ::getenv("HOME") == nullptr ? std::nullopt : std::optional<std::string>(::getenv("HOME"));
  ::setenv("HOME", folder.path().c_str(), 1);
  ::setenv("POVINI", (folder.path() / "mine.ini").c_str(), 1);
  const auto got = first_image(folder.path() / "tiny.pov");
  ::unsetenv("POVINI");
  home ? ::setenv("HOME", home->c_str(), 1) : ::unsetenv("HOME");
  ASSERT_TRUE(expected) << expected.error().message;
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_TRUE(**got == **expected);
}

TEST(RenderTest, TheSceneIsReadOnce) {
  const TemporaryFolder folder;
  Settings settings;
  settings.place.scene = folder.write("tiny.pov", read_file(scene_of_tests("tiny.pov")));
  const auto simulation = opened(settings);
  (void)folder.write("tiny.pov", "bogus");
  const Image image = pixels(grabbed(*streaming(*simulation, {"lower", 1, {}}, {32, 24, 15})));
  EXPECT_EQ(image.bytes.size(), std::size_t(32 * 24 * 3));
}

// ---- mistakes

TEST(RenderTest, ASyntaxErrorIsNamedWithFileAndLine) {
  const auto path = scene_of_tests("syntax_error.pov");
  EXPECT_THAT(first_image(path),
              FailsWith(ErrorCode::kRefused,
                        path.string() +
                            ":10: POV-Ray: Parse Error: Expected '>', undeclared identifier 'Bogus' found instead"));
}

TEST(RenderTest, MistakesInIncludedFilesAreNamedThere) {
  const TemporaryFolder folder;
  const std::string robot = read_file(scene_of_tests("tiny.pov"));
  (void)folder.write("parts.inc", "\n\nsphere { 0, Nothing }\n");
  EXPECT_THAT(first_image(folder.write("a.pov", "#include \"parts.inc\"\n" + robot)),
              FailsWith(ErrorCode::kRefused, testing::StartsWith("parts.inc:3: POV-Ray: Parse Error: ")));

  EXPECT_THAT(
      first_image(folder.write("b.pov", "\nsphere { 0, 1 pigment { image_map { png \"none.png\" } } }\n" + robot)),
      FailsWith(ErrorCode::kRefused, HasSubstr("b.pov:2: POV-Ray: Possible Parse Error: Cannot find file 'none.png'")));
}

// Version 3.1 allows `#declare H = 5` without a semicolon. Here it stands directly before the camera, in front of which
// the program inserts a directive. POV-Ray must still parse H.
TEST(RenderTest, OldScenesWithoutSemicolonsWork) {
  const TemporaryFolder folder;
  const auto image = first_image(folder.write("old.pov",
                                              "#version 3.1;\nunion { //*PMName robot\n sphere { 0, 1 } }\n#declare "
                                              "H = 5\ncamera { //*PMName lower\n location <0, H, 0> look_at z }\n"));
  EXPECT_TRUE(image) << image.error().message;
}

TEST(RenderTest, ByteOrderMarkAndDosLineEndsAreAccepted) {
  const TemporaryFolder folder;
  std::string text = read_file(scene_of_tests("tiny.pov"));
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.replace(at, 1, "\r\n");
  const auto expected = first_image(scene_of_tests("tiny.pov"));
  const auto got = value(first_image(folder.write("dos.pov", "\xEF\xBB\xBF" + text + "\x1A")));
  EXPECT_TRUE(*got == **expected);
}

// ---- geometry

struct Pixel {
  double column_px = 0;
  double row_px = 0;
};

/// Returns the centroid of all pixels of one colour.
std::optional<Pixel> middle_of(const Image& image, std::array<int, 3> colour) {
  Pixel sum;
  int count = 0;
  for (int row = 0; row < image.height_px; ++row) {
    for (int column = 0; column < image.width_px; ++column) {
      const std::uint8_t* p = &image.bytes[std::size_t(3 * (row * image.width_px + column))];
      if (p[0] != colour[0] || p[1] != colour[1] || p[2] != colour[2]) continue;
      sum.column_px += column;
      sum.row_px += row;
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return Pixel{sum.column_px / count, sum.row_px / count};
}

constexpr std::array<int, 3> kRed{255, 0, 0};
constexpr std::array<int, 3> kGreen{0, 255, 0};
constexpr std::array<int, 3> kBlue{0, 0, 255};
constexpr std::array<int, 3> kYellow{255, 255, 0};
constexpr std::array<int, 3> kMagenta{255, 0, 255};

// A disc of radius r pixels has 2 pi r pixels on its edge. Each pixel belongs to the disc if its centre does, which is
// an error of 0.29 px^2 rms with the lever arm r / sqrt 2, over an area of pi r^2. So the disc's centroid moves by
// 0.164 / sqrt(r) px rms. The tolerance is four times that, for r >= 7.
constexpr double kMiddle_px = 4 * 0.164 / 2.645;

TEST(RenderTest, MarksAppearAtTheComputedPlaces) {
  Settings settings;
  settings.place.scene = scene_of_tests("marks.pov");
  settings.session.body.start = {0.31, -0.47, 0.83};
  settings.session.drive.max_speed_radps = 100;
  const auto simulation = opened(settings);
  constexpr int kWidth_px = 320;
  constexpr int kHeight_px = 240;
  auto lower = streaming(*simulation, {"lower", 1, {}}, {kWidth_px, kHeight_px, 5});
  auto drive = simulation->open_drive();
  auto truth = simulation->open_truth();
  // Column c looks along direction + ((c + 0.5) / W - 0.5) right, |direction| = 1, |right| = 4/3, |up| = 1. The middle
  // of a sphere's elliptic outline lies farther out than the sphere's own middle by the factor 1 / (1 - (radius /
  // ahead)^2).
  const auto seen_at = [](double ahead_m, double left_m, double up_m, double radius_m) {
    const double ahead = ahead_m * (1 - radius_m / ahead_m * (radius_m / ahead_m));
    return Pixel{(-left_m / ahead / (4.0 / 3) + 0.5) * kWidth_px - 0.5, (-up_m / ahead + 0.5) * kHeight_px - 0.5};
  };
  std::vector<Frame> frames;
  std::vector<Pose2> poses;
  for (const WheelSpeeds& speeds : {WheelSpeeds{}, WheelSpeeds{13, 11}, WheelSpeeds{-9, -2}, WheelSpeeds{20, 21}}) {
    (void)drive->set_speeds(speeds);
    frames.push_back(grabbed(*lower));
    poses.push_back(truth->true_pose());
  }
  std::vector<double> columns_px;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Pose2& pose = poses[i];
    const Image image = pixels(frames[i]);
    const double dx_m = 2.1 - pose.x_m;
    const double dy_m = 1.4 - pose.y_m;
    const double c = std::cos(pose.heading_rad);
    const double s = std::sin(pose.heading_rad);
    const Pixel red = seen_at(c * dx_m + s * dy_m, -s * dx_m + c * dy_m, 0.4 - 0.25, 0.1);
    const auto red_seen = middle_of(image, kRed);
    ASSERT_TRUE(red_seen) << "frame " << i;
    EXPECT_NEAR(red_seen->column_px, red.column_px, kMiddle_px) << "frame " << i;
    EXPECT_NEAR(red_seen->row_px, red.row_px, kMiddle_px) << "frame " << i;
    columns_px.push_back(red.column_px);
    // A mark on the robot keeps its place in the robot's camera.
    const Pixel blue = seen_at(0.9, 0, 0.25, 0.03);
    const auto blue_seen = middle_of(image, kBlue);
    ASSERT_TRUE(blue_seen) << "frame " << i;
    EXPECT_NEAR(blue_seen->column_px, blue.column_px, kMiddle_px) << "frame " << i;
    EXPECT_NEAR(blue_seen->row_px, blue.row_px, kMiddle_px) << "frame " << i;
  }
  // The poses differ enough that an image of a wrong pose fails the checks above.
  for (std::size_t i = 1; i < columns_px.size(); ++i) EXPECT_GT(std::abs(columns_px[i] - columns_px[i - 1]), 2) << i;
}

// Catches a mirrored or rotated map, in which marks would change places.
TEST(RenderTest, OverheadShowsXToTheRightAndYUp) {
  const OverheadView view{-2.5, 1.7, -1.9, 1.6, 1.0, 210};
  const auto image = value(render_overhead(scene_of_tests("marks.pov"), kRoomUnit_m, view, {}));
  EXPECT_EQ(image.width_px, 210);
  EXPECT_EQ(image.height_px, 175) << "50 pixels per metre in both directions";
  const auto expect_at = [&](std::array<int, 3> colour, double x_m, double y_m, const char* name) {
    const auto middle = middle_of(image, colour);
    ASSERT_TRUE(middle) << name;
    // Edges agree with pixel borders within half a pixel.
    EXPECT_NEAR(middle->column_px, (x_m + 2.5) * 50 - 0.5, 0.5) << name;
    EXPECT_NEAR(middle->row_px, (1.6 - y_m) * 50 - 0.5, 0.5) << name;
  };
  expect_at(kGreen, -2.0, -1.2, "green box");
  expect_at(kMagenta, 1.1, -1.2, "magenta box");
  expect_at(kBlue, 0.31 + 0.9 * std::cos(0.83), -0.47 + 0.9 * std::sin(0.83),
            "the robot's mark at its place in the scene file");
  EXPECT_FALSE(middle_of(image, kYellow)) << "it is above height_m";
}

TEST(RenderTest, OverheadNamesEveryBadArgument) {
  const std::string complaint = error_of<std::invalid_argument>([] {
    (void)render_overhead(scene_of_tests("marks.pov"), -1, {1, 1, 2, 1, 0, 0}, {});
  });
  for (const char* field : {"min_x_m is 1 m", "max_y_m 1 m", "height_m is 0 m", "width_px is 0", "unit_m is -1 m"}) {
    EXPECT_THAT(complaint, HasSubstr(field));
  }
  EXPECT_THROW((void)render_overhead(scene_of_tests("marks.pov"), 1, {0, 1e-6, 0, 1, 2, 1000}, {}),
               std::invalid_argument);
  EXPECT_THAT(render_overhead(scene_of_tests("none.pov"), 1, {0, 1, 0, 1, 2, 10}, {}), FailsWith(ErrorCode::kNotFound));
}

// ---- processes

/// A scene that POV-Ray never finishes reading.
std::filesystem::path endless(const TemporaryFolder& folder) {
  return folder.write("endless.pov", read_file(scene_of_tests("tiny.pov")) + "#while (1)\n#end\n");
}

TEST(RenderTest, AnEndlessSceneTimesOut) {
  const TemporaryFolder folder;
  const auto simulation = opened({.place = {.scene = endless(folder), .render = {.timeout = 1500ms}}});
  EXPECT_THAT(grabbed(*streaming(*simulation, {"lower", 1, {}}, {32, 24, 15})).image(kRenderLimit),
              FailsWith(ErrorCode::kTimeout,
                        testing::EndsWith("view lower: POV-Ray did not finish within 1.5 s and was killed")));
  EXPECT_TRUE(children_of(::getpid()).empty());
}

TEST(RenderTest, ClosingTheSimulationKillsItsPovRay) {
  const TemporaryFolder folder;
  auto simulation = opened({.place = {.scene = endless(folder)}});
  auto camera = streaming(*simulation, {"lower", 1, {}}, {32, 24, 15});
  const Frame frame = grabbed(*camera);
  ASSERT_TRUE(eventually([] { return !children_of(::getpid()).empty(); }));
  camera.reset();
  simulation.reset();
  EXPECT_TRUE(children_of(::getpid()).empty());
  EXPECT_THAT(frame.image(0ms), FailsWith(ErrorCode::kDisconnected));
}

// Catches a POV-Ray process that continues after its program was killed and could not clean up.
TEST(RenderTest, KillingTheProgramKillsItsPovRay) {
  const TemporaryFolder folder;
  Settings settings;
  settings.place.scene = endless(folder);
  const pid_t program = ::fork();
  ASSERT_GE(program, 0);
  if (program == 0) {
    const auto simulation = opened(settings);
    (void)grabbed(*streaming(*simulation, {"lower", 1, {}}, {32, 24, 15})).image(kRenderLimit);
    ::_exit(0);
  }
  std::vector<pid_t> povrays;
  const bool started = eventually([&] {
    povrays = children_of(program);
    return !povrays.empty() && read_file(fmt::format("/proc/{}/comm", povrays[0])) == "povray\n";
  });
  ::kill(program, SIGKILL);
  ::waitpid(program, nullptr, 0);
  ASSERT_TRUE(started);
  for (const pid_t povray : povrays) EXPECT_TRUE(eventually([&] { return !is_running(povray); }));
}

}  // namespace
}  // namespace twocone::sim_povray
