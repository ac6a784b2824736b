// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/both_runs.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/image_file.h"
#include "tests/compare/made_up_side.h"
#include "tests/support/srgb.h"
#include "tests/support/temporary_folder.h"

namespace twocone::compare {
namespace {

using testing::HasSubstr;

// Large enough for tiles of 24 px in a sector.
constexpr int kWidth_px = 240, kHeight_px = 180;
constexpr std::size_t kFew = 4, kTwoParts = kPartFrames + 1;  // frames
constexpr double kGain = 1.2;
// The light grows from sector to sector and falls back behind the robot. The real robot is turned by one sector: if
// that turn is not undone, or undone in the wrong direction, it shows as a gain.
constexpr int kSectors = 6;
constexpr double kTurn_rad = 2 * std::numbers::pi / kSectors;
constexpr double kLogStep = 0.2;

vision::MirrorView view_of(bool mirrored) {
  vision::MirrorViewSettings settings;
  settings.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12};
  settings.lens_height_m = 0.25;
  settings.centre_px = {119.5, 89.5};
  settings.rim_radius_px = 88;
  settings.azimuth_rad = 0.7;
  settings.mirrored = mirrored;
  return vision::MirrorView(settings);
}

/// Draws the view of the invented light from a body with that heading, sRGB-coded, with a little noise.
Image image(const vision::MirrorView& view, double heading_rad, double gain, std::mt19937_64& random) {
  Image image{kWidth_px, kHeight_px, PixelFormat::kRgb8, {}};
  image.bytes.resize(std::size_t(kWidth_px) * kHeight_px * 3);
  std::normal_distribution<double> noise(0, 0.7);
  std::size_t at = 0;
  for (int row = 0; row < kHeight_px; ++row) {
    for (int column = 0; column < kWidth_px; ++column) {
      const auto ray = view.back_project({column, row});
      double light = 0;
      if (ray) {
        const double bearing_rad = std::atan2(ray->direction.y(), ray->direction.x()) + heading_rad;
        const double turns = bearing_rad / (2 * std::numbers::pi);
        light = gain * 0.1 * std::exp(kLogStep * std::floor(kSectors * (turns - std::floor(turns))));
      }
      const double code = testing_support::coded(light);
      for (int colour = 0; colour < 3; ++colour) {
        image.bytes[at++] = std::uint8_t(std::lround(std::clamp(code + (ray ? noise(random) : 0), 0.0, 255.0)));
      }
    }
  }
  return image;
}

class MeasureImagesInParts : public testing::Test {
 protected:
  /// A few different images serve all frames, because making them takes most of the time.
  static Side side(const std::filesystem::path& folder, std::size_t frames, bool mirrored, double heading_rad,
                   double gain, unsigned seed) {
    Side made = made_up_side("memory", made_up_result(), frames);
    made.run.folder = folder;
    made.found = {view_of(mirrored), view_of(mirrored)};
    for (auto& pose : made.reference) pose->heading_rad = heading_rad;
    std::mt19937_64 random(seed);
    std::filesystem::create_directories(folder / "lower");
    std::filesystem::create_directories(folder / "upper");
    for (const std::size_t i : {0, 1, 2}) {
      runlog::write_image(runlog::lower_image_file(folder, i), image(made.found.lower, heading_rad, gain, random));
    }
    for (std::size_t i = 0; i < frames; ++i) {
      if (i > 2)
        std::filesystem::copy_file(runlog::lower_image_file(folder, i % 3), runlog::lower_image_file(folder, i));
      std::filesystem::copy_file(runlog::lower_image_file(folder, (i + 1) % 3), runlog::upper_image_file(folder, i));
    }
    return made;
  }
  void make(std::size_t frames, bool mirrored = false) {
    simulated_ = side(folder_.path() / "simulated", frames, mirrored, 0.3, 1, 1);
    real_ = side(folder_.path() / "real", frames, mirrored, 0.3 + kTurn_rad, kGain, 2);
    for (std::size_t i = 0; i < frames; ++i) pairs_.push_back({i, i});
  }
  [[nodiscard]] ImageWork work(const std::string& name, int jobs = 1) const {
    return {folder_.path() / name, "a key", 1, jobs, {}, nullptr};
  }
  [[nodiscard]] Result<Images> measure(const ImageWork& how) const {
    return measure_images(*simulated_, *real_, pairs_, how);
  }

