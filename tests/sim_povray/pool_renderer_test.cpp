// SPDX-License-Identifier: Apache-2.0
// Held POV-Ray processes. The tests use POV-Ray itself: an emulator would only repeat our assumptions about it.
#include "drivers/sim_povray/render/povray/pool_renderer.h"

#include <sys/resource.h>
#include <sys/wait.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr auto kShortTimeout = 1s;

std::string program() { return value(find_povray("povray")); }

class PoolRendererTest : public testing::Test {
 protected:
  [[nodiscard]] PoolSettings settings(int processes) const {
    PoolSettings s{.processes = processes, .scratch_roots = {scratch_.path()}};
    return s;
  }
  [[nodiscard]] bool scratch_is_empty() const { return std::filesystem::is_empty(scratch_.path()); }
  void TearDown() override {
    EXPECT_TRUE(children_of(::getpid()).empty()) << "a child was not reaped";
    EXPECT_TRUE(scratch_is_empty()) << "a file was left on the disk";
  }

  /// POV-Ray processes that work for this test: their command line names the scratch folder.
  [[nodiscard]] std::vector<pid_t> held(pid_t parent = ::getpid()) const {
    std::vector<pid_t> result;
    for (const pid_t child : children_of(parent)) {
      const std::string command = read_file("/proc/" + std::to_string(child) + "/cmdline");
      if (command.find("+KFF") != std::string::npos) result.push_back(child);
    }
    return result;
  }

  TemporaryFolder folder_;
  TemporaryFolder scratch_;
};

constexpr const char* kHeld = "POV-Ray processes are held between images";

// ---- the same pixels

struct PoolCase {
  const char* name;
  std::filesystem::path path;
  const char* camera;
  int width_px;
  int antialias;
  std::optional<Window> window;
};
void PrintTo(const PoolCase& c, std::ostream* out) { *out << c.name; }

class SamePixels : public PoolRendererTest, public testing::WithParamInterface<PoolCase> {};

// Each process renders three images, so that state which it carries from one to the next would show.
TEST_P(SamePixels, AsOneProcessPerImage) {
  const PoolCase& c = GetParam();
  View view(c.path, c.camera, c.width_px, c.width_px * 3 / 4, c.antialias);
  ViewTemplate windowed = view.view_template();
  windowed.window = c.window;
  view.set(windowed);
  const Povray povray(program(), c.path, kRenderLimit);
  PoolRenderer pool(povray, settings(1));
  ProcessRenderer one_by_one(povray, 3);
  const auto got = images(pool, {view}, 3);
  const auto expected = images(one_by_one, {view}, 3);
  ASSERT_EQ(pool.describe(), kHeld);
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_TRUE(got[i]) << got[i].error().message;
    ASSERT_TRUE(expected[i]) << expected[i].error().message;
    EXPECT_TRUE(**got[i] == **expected[i]) << "pose " << i;
  }
  EXPECT_FALSE(**got[0] == **got[1]) << "the pose has no effect on the image";
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, SamePixels,
    testing::Values(PoolCase{"lab", lab_scene(), "lower", 160, 1, {}},
                    PoolCase{"antialiased", scene_of_tests("tiny.pov"), "upper", 160, 3, {}},
                    PoolCase{"window", scene_of_tests("tiny.pov"), "lower", 160, 1, Window{20, 140, 1, 118}},
                    PoolCase{"area_light_with_jitter", scene_of_tests("soft_shadow.pov"), "lower", 160, 1, {}},
                    PoolCase{"radiosity_and_random_numbers", scene_of_tests("bounced_light.pov"), "lower", 96, 2, {}}),
    [](const auto& test) { return test.param.name; });

TEST_F(PoolRendererTest, OutsideTheWindowIsBlack) {
  View view(scene_of_tests("tiny.pov"), "lower", 80, 60);
  ViewTemplate view_template = view.view_template();
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(2));
  const auto whole = images(pool, {view}, 1);
  view_template.window = Window{10, 69, 4, 50};
  view.set(view_template);
  const auto part = images(pool, {view}, 1);
  ASSERT_TRUE(whole[0] && part[0]);
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 80; ++column) {
      const bool inside = column >= 10 && column <= 69 && row >= 4 && row <= 50;
      const auto at = std::size_t(3 * (row * 80 + column));
      for (std::size_t i = at; i < at + 3; ++i) {
        ASSERT_EQ((*part[0])->bytes[i], inside ? (*whole[0])->bytes[i] : 0) << "column " << column << ", row " << row;
      }
    }
  }
}

// ---- how many processes

TEST_F(PoolRendererTest, NothingIsStartedBeforeTheFirstImage) {
  const PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(8));
  EXPECT_EQ(pool.describe(), kHeld);
  EXPECT_TRUE(scratch_is_empty());
}

