// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/import/import_run.h"
#include "apps/mcap/mcap.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "hal/image.h"
#include "tests/import/ros_message.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const std::string kRobot = TWOCONE_SOURCE_DIR "/tests/end_to_end/data/small.yaml";
constexpr int kWidth_px = 160, kHeight_px = 120, kRecorded = 40;

/// What a robot of ROS 2 records: two cameras, of which one has BGR pixels with padded rows, and its odometry.
class RosRecording : public testing::Test {
 protected:
  struct Topics {
    std::string lower = "/bottom_lower/image_raw", upper = "/top_upper/image_raw";
    std::optional<std::string> odometry = "/odom", other_odometry = {};
    int width_px = kWidth_px;
  };

  void record(const Topics& topics) {
    mcap::Writer writer(file_, "test");
    const auto schema = [&writer](const char* name) { return writer.add(mcap::Schema{name, "ros2msg", "text"}); };
    const auto image = schema("sensor_msgs/msg/Image"), odometry = schema("nav_msgs/msg/Odometry");
    const auto info = schema("sensor_msgs/msg/CameraInfo");
    const auto channel = [&writer](const std::string& topic, std::uint16_t of) {
      return writer.add(mcap::Channel{topic, "cdr", of, {}});
    };
    const auto add = [&writer](std::uint16_t to, const RosMessage& message) {
      writer.add({to, 0, 1, 1, message.bytes()});
    };
    const auto lower = channel(topics.lower, image), upper = channel(topics.upper, image);
    const auto lens = channel("/top_upper/camera_info", info);
    std::map<std::string, std::uint16_t> odometries;
    for (int i = 0; i < kRecorded; ++i) {
      const auto ns = std::uint32_t(i * 33'000'000);
      add(lower, image_message(ns, "rgb8", topics.width_px, 0, char(10 * i)));
      add(upper, image_message(ns + 1'000'000, "bgr8", kWidth_px, 8, char(10 * i + 1)));
      RosMessage lens_message(Encoding::kCdr);
      lens_message.header(100, ns, "")
          .number(std::uint32_t(kHeight_px))
          .number(std::uint32_t(kWidth_px))
          .text("plumb_bob");
      lens_message.number(std::uint32_t{0});
      for (const double k : {150.0, 0.0, 80.0, 0.0, 150.0, 60.0, 0.0, 0.0, 1.0}) lens_message.number(k);
      add(lens, lens_message);
      for (const auto& topic : {topics.odometry, topics.other_odometry}) {
        if (!topic) continue;
        if (!odometries.contains(*topic)) odometries[*topic] = channel(*topic, odometry);
        add(odometries[*topic], pose(ns, i));
      }
    }
    writer.finish();
  }

  static RosMessage image_message(std::uint32_t ns, const char* format, int width_px, int padding, char value) {
    RosMessage message(Encoding::kCdr);
    const auto step = std::uint32_t(3 * width_px + padding);
    message.header(100, ns, "camera").number(std::uint32_t(kHeight_px)).number(std::uint32_t(width_px)).text(format);
    // Its first byte is that of red in rgb8, and of blue in bgr8. The rest is noise, which is not compressed.
    std::string pixels(std::size_t(step) * kHeight_px, '\0');
    std::minstd_rand random(1 + ns);
    for (char& byte : pixels) byte = char(random() >> 8);
    pixels[0] = value;
    pixels[2] = 0;
    return message.number(std::uint8_t{0}).number(step).data(pixels);
  }
  static RosMessage pose(std::uint32_t ns, int i) {
    RosMessage message(Encoding::kCdr);
    message.header(100, ns, "odom").text("base");
    for (const double value : {0.01 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}) message.number(value);
    return message;
  }

  Imported import(const TopicNames& names = {}) {
    Recording recording;
    recording.robot_file = kRobot;
    recording.file = file_;
    recording.topics = names;
    return import_run(recording, out_, [](double) {});
  }
  std::string refusal(const TopicNames& names = {}) {
    std::string error = testing_support::error_of<std::exception>([&] { import(names); });
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_THAT(error, Not(HasSubstr("unpacked"))) << "a folder that the user does not know";
    EXPECT_FALSE(fs::exists(out_)) << "a partial run";
    EXPECT_FALSE(fs::exists(out_.string() + ".unpacked"));
    return error;
  }

