// SPDX-License-Identifier: Apache-2.0
#include "apps/import/import_run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runs/run.h"
#include "localisation/odometry.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

const std::string kSmall = TWOCONE_SOURCE_DIR "/tests/end_to_end/data/small.yaml";
constexpr int kFrames = 9;
constexpr std::int64_t kPeriod_ns = 66'666'667;
constexpr std::int64_t kSkew_ns = 4'000'001;
// A time of 2023. A double in seconds would lose the nanoseconds.
constexpr std::int64_t kBegin_ns = 1'700'000'000'123'456'789;

std::int64_t time_ns(int frame) { return kBegin_ns + frame * kPeriod_ns; }
std::string seconds(std::int64_t ns) { return fmt::format("{}.{:09}", ns / 1'000'000'000, ns % 1'000'000'000); }

/// Images with nanosecond names, as another program would record them.
class ImportRun : public testing::Test {
 protected:
  ImportRun() {
    fs::create_directories(recording_.lower);
    fs::create_directories(recording_.upper);
    for (int i = 0; i < kFrames; ++i) {
      runlog::write_image(lower(i), image(i));
      runlog::write_image(upper(i), image(100 + i));
    }
  }

  static Image image(int level) {
    return {160, 120, PixelFormat::kRgb8, std::vector<std::uint8_t>(160 * 120 * 3, std::uint8_t(level))};
  }
  [[nodiscard]] fs::path lower(int i) const { return recording_.lower / fmt::format("{}.png", time_ns(i)); }
  [[nodiscard]] fs::path upper(int i) const { return recording_.upper / fmt::format("{}.png", time_ns(i) + kSkew_ns); }

  void give_odometry(int first = 0, int last = kFrames - 1) {
    std::string text = "t_s,left_rad,right_rad\n";
    for (int i = first; i <= last; ++i) text += fmt::format("{},{},{}\n", seconds(time_ns(i)), 0.3 * i, 0.5 * i);
    recording_.odometry = folder_.write("odometry.csv", text);
  }
  void give_trajectory(int first, int last) {
    std::string text = "# by cameras on the ceiling\n";
    for (int i = first; i <= last; ++i) text += fmt::format("{} {} 0.5 0 0 0 0 1\n", seconds(time_ns(i)), 0.01 * i);
    recording_.trajectory = folder_.write("mocap.tum", text);
  }
  Imported import() {
    return import_run(recording_, out_, [](double) {});
  }
  std::string refusal() {
    std::string error = testing_support::error_of<std::exception>([&] { import(); });
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_FALSE(fs::exists(out_)) << "a partial run";
    return error;
  }

  const testing_support::TemporaryFolder folder_;
  const fs::path out_ = folder_.path() / "run";
  Recording recording_ = [this] {
    Recording recording;
    recording.robot_file = kSmall;
    recording.lower = folder_.path() / "cam0";
    recording.upper = folder_.path() / "cam1";
    return recording;
  }();
};

