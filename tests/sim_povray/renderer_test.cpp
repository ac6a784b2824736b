// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/pool_renderer.h"

#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing_support::FailsWith;

using namespace std::chrono_literals;

constexpr const char* kPrintOnePixel = "printf 'P6 1 1 255\\nabc'";

class RendererTest : public testing::Test {
 protected:
  [[nodiscard]] Povray povray(const std::string& commands) const {
    return {folder_.script("povray", commands), folder_.path() / "lab.pov", kChildLimit};
  }
  static RenderJob job(const std::string& scene) { return plain_image("frame 0, view lower", scene, 1, 1, 1); }
  void TearDown() override { EXPECT_TRUE(children_of(::getpid()).empty()) << "a child was not reaped"; }

  TemporaryFolder folder_;
};

TEST_F(RendererTest, OneProcessWorksInOrder) {
  ProcessRenderer renderer(povray("cat /proc/self/fd/3 >> order; " + std::string(kPrintOnePixel)), 1);
  std::vector<std::future<ImageResult>> images;
  for (int i = 0; i < 9; ++i) images.push_back(ordered(renderer, job(std::to_string(i))));
  for (auto& image : images) EXPECT_TRUE(image.get());
  EXPECT_EQ(read_file(folder_.path() / "order"), "012345678");
}

// Each script waits until three have started; if fewer ran at once, none would end.
TEST_F(RendererTest, SeveralProcessesWorkAtOneTime) {
  ProcessRenderer renderer(povray("touch begun.$$; while [ $(ls begun.* | wc -l) -lt 3 ]; do sleep 0.01; done; " +
                                  std::string(kPrintOnePixel)),
                           3);
  std::vector<std::future<ImageResult>> images;
  for (int i = 0; i < 3; ++i) images.push_back(ordered(renderer, job("")));
  for (auto& image : images) EXPECT_TRUE(image.get());
}

TEST_F(RendererTest, AFailedImageDoesNotAffectTheNext) {
  ProcessRenderer renderer(povray("grep -q bad /proc/self/fd/3 && exit 1; " + std::string(kPrintOnePixel)), 1);
  auto bad = ordered(renderer, job("bad"));
  auto good = ordered(renderer, job("good"));
  EXPECT_FALSE(bad.get());
  EXPECT_TRUE(good.get());
}

// Catches a promise that is dropped (the waiting thread gets std::future_error) and a process that continues to run.
TEST_F(RendererTest, ClosingKillsProcessesAndAnswersWaitingJobs) {
  std::vector<std::future<ImageResult>> images;
  const auto begin = std::chrono::steady_clock::now();
  {
    ProcessRenderer renderer(povray("touch begun.$$; exec sleep 1000"), 2);
    for (int i = 0; i < 5; ++i) images.push_back(ordered(renderer, job("")));
    ASSERT_TRUE(eventually([&] {
      int begun = 0;
      for (const auto& file : std::filesystem::directory_iterator(folder_.path())) {
        begun += file.path().filename().string().starts_with("begun") ? 1 : 0;
      }
      return begun == 2;
    }));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kChildLimit);
  for (auto& image : images) {
    ASSERT_EQ(image.wait_for(0s), std::future_status::ready);
    EXPECT_THAT(image.get(), FailsWith(ErrorCode::kDisconnected,
                                       testing::HasSubstr("frame 0, view lower: the simulation was closed")));
  }
}

}  // namespace
}  // namespace twocone::sim_povray