  const testing_support::TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "recording.mcap", out_ = folder_.path() / "run";
};

TEST_F(RosRecording, BecomesARun) {
  record({});
  const Imported imported = import();
  EXPECT_EQ(imported.frames, std::size_t(kRecorded));
  const runlog::RunData run = runlog::read_run(out_);
  ASSERT_EQ(run.frames.size(), std::size_t(kRecorded));
  EXPECT_NEAR(run.frames[2].t_s, 0.066, 1e-12);
  EXPECT_NEAR(run.frames[2].skew_s, 0.001, 1e-12);
  EXPECT_NEAR(run.odometry[4].x_m, 0.04, 1e-9);
  const auto lower = runlog::read_image(runlog::lower_image_file(out_, 2));
  const auto upper = runlog::read_image(runlog::upper_image_file(out_, 2));
  ASSERT_TRUE(lower && upper);
  EXPECT_EQ(lower->width_px, kWidth_px);
  EXPECT_EQ(lower->bytes[0], 20) << "red of rgb8";
  EXPECT_EQ(upper->bytes[2], 21) << "blue of bgr8";
  EXPECT_EQ(upper->bytes[0], 0);
  EXPECT_TRUE(fs::exists(out_ / "upper_camera_info.yaml"));
  EXPECT_THAT(run.info.events, Contains(HasSubstr("lower: 40 of 40 images of /bottom_lower/image_raw of ")));
  EXPECT_THAT(run.info.events, Contains(HasSubstr("the wheels' angles are of /odom of ")));
  EXPECT_THAT(run.info.events, testing::Each(Not(HasSubstr("unpacked"))));
  EXPECT_FALSE(fs::exists(out_.string() + ".unpacked"));
}

TEST_F(RosRecording, TopicsWithoutTheNamesOfViewsAreTakenInOrder) {
  record({.lower = "/cam0/image", .upper = "/cam1/image", .odometry = {}});
  import();
  EXPECT_EQ(runlog::read_image(runlog::lower_image_file(out_, 1))->bytes[0], 10);
  EXPECT_TRUE(runlog::read_run(out_).odometry.empty());
}

TEST_F(RosRecording, AnUnclearChoiceNamesTheTopics) {
  record({.other_odometry = "/wheels"});
  import({"/bottom_lower/image_raw", "/top_upper/image_raw", "/wheels"});
  fs::remove_all(out_);
  EXPECT_THAT(refusal({"/none", "", ""}), HasSubstr("--lower-topic /none is no topic of images; there are: "
                                                    "/bottom_lower/image_raw (40), /top_upper/image_raw (40)"));
  EXPECT_THAT(refusal({"/top_upper/image_raw", "", ""}), HasSubstr("both views would be of /top_upper/image_raw"));
  record({.odometry = "/wheels", .other_odometry = "/visual"});
  EXPECT_THAT(refusal(), HasSubstr("the topics of poses are: /visual (40), /wheels (40); --odometry-topic must name"));
}

TEST_F(RosRecording, WrongImagesAreNamedByTheirTopic) {
  record({.width_px = 80});
  EXPECT_THAT(refusal(), HasSubstr("/bottom_lower/image_raw of " + file_.string()));
}

TEST_F(RosRecording, OtherFilesAreRefused) {
  runlog::write_whole(file_, "no recording");
  EXPECT_THAT(refusal(), HasSubstr("recording.mcap"));
  runlog::write_whole(file_, "#ROSBAG V2.0\nwhat follows is no bag");
  EXPECT_THAT(refusal(), HasSubstr("recording.mcap"));
  fs::remove(file_);
  EXPECT_THAT(refusal(), HasSubstr("recording.mcap"));
}

TEST_F(RosRecording, OneThatWasCutOffIsReadAsFarAsItGoes) {
  record({});
  const auto size = fs::file_size(file_);
  fs::resize_file(file_, size - 100'000);
  const Imported imported = import();
  EXPECT_THAT(imported.events, Contains(HasSubstr("was cut off")));
  EXPECT_GT(imported.frames, 30U);
  EXPECT_LT(imported.frames, std::size_t(kRecorded));
}

}  // namespace
}  // namespace twocone::importer