TEST_F(ImportRun, GivesTheRunThatWasRecorded) {
  give_odometry();
  give_trajectory(0, kFrames - 1);
  EXPECT_EQ(import().frames, std::size_t(kFrames));
  const runlog::RunData run = runlog::read_run(out_);
  ASSERT_EQ(run.frames.size(), std::size_t(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    const runlog::FrameRow& frame = run.frames[std::size_t(i)];
    EXPECT_EQ(frame.frame, std::uint64_t(i));
    EXPECT_EQ(frame.t_s, double(i * kPeriod_ns) / 1e9) << "to the nanosecond";
    EXPECT_EQ(frame.lower_t_s, frame.t_s);
    EXPECT_EQ(frame.upper_t_s, double(i * kPeriod_ns + kSkew_ns) / 1e9);
    EXPECT_EQ(frame.skew_s, double(kSkew_ns) / 1e9);
    EXPECT_EQ(frame.lower_sequence, std::uint64_t(i));
    EXPECT_EQ(frame.lower_lost + frame.upper_lost, 0U);
    EXPECT_FALSE(frame.host_t_s.has_value()) << "unknown";
    const auto number = std::uint64_t(i);
    EXPECT_EQ(runlog::read_image(runlog::lower_image_file(out_, number))->bytes, image(i).bytes);
    EXPECT_EQ(runlog::read_image(runlog::upper_image_file(out_, number))->bytes, image(100 + i).bytes);
    EXPECT_TRUE(fs::equivalent(runlog::lower_image_file(out_, number), lower(i))) << "a hard link";
    EXPECT_FALSE(run.drive[number].left_command_radps.has_value());
    EXPECT_DOUBLE_EQ(run.truth[number].x_m, 0.01 * i);
    EXPECT_DOUBLE_EQ(run.drive[number].right_rad, 0.5 * i);
  }
  localisation::Odometry odometry({0.05, 0.30}, {});
  odometry.update(0, 0);
  EXPECT_NEAR(run.odometry[1].y_m, odometry.update(0.3, 0.5).y_m, 1e-15) << "m, with the robot file's wheels";
  EXPECT_EQ(run.info.behaviour, "imported");
  EXPECT_TRUE(run.info.finished);
  EXPECT_THAT(run.info.events, Contains(HasSubstr("lower: 9 of 9 images of")));
  EXPECT_THAT(run.info.events, Contains(HasSubstr("truth.tum is a given trajectory, of")));
  EXPECT_THAT(run.info.events, Contains("t = 0 is 1700000000.123456789 s of the recording's clock"));
  ASSERT_TRUE(run.info.capture.has_value());
  EXPECT_EQ(run.info.capture->unpaired, 0U);
}

TEST_F(ImportRun, ImagesWithoutAPartnerOrNeverStoredAreLost) {
  fs::remove(upper(2));
  fs::remove(lower(4));
  fs::remove(upper(4));
  const Imported imported = import();
  EXPECT_EQ(imported.frames, 7U);
  const runlog::RunData run = runlog::read_run(out_);
  EXPECT_EQ(run.frames[2].lower_sequence, 3U);
  EXPECT_EQ(run.frames[2].upper_sequence, 2U);
  EXPECT_EQ(run.frames[2].lower_lost, 1U) << "frame 2, skipped";
  EXPECT_EQ(run.frames[2].upper_lost, 1U) << "frame 2, never stored";
  EXPECT_EQ(run.frames[3].lower_lost, 1U);
  EXPECT_EQ(run.frames[3].upper_lost, 1U);
  EXPECT_EQ(run.info.capture->unpaired, 1U);
  EXPECT_THAT(imported.events, Contains(HasSubstr("1 images without a partner within 33.333 ms are left out")));
}

TEST_F(ImportRun, WithoutOdometryTheWheelTablesAreEmpty) {
  const Imported imported = import();
  EXPECT_THAT(imported.events, Contains(HasSubstr("no odometry was given")));
  const runlog::RunData run = runlog::read_run(out_);
  EXPECT_FALSE(has_odometry(run));
  EXPECT_TRUE(run.drive.empty());
  EXPECT_TRUE(run.truth.empty());
  const auto again = runs::localise(out_, estimation::Method::kOutline, [](double) {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_TRUE(again->estimate.empty()) << "grey images give no position, and there are no wheels";
  EXPECT_EQ(again->fixes.size(), std::size_t(kFrames));
  const fs::path other = folder_.path() / "other";
  runs::copy_run_with({kSmall, {}}, out_, other);
  EXPECT_FALSE(has_odometry(runlog::read_run(other)));
}

TEST_F(ImportRun, WithoutOdometryItHasNoError) {
  give_trajectory(0, kFrames - 1);
  import();
  const runlog::Summary summary = runlog::summarise(runlog::read_run(out_));
  EXPECT_TRUE(summary.travelled_m.has_value());
  EXPECT_FALSE(summary.odometry_error.has_value()) << "there are no wheel readings";
}

TEST_F(ImportRun, ARecordersRunWithoutOdometryIsStillRefused) {
  import();
  std::string yaml = config::read_text(out_ / "run.yaml");
  yaml.replace(yaml.find("imported"), 8, "wander");
  runlog::write_whole(out_ / "run.yaml", yaml);
  EXPECT_THROW(runlog::read_run(out_), config::FileError);
}

TEST_F(ImportRun, FramesThatTrajectoryOrOdometryDoNotCoverAreLeftOut) {
  give_trajectory(1, kFrames - 1);
  give_odometry(0, kFrames - 2);
  const Imported imported = import();
  EXPECT_EQ(imported.frames, std::size_t(kFrames - 2));
  const runlog::RunData run = runlog::read_run(out_);
  EXPECT_EQ(run.frames[0].t_s, 0) << "frame 1 becomes the first";
  EXPECT_EQ(run.frames[0].lower_sequence, 1U);
  EXPECT_EQ(run.truth.size(), run.frames.size());
  EXPECT_THAT(imported.events, Contains(HasSubstr("1 frames are left out because " + recording_.trajectory.string())));
  EXPECT_THAT(imported.events, Contains(HasSubstr("1 frames are left out because " + recording_.odometry.string())));
}

TEST_F(ImportRun, JpegIsDecodedAndLastHalfWrittenImageLeftOut) {
  for (int i = 0; i < kFrames; ++i) {
    fs::remove(lower(i));
    const Image jpeg = to_mjpeg(image(60 + i), 95).value();
    runlog::write_whole(fs::path(lower(i)).replace_extension(".jpg"),
                        {reinterpret_cast<const char*>(jpeg.bytes.data()), jpeg.bytes.size()});
  }
  const auto halve = [](const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); };
  halve(fs::path(lower(kFrames - 1)).replace_extension(".jpg"));
  halve(upper(kFrames - 1));
  const Imported imported = import();
  EXPECT_EQ(imported.frames, std::size_t(kFrames - 1));
  EXPECT_THAT(imported.events, Contains(HasSubstr(".jpg")));
  EXPECT_EQ(runlog::read_image(runlog::lower_image_file(out_, 3))->bytes, image(63).bytes)
      << "a JPEG of one grey is exact";
  EXPECT_TRUE(config::read_text(runlog::lower_image_file(out_, 3)).starts_with("\x89PNG"));

  fs::remove_all(out_);
  halve(upper(2));
  EXPECT_THAT(refusal(),
              HasSubstr(upper(2).string() +
                        " is not an image that can be read: it is cut off; only the last image of a folder may be so"));
}

TEST_F(ImportRun, RejectsRecordingsOfOtherRobots) {
  const Image odd{161, 120, PixelFormat::kRgb8, std::vector<std::uint8_t>(161 * 120 * 3, 7)};
  runlog::write_image(lower(1), odd);
  EXPECT_THAT(refusal(), HasSubstr(lower(1).string() + " has 161 x 120 pixels, must have 160 x 120"));
  runlog::write_image(lower(1), image(1));

  give_odometry();
  recording_.odometry = folder_.write("odometry.csv", "t_s,left_rad,right_rad\n0,0,0\n1,1,1\n");
  EXPECT_THAT(refusal(), HasSubstr("covers 0.000 s to 1.000 s, the images are of 1700000000.123 s to"));
  recording_.odometry.clear();

  recording_.max_skew_s = 0.07;
  EXPECT_THAT(refusal(), HasSubstr("--max-skew-ms is 70, must be > 0 and at most the images' period of 66.667 ms"));
  recording_.max_skew_s = 0.003;
  EXPECT_THAT(refusal(), HasSubstr("within 3.000 ms of one of"));
  recording_.max_skew_s.reset();

  recording_.robot_file = folder_.path() / "nowhere.yaml";
  EXPECT_THAT(refusal(), HasSubstr("nowhere.yaml"));
}

TEST_F(ImportRun, ExistingFilesAreKept) {
  import();
  EXPECT_THROW(import(), runlog::DiskError) << "the folder holds a run";
  EXPECT_EQ(runlog::read_run(out_).frames.size(), std::size_t(kFrames));
  // A folder with any content, for example the recording's own.
  EXPECT_THROW(import_run(recording_, recording_.lower, [](double) {}), runlog::DiskError);
  EXPECT_TRUE(fs::exists(lower(0)));

  const fs::path empty = folder_.path() / "empty";
  fs::create_directory(empty);
  fs::resize_file(upper(2), 100);
  EXPECT_THROW(import_run(recording_, empty, [](double) {}), config::FileError);
  EXPECT_TRUE(fs::is_empty(empty)) << "unchanged";
}

}  // namespace
}  // namespace twocone::importer
