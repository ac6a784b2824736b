// SPDX-License-Identifier: Apache-2.0
// A world that robots enter one after the other. These tests run POV-Ray itself and fail where it is not installed.
#include <sys/resource.h>

#include <map>
#include <mutex>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/simulation.h"
#include "drivers/sim_povray/simulation_host.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr Pose2 kStart{0.31, -0.47, 0.83};
const std::vector<std::string> kCameras{"lower", "upper"};

PlaceSettings tiny_place() {
  PlaceSettings result{.scene = std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/sim_povray/scenes/tiny.pov",
                       .solids = {{"landmark red", Disc{{2, 0.5}, 0.1}}}};
  // The search for the mirror would render most of the images here, and these are not reported.
  result.render.whole_image = true;
  result.render.processes = 2;
  return result;
}

SessionSettings session(std::optional<Pose2> begin = std::nullopt) {
  return {.body = {.start = kStart, .radius_m = 0.2, .begin = begin}};
}

std::shared_ptr<SimulationHost> host() { return value(SimulationHost::open(tiny_place())); }

/// Returns the simulation of the next episode.
Result<std::unique_ptr<Simulation>> enter(SimulationHost& host, const SessionSettings& settings) {
  if (auto empty = host.reset(); !empty) return empty.error();
  return Simulation::join(host, settings);
}

/// One robot's visit to the world: its simulation, drive, truth and cameras.
struct Visit {
  explicit Visit(std::unique_ptr<Simulation> opened)
      : simulation(std::move(opened)), drive(simulation->open_drive()), truth(simulation->open_truth()) {
    for (const std::string& name : kCameras) {
      cameras.push_back(streaming(*simulation, {name, 1, {}}));
    }
  }
  /// Grabs both views of the next step.
  std::vector<Frame> grab() {
    std::vector<Frame> frames;
    frames.reserve(cameras.size());
    for (const auto& camera : cameras) frames.push_back(value(camera->grab(kRenderLimit)));
    return frames;
  }

  std::unique_ptr<Simulation> simulation;
  std::unique_ptr<DiffDrive> drive;
  std::unique_ptr<GroundTruth> truth;
  std::vector<std::unique_ptr<Camera>> cameras;
};

std::vector<Image> pixels(const std::vector<Frame>& frames) {
  std::vector<Image> images;
  images.reserve(frames.size());
  for (const Frame& frame : frames) images.push_back(*value(frame.image(kRenderLimit)));
  return images;
}

// Catches a host that keeps state of the last robot: its pose, the time, a rate or an image.
TEST(HostResetTest, EachVisitEqualsANewWorldToTheByte) {
  Visit alone(value(Simulation::open(tiny_place(), session())));
  const auto first = pixels(alone.grab());
  (void)alone.drive->set_speeds({9, 4});
  const auto second = pixels(alone.grab());
  ASSERT_FALSE(first == second) << "the robot does not move";

  const auto here = host();
  for (const auto& begin : {std::optional<Pose2>(), std::optional<Pose2>(kStart)}) {
    Visit visit(value(enter(*here, session(begin))));
    EXPECT_EQ(visit.truth->true_pose(), kStart);
    const auto frames = visit.grab();
    EXPECT_EQ(frames.front().header().sequence, 0U);
    EXPECT_EQ(frames.front().header().captured.since_zero, 0ns);
    EXPECT_TRUE(pixels(frames) == first);
    (void)visit.drive->set_speeds({9, 4});
    const auto next = visit.grab();
    EXPECT_EQ(next.front().header().captured.since_zero, 100ms);
    EXPECT_TRUE(pixels(next) == second);
  }
}

// Catches a start elsewhere that moves the robot in the world but not in its images, or twice, or from the wrong place.
TEST(HostResetTest, ARobotThatStartsElsewhereSeesTheSameAsOneThatDroveThere) {
  Visit driver(value(Simulation::open(tiny_place(), session())));
  (void)driver.grab();
  for (int i = 0; i < 5; ++i) {
    (void)driver.drive->set_speeds({9, 4});
    (void)driver.grab();
  }
  const auto expected = pixels(driver.grab());
  const Pose2 now = driver.truth->true_pose();
  ASSERT_NE(now, kStart);

  const auto here = host();
  const Pose2 elsewhere{-0.7, 0.2, 2.9};
  const auto other = pixels(Visit(value(enter(*here, session(elsewhere)))).grab());
  Visit visit(value(enter(*here, session(now))));
  EXPECT_EQ(visit.truth->true_pose(), now);
  const auto frames = visit.grab();
  EXPECT_EQ(frames.front().header().sequence, 0U);
  EXPECT_TRUE(pixels(frames) == expected);
  EXPECT_FALSE(other == expected);
}

