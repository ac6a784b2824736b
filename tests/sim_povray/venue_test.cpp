// SPDX-License-Identifier: Apache-2.0
// A world that robots enter one after the other, with POV-Ray itself. Fails where it is not installed.
#include <sys/resource.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/sim_povray.h"
#include "tests/sim_povray/test_support.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

// One picture takes 0.7 s, mostly asleep; a loaded machine many times that.
constexpr auto kLong = 60s;
constexpr CameraSettings kSize{64, 48, 10};
constexpr Pose2 kStart{0.31, -0.47, 0.83};
const std::vector<std::string> kCameras{"lower", "upper"};

PlaceSettings place() {
  PlaceSettings result;
  result.scene = std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/sim_povray/scenes/tiny.pov";
  result.solids = {{"landmark red", Disc{{2, 0.5}, 0.1}}};
  // With the mirror found first, its pictures, which nobody is told of, would be most of what is rendered here.
  result.render.whole_picture = true;
  result.render.processes = 2;
  return result;
}

SeatSettings seat(std::optional<Pose2> begin = std::nullopt) {
  SeatSettings result;
  result.body.start = kStart;
  result.body.begin = begin;
  result.body.radius_m = 0.2;
  return result;
}

template <typename T>
T value(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

Venue venue() { return value(Venue::open(place())); }

/// A robot's visit: what it has opened.
struct Visit {
  explicit Visit(std::unique_ptr<Simulation> opened)
      : simulation(std::move(opened)), drive(simulation->open_drive()), truth(simulation->open_truth()) {
    for (const std::string& name : kCameras) {
      cameras.push_back(value(simulation->open_camera({name, 1, {}})));
      (void)value(cameras.back()->configure(kSize));
      if (auto started = cameras.back()->start(); !started) throw std::runtime_error(started.error().message);
    }
  }
  /// Both views of the next instant.
  std::vector<Frame> grab() {
    std::vector<Frame> frames;
    frames.reserve(cameras.size());
    for (const auto& camera : cameras) frames.push_back(value(camera->grab(kLong)));
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
  for (const Frame& frame : frames) images.push_back(*value(frame.image(kLong)));
  return images;
}

// Catches a venue in which something of the last robot is left: its pose, the time, a rate, a picture.
TEST(VenueTest, EachVisitIsToTheByteAWorldOfItsOwn) {
  Visit alone(value(Simulation::open(place(), seat())));
  const auto first = pixels(alone.grab());
  (void)alone.drive->set_speeds({9, 4});
  const auto second = pixels(alone.grab());
  ASSERT_FALSE(first == second) << "the robot does not move";

  const Venue here = venue();
  for (const auto& begin : {std::optional<Pose2>(), std::optional<Pose2>(kStart)}) {
    Visit visit(value(here.enter(seat(begin))));
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

// Catches a begin that moves the robot in the world and not in its pictures, or twice, or from the wrong place.
TEST(VenueTest, WhoBeginsElsewhereSeesWhatOneWhoDroveThereSees) {
  Visit driver(value(Simulation::open(place(), seat())));
  (void)driver.grab();
  for (int i = 0; i < 5; ++i) {
    (void)driver.drive->set_speeds({9, 4});
    (void)driver.grab();
  }
  const auto expected = pixels(driver.grab());
  const Pose2 now = driver.truth->true_pose();
  ASSERT_NE(now, kStart);

  const Venue here = venue();
  const Pose2 elsewhere{-0.7, 0.2, 2.9};
  const auto other = pixels(Visit(value(here.enter(seat(elsewhere)))).grab());
  Visit visit(value(here.enter(seat(now))));
  EXPECT_EQ(visit.truth->true_pose(), now);
  const auto frames = visit.grab();
  EXPECT_EQ(frames.front().header().sequence, 0U);
  EXPECT_TRUE(pixels(frames) == expected);
  EXPECT_FALSE(other == expected);
}

TEST(VenueTest, RefusesASecondRobotAndABeginInAnObstacle) {
  const Venue here = venue();
  auto first = value(here.enter(seat()));
  auto truth = first->open_truth();
  first.reset();
  const auto second = here.enter(seat());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kRefused);
  EXPECT_THAT(second.error().message, HasSubstr("cameras, drive or truth are still there"));

  truth.reset();
  const auto inside = here.enter(seat(Pose2{1.9, 0.4, 0}));
  ASSERT_FALSE(inside);
  EXPECT_EQ(inside.error().code, ErrorCode::kRefused);
  EXPECT_EQ(inside.error().message, "begin of robot touches landmark red");
  EXPECT_TRUE(here.enter(seat())) << "a refusal leaves the venue empty";
}

TEST(VenueTest, PicturesComeThoughTheirRobotHasLeft) {
  const auto expected = pixels(Visit(value(Simulation::open(place(), seat()))).grab());
  const Venue here = venue();
  const auto frames = Visit(value(here.enter(seat()))).grab();
  Visit next(value(here.enter(seat(Pose2{-0.7, 0.2, 2.9}))));
  const auto others = next.grab();
  EXPECT_TRUE(pixels(frames) == expected);
  EXPECT_FALSE(pixels(others) == expected);
}

// ---- what a picture took

std::chrono::nanoseconds cpu_of_children() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto span = [](const timeval& t) {
    return std::chrono::seconds(t.tv_sec) + std::chrono::microseconds(t.tv_usec);
  };
  return span(usage.ru_utime) + span(usage.ru_stime);
}

class RenderedTest : public testing::TestWithParam<bool> {};

// Catches a picture that is told twice or not, one that is charged with its forerunners' time, and another process's
// figures.
TEST_P(RenderedTest, EachPictureIsToldOnceWithWhatItTook) {
  constexpr int kFrames = 5;
  // What is told leaves out the process's ending, and the beginning of a picture that is not asked for any more.
  constexpr double kLeastShare = 1.0 / 3;
  // Both are what the scheduler has counted; the one is rounded to microseconds for each process.
  constexpr auto kRounding = 1ms;
  std::mutex mutex;
  std::map<std::pair<std::string, std::uint64_t>, std::vector<RenderedPicture>> told;
  const auto before = cpu_of_children();
  {
    PlaceSettings where = place();
    where.render.hold = GetParam();
    const Venue here = value(Venue::open(where));
    // Of the first robot nothing is asked: what its pictures took must not be told of the next one's.
    (void)pixels(Visit(value(here.enter(seat()))).grab());
    SeatSettings asking = seat();
    asking.rendered = [&](const RenderedPicture& picture) {
      const std::lock_guard lock(mutex);
      told[{picture.camera, picture.tick}].push_back(picture);
    };
    Visit visit(value(here.enter(asking)));
    for (int i = 0; i < kFrames; ++i) {
      const auto frames = visit.grab();
      (void)pixels(frames);
      const std::lock_guard lock(mutex);
      EXPECT_EQ(told.size(), 2U * std::size_t(i + 1)) << "not told before the frame is ready";
    }
  }
  const auto spent = cpu_of_children() - before;
  std::chrono::nanoseconds sum{0};
  for (const std::string& camera : kCameras) {
    for (std::uint64_t tick = 0; tick < kFrames; ++tick) {
      const auto& pictures = told[{camera, tick}];
      ASSERT_EQ(pictures.size(), 1U) << camera << " " << tick;
      EXPECT_GT(pictures.front().cpu, 0ns);
      // POV-Ray alone maps more than its scene; this program's own size is none of its business.
      EXPECT_GT(pictures.front().peak_bytes, std::uint64_t{4} << 20);
      EXPECT_LT(pictures.front().peak_bytes, std::uint64_t{1} << 30);
      sum += pictures.front().cpu;
    }
  }
  EXPECT_EQ(told.size(), 2U * kFrames);
  EXPECT_GT(double(sum.count()), kLeastShare * double(spent.count()))
      << sum.count() << " ns told of " << spent.count() << " ns";
  EXPECT_LT(sum, spent + kRounding);
}

INSTANTIATE_TEST_SUITE_P(Renderers, RenderedTest, testing::Bool(),
                         [](const auto& test) { return test.param ? "Held" : "OnePerPicture"; });

}  // namespace
}  // namespace twocone::sim_povray