  testing_support::TemporaryFolder folder_;
  std::optional<Side> simulated_, real_;
  std::vector<Match> pairs_;
};

class MeasureImages : public MeasureImagesInParts, public testing::WithParamInterface<bool> {};

/// Expects that all numbers are equal, to the bit.
void expect_same(const Images& a, const Images& b) {
  EXPECT_EQ(a.unreadable, b.unreadable);
  EXPECT_EQ(a.unreadable_count, b.unreadable_count);
  for (const std::size_t v : {0, 1}) {
    const ViewImages &x = a.views[v], &y = b.views[v];
    EXPECT_EQ(x.simulated_blur_px, y.simulated_blur_px);
    EXPECT_EQ(x.real_blur_px, y.real_blur_px);
    const auto expect_same_noise = [](const vision::NoiseSamples& m, const vision::NoiseSamples& n) {
      EXPECT_EQ(m.images, n.images);
      for (std::size_t block = 0; block < m.blocks.size(); ++block) {
        for (std::size_t bin = 0; bin < m.blocks[block].size(); ++bin) {
          const auto &p = m.blocks[block][bin], &q = n.blocks[block][bin];
          EXPECT_TRUE(p.tiles == q.tiles && p.level == q.level && p.variance == q.variance) << block << " " << bin;
        }
      }
    };
    expect_same_noise(x.simulated_noise, y.simulated_noise);
    expect_same_noise(x.real_noise, y.real_noise);
    ASSERT_EQ(x.transfers.size(), y.transfers.size());
    for (std::size_t i = 0; i < x.transfers.size(); ++i) {
      EXPECT_EQ(x.transfers[i].log_gain, y.transfers[i].log_gain);
      EXPECT_EQ(x.transfers[i].vignetting, y.transfers[i].vignetting);
      EXPECT_EQ(x.transfers[i].tiles, y.transfers[i].tiles);
    }
  }
}

TEST_P(MeasureImages, MeasureTheGainAcrossATurnOfTheRobot) {
  make(kFew, GetParam());
  const auto images = measure(work("work"));
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->unreadable_count, 0U);
  // Dozens of tiles of 64 px with a noise of 0.7 of 100 grey levels: noise causes less than 0.001. The simultaneous fit
  // of a vignette multiplies that by a few.
  constexpr double kLogGain = 0.01;
  static_assert(kLogGain < 0.1 * kLogStep, "a turn that is undone and one that is not can be distinguished");
  for (const ViewImages& view : images->views) {
    ASSERT_EQ(view.transfers.size(), kFew);
    EXPECT_EQ(view.real_noise.images, kFew);
    EXPECT_EQ(view.simulated_noise.images, kFew);
    for (const vision::Transfer& t : view.transfers) {
      for (const double log_gain : t.log_gain) EXPECT_NEAR(log_gain, std::log(kGain), kLogGain);
    }
  }
  // The same with the turn in the wrong direction: two steps of the light appear.
  std::swap(simulated_->reference, real_->reference);
  const auto wrong = measure(work("wrong"));
  ASSERT_TRUE(wrong);
  for (const vision::Transfer& t : wrong->views[0].transfers) {
    EXPECT_NEAR(t.log_gain[0], std::log(kGain) + 2 * kLogStep, 3 * kLogGain);
  }
}
INSTANTIATE_TEST_SUITE_P(BothSenses, MeasureImages, testing::Bool(),
                         [](const auto& sense) { return sense.param ? "Mirrored" : "Plain"; });

TEST_F(MeasureImagesInParts, GiveTheSameWithMoreThreadsAndWhenStoppedAndContinued) {
  make(kTwoParts);
  const auto whole = measure(work("whole")), two = measure(work("two", 2));
  ASSERT_TRUE(whole && two);
  EXPECT_EQ(whole->views[0].transfers.size(), kTwoParts);
  expect_same(*whole, *two);

  std::atomic<bool> stop{false};
  ImageWork cut = work("cut");
  cut.stop = &stop;
  cut.progress = [&stop](double done) {
    EXPECT_NEAR(done, 0.5, 1e-12) << "one of two parts";
    stop = true;
  };
  const auto stopped = measure(cut);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  // Finished parts are not read again, so their images may be removed.
  for (std::size_t i = 0; i < kPartFrames; ++i) {
    std::filesystem::remove(runlog::lower_image_file(real_->run.folder, i));
    std::filesystem::remove(runlog::upper_image_file(simulated_->run.folder, i));
  }
  const auto resumed = measure(work("cut"));
  ASSERT_TRUE(resumed) << resumed.error().message;
  expect_same(*whole, *resumed);
}

TEST_F(MeasureImagesInParts, DoNotUsePartsOfAnotherComparisonNorDamagedOnes) {
  make(kFew);
  ASSERT_TRUE(measure(work("work")));
  std::filesystem::remove(runlog::lower_image_file(real_->run.folder, 3));
  ImageWork other = work("work");
  other.key = "another key";
  const auto again = measure(other);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->unreadable_count, 1U) << "measured again";

  const auto part = folder_.path() / "work" / "000000.json";
  const std::string text = config::read_text(part);
  for (const std::string& damaged : {text.substr(0, text.size() / 2), std::string(), std::string("[]")}) {
    std::ofstream(part, std::ios::binary) << damaged;
    const auto mended = measure(other);
    ASSERT_TRUE(mended);
    expect_same(*again, *mended);
  }
}

TEST_F(MeasureImagesInParts, LeaveOutATruncatedImageAndNameIt) {
  constexpr std::size_t kFrames = 8, kSpoilt = 6;
  make(kFrames);
  const auto file = runlog::lower_image_file(real_->run.folder, 0);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  for (std::size_t i = 1; i <= kSpoilt; ++i) {
    std::ofstream(runlog::upper_image_file(simulated_->run.folder, i)) << "no image";
  }
  const auto images = measure(work("work"));
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->unreadable_count, 1 + kSpoilt);
  ASSERT_EQ(images->unreadable.size(), 5U) << "the first few";
  EXPECT_THAT(images->unreadable[0], HasSubstr(file.string()));
  EXPECT_EQ(images->views[0].real_noise.images, kFrames - 1);
  EXPECT_EQ(images->views[0].simulated_noise.images, kFrames);
  EXPECT_EQ(images->views[0].transfers.size(), kFrames - 1);
  EXPECT_EQ(images->views[1].simulated_noise.images, kFrames - kSpoilt);
  EXPECT_EQ(images->views[1].transfers.size(), kFrames - kSpoilt);
}

TEST_F(MeasureImagesInParts, UseEveryNthFrameAndCompareThoseWithAPartnerOnly) {
  make(7);
  pairs_.resize(3);  // of frames 0, 1, 2
  ImageWork every = work("work");
  every.every = 2;
  const auto images = measure(every);
  ASSERT_TRUE(images);
  EXPECT_EQ(images->views[0].real_noise.images, 4U) << "0, 2, 4, 6";
  EXPECT_EQ(images->views[1].simulated_noise.images, 4U);
  EXPECT_EQ(images->views[0].transfers.size(), 2U) << "0 and 2";
}

}  // namespace
}  // namespace twocone::compare