TEST_F(PoolRendererTest, SingleImagesNeedOneProcess) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(8));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(ordered(pool, view.job(i)).get());
    std::this_thread::sleep_for(600ms);  // POV-Ray waits for the next pose again after 0.23 s
  }
  EXPECT_EQ(held().size(), 1U);
}

TEST_F(PoolRendererTest, ManyImagesGetAllProcessesAndTheViewsShareThem) {
  const std::vector<View> views{{scene_of_tests("tiny.pov"), "lower", 32, 24},
                                {scene_of_tests("tiny.pov"), "upper", 32, 24}};
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(4));
  for (const auto& image : images(pool, views, 8)) EXPECT_TRUE(image);
  EXPECT_EQ(held().size(), 4U);
}

// There are more view templates than processes, and each must be rendered.
TEST_F(PoolRendererTest, AProcessIsGivenUpForAnotherViewTemplate) {
  std::vector<View> views;
  for (int i = 0; i < 3; ++i) views.emplace_back(scene_of_tests("tiny.pov"), "lower", 32 + i, 24);
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(2));
  for (const auto& image : images(pool, views, 2)) EXPECT_TRUE(image) << image.error().message;
  EXPECT_LE(held().size(), 2U);
}

TEST_F(PoolRendererTest, AnIdleProcessEndsAndTheNextImageStartsAnother) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  PoolSettings brief = settings(2);
  brief.idle = 100ms;
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), brief);
  ASSERT_TRUE(ordered(pool, view.job(0)).get());
  EXPECT_TRUE(eventually([&] { return held().empty(); }));
  EXPECT_TRUE(ordered(pool, view.job(1)).get());
}

// ---- processes that misbehave

TEST_F(PoolRendererTest, AKilledProcessCostsNoImage) {
  const View view(lab_scene(), "lower", 160, 120);
  const Povray povray(program(), lab_scene(), kRenderLimit);
  PoolRenderer pool(povray, settings(2));
  std::vector<std::future<ImageResult>> futures;
  for (int i = 0; i < 4; ++i) futures.push_back(ordered(pool, view.job(i)));
  ASSERT_TRUE(eventually([&] { return held().size() == 2; }));
  std::this_thread::sleep_for(300ms);  // so that they render; the exact moment does not matter for the checks below
  for (const pid_t pid : held()) ::kill(pid, SIGKILL);
  ProcessRenderer one_by_one(povray, 4);
  const auto expected = images(one_by_one, {view}, 4);
  for (std::size_t i = 0; i < futures.size(); ++i) {
    const auto got = value(futures[i].get());
    EXPECT_TRUE(*got == **expected[i]) << "pose " << i;
  }
}

TEST_F(PoolRendererTest, AProcessThatAlwaysDiesIsNotRetriedForever) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  PoolRenderer pool(
      Povray(folder_.script("povray", "echo x >> begun; kill -SEGV $$"), folder_.path() / "lab.pov", kRenderLimit),
      settings(1));
  EXPECT_THAT(ordered(pool, view.job(7)).get(),
              FailsWith(ErrorCode::kDisconnected, "frame 7: POV-Ray crashed (SIGSEGV)"));
  EXPECT_EQ(read_file(folder_.path() / "begun"), "x\nx\nx\n");
}

// A broken lease lets POV-Ray read an old pose: here the first process counts from another frame.
TEST_F(PoolRendererTest, AnImageOfAnOldPoseIsNotReturned) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  const std::string script =
      folder_.script("povray", "if [ -e begun ]; then exec " + program() + " \"$@\"; fi; touch begun; exec " +
                                   program() + " \"$@\" +KFI5");
  PoolRenderer pool(Povray(script, folder_.path() / "lab.pov", kRenderLimit), settings(1));
  ProcessRenderer one_by_one(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), 1);
  const auto got = ordered(pool, view.job(3)).get();
  const auto expected = ordered(one_by_one, view.job(3)).get();
  ASSERT_TRUE(got) << got.error().message;
  ASSERT_TRUE(std::filesystem::exists(folder_.path() / "begun"));
  EXPECT_TRUE(**got == **expected);
}

TEST_F(PoolRendererTest, MistakesInTheSceneAreReportedAsWithOneProcessPerImage) {
  const std::string tiny = read_file(scene_of_tests("tiny.pov"));
  const auto before = folder_.write("before.pov", "sphere { 0, Bogus }\n" + tiny);
  const auto after = folder_.write("after.pov", tiny + "\nsphere { 0, Bogus }\n");
  for (const auto& path : {before, after}) {
    const View view(path, "lower", 32, 24);
    const Povray povray(program(), path, kRenderLimit);
    PoolRenderer pool(povray, settings(2));
    ProcessRenderer one_by_one(povray, 1);
    const auto expected = ordered(one_by_one, view.job(0)).get();
    ASSERT_FALSE(expected);
    for (const auto& got : images(pool, {view}, 3)) {
      EXPECT_THAT(got, FailsWith(ErrorCode::kRefused, expected.error().message));
    }
  }
}