TEST(HostResetTest, RefusesASecondRobotAndAStartInAnObstacle) {
  const auto here = host();
  auto first = value(enter(*here, session()));
  auto truth = first->open_truth();
  first.reset();
  EXPECT_THAT(enter(*here, session()),
              FailsWith(ErrorCode::kRefused, HasSubstr("cameras, drive or truth are still there")));

  truth.reset();
  EXPECT_THAT(enter(*here, session(Pose2{1.9, 0.4, 0})),
              FailsWith(ErrorCode::kRefused, "begin of robot touches landmark red"));
  EXPECT_TRUE(enter(*here, session())) << "a refusal leaves the host empty";
}

TEST(HostResetTest, ImagesArriveAfterTheirRobotHasLeft) {
  const auto expected = pixels(Visit(value(Simulation::open(tiny_place(), session()))).grab());
  const auto here = host();
  const auto frames = Visit(value(enter(*here, session()))).grab();
  Visit next(value(enter(*here, session(Pose2{-0.7, 0.2, 2.9}))));
  const auto others = next.grab();
  EXPECT_TRUE(pixels(frames) == expected);
  EXPECT_FALSE(pixels(others) == expected);
}

// ---- the cost of an image

std::chrono::nanoseconds cpu_of_children() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto span = [](const timeval& t) {
    return std::chrono::seconds(t.tv_sec) + std::chrono::microseconds(t.tv_usec);
  };
  return span(usage.ru_utime) + span(usage.ru_stime);
}

class RenderedTest : public testing::TestWithParam<bool> {};

// Catches an image that is reported twice or never, one whose time includes that of earlier images, and the figures of
// another process.
TEST_P(RenderedTest, EachImageIsReportedOnceWithItsCost) {
  constexpr int kFrames = 5;
  // The report excludes the start and the end of the process, the first robot's images, and the start of an image that
  // is no longer required. On a machine with six times as many busy processes as cores, 0.27 was reported.
  constexpr double kLeastShare = 1.0 / 8;
  // The scheduler counts both times; one of them is rounded to microseconds for each process.
  constexpr auto kRounding = 1ms;
  std::mutex mutex;
  std::map<std::pair<std::string, std::uint64_t>, std::vector<RenderedImage>> reported;
  const auto before = cpu_of_children();
  {
    PlaceSettings where = tiny_place();
    where.render.renderer = RendererKind::kPovray;
    where.render.hold = GetParam();
    const auto here = value(SimulationHost::open(where));
    // The first robot requires no report: the cost of its images must not be reported for the next robot.
    (void)pixels(Visit(value(enter(*here, session()))).grab());
    SessionSettings asking = session();
    asking.rendered = [&](const RenderedImage& image) {
      const std::lock_guard lock(mutex);
      reported[{image.camera, image.step}].push_back(image);
    };
    Visit visit(value(enter(*here, asking)));
    for (int i = 0; i < kFrames; ++i) {
      const auto frames = visit.grab();
      (void)pixels(frames);
      const std::lock_guard lock(mutex);
      EXPECT_EQ(reported.size(), 2U * std::size_t(i + 1)) << "not reported before the frame is ready";
    }
  }
  const auto spent = cpu_of_children() - before;
  std::chrono::nanoseconds sum{0};
  for (const std::string& camera : kCameras) {
    for (std::uint64_t step = 0; step < kFrames; ++step) {
      const auto& images = reported[{camera, step}];
      ASSERT_EQ(images.size(), 1U) << camera << " " << step;
      EXPECT_GT(images.front().cpu, 0ns);
      // POV-Ray itself needs more memory than its scene; the size of this program must not count.
      EXPECT_GT(images.front().peak_bytes, std::uint64_t{4} << 20);
      EXPECT_LT(images.front().peak_bytes, std::uint64_t{1} << 30);
      sum += images.front().cpu;
    }
  }
  EXPECT_EQ(reported.size(), 2U * kFrames);
  EXPECT_GT(double(sum.count()), kLeastShare * double(spent.count()))
      << sum.count() << " ns reported of " << spent.count() << " ns";
  EXPECT_LT(sum, spent + kRounding);
}

INSTANTIATE_TEST_SUITE_P(Renderers, RenderedTest, testing::Bool(),
                         [](const auto& test) { return test.param ? "Held" : "OnePerImage"; });

}  // namespace
}  // namespace twocone::sim_povray