TEST_F(PoolRendererTest, AProcessThatTakesTooLongIsKilled) {
  const std::string tiny = read_file(scene_of_tests("tiny.pov"));
  const std::string endless = "#while (true) #end\n";
  for (const auto& path : {folder_.write("before.pov", endless + tiny), folder_.write("after.pov", tiny + endless)}) {
    const View view(path, "lower", 32, 24);
    PoolRenderer pool(Povray(program(), path, kShortTimeout), settings(1));
    EXPECT_THAT(ordered(pool, view.job(5)).get(),
                FailsWith(ErrorCode::kTimeout, "frame 5: POV-Ray did not finish within 1 s and was killed"));
  }
}

// ---- the end

TEST_F(PoolRendererTest, ClosingAnswersPendingJobs) {
  const View view(lab_scene(), "lower", 640, 480);
  std::vector<std::future<ImageResult>> futures;
  {
    PoolRenderer pool(Povray(program(), lab_scene(), kRenderLimit), settings(2));
    for (int i = 0; i < 9; ++i) futures.push_back(ordered(pool, view.job(i)));
    std::this_thread::sleep_for(400ms);
  }
  for (auto& future : futures) {
    ASSERT_EQ(future.wait_for(0s), std::future_status::ready);
    const auto image = future.get();
    if (image) continue;  // finished in time
    EXPECT_EQ(image.error().code, ErrorCode::kDisconnected);
    EXPECT_THAT(image.error().message, HasSubstr("the simulation was closed before POV-Ray had"));
  }
}

TEST_F(PoolRendererTest, KillingTheProgramLeavesNoProcessAndNoFolder) {
  const View view(lab_scene(), "lower", 640, 480);
  const pid_t program_pid = ::fork();
  ASSERT_GE(program_pid, 0);
  if (program_pid == 0) {
    PoolRenderer pool(Povray(program(), lab_scene(), kRenderLimit), settings(3));
    for (int i = 0; i < 100; ++i) (void)ordered(pool, view.job(i));
    std::this_thread::sleep_for(kRenderLimit);
    ::_exit(1);
  }
  EXPECT_TRUE(eventually([&] { return held(program_pid).size() == 3; }));
  const std::vector<pid_t> processes = held(program_pid);
  EXPECT_FALSE(scratch_is_empty());
  ::kill(program_pid, SIGKILL);
  ::waitpid(program_pid, nullptr, 0);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([&] {
    return scratch_is_empty() &&
           std::none_of(processes.begin(), processes.end(), [](pid_t p) { return is_running(p); });
  }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
}

// ---- where processes cannot be held

TEST_F(PoolRendererTest, WithoutLeasesEachImageHasItsProcess) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(2), "no leases here");
  EXPECT_TRUE(ordered(pool, view.job(0)).get());
  EXPECT_EQ(pool.describe(), "one POV-Ray process per image: no leases here");
}

TEST_F(PoolRendererTest, WithoutAScratchFolderEachImageHasItsProcess) {
  const View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  PoolSettings nowhere = settings(2);
  nowhere.scratch_roots = {folder_.path() / "none"};
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), nowhere);
  for (const auto& image : images(pool, {view}, 3)) EXPECT_TRUE(image);
  EXPECT_THAT(pool.describe(), HasSubstr("one POV-Ray process per image: no folder for images"));
}

// POV-Ray cannot write the image, as on a full disk. No image is lost.
TEST_F(PoolRendererTest, WithoutSpaceForAnImageEachHasItsProcess) {
  const View view(scene_of_tests("tiny.pov"), "lower", 320, 240);
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const rlimit tight{40'000, old.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  {
    PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(2));
    for (const auto& image : images(pool, {view}, 3)) EXPECT_TRUE(image) << image.error().message;
    EXPECT_THAT(pool.describe(), HasSubstr("one POV-Ray process per image: POV-Ray cannot write to"));
    EXPECT_TRUE(ordered(pool, view.job(3)).get());
  }
  ::setrlimit(RLIMIT_FSIZE, &old);
}

TEST_F(PoolRendererTest, AViewTemplateThatMustNotBeHeldGetsNoHeldProcess) {
  View view(scene_of_tests("tiny.pov"), "lower", 32, 24);
  ViewTemplate view_template = view.view_template();
  view_template.one_shot = "the scene says frame_number";
  view.set(view_template);
  PoolRenderer pool(Povray(program(), scene_of_tests("tiny.pov"), kRenderLimit), settings(2));
  EXPECT_TRUE(ordered(pool, view.job(0)).get());
  EXPECT_TRUE(scratch_is_empty());
  EXPECT_EQ(pool.describe(), std::string(kHeld) + "; one POV-Ray process per image where the scene says frame_number");
}

}  // namespace
}  // namespace twocone::sim_povray
