// SPDX-License-Identifier: Apache-2.0
#include "apps/import/messages.h"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/recording/foxglove.pb.h"
#include "tests/import/ros_message.h"
#include "tests/support/error_of.h"

namespace twocone::importer {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal(std::string_view type, Encoding encoding, std::span<const std::byte> bytes) {
  return testing_support::error_of<BadMessage>([&] { decode(type, encoding, bytes); });
}

/// The encodings of ROS; big-endian as well.
struct Written {
  const char* name;
  Encoding encoding;
  bool is_big_endian;
};

class RosMessages : public testing::TestWithParam<Written> {
 protected:
  [[nodiscard]] RosMessage message() const { return RosMessage(GetParam().encoding, GetParam().is_big_endian); }
  [[nodiscard]] std::string type(const std::string& package, const std::string& name) const {
    return package + (GetParam().encoding == Encoding::kCdr ? "/msg/" : "/") + name;
  }
  template <typename T>
  T decoded(const std::string& type, const RosMessage& message) const {
    return std::get<T>(decode(type, GetParam().encoding, message.bytes()));
  }
};
INSTANTIATE_TEST_SUITE_P(Encodings, RosMessages,
                         testing::Values(Written{"Cdr", Encoding::kCdr, false},
                                         Written{"CdrBigEndian", Encoding::kCdr, true},
                                         Written{"Ros1", Encoding::kRos1, false}),
                         [](const auto& written) { return written.param.name; });

TEST_P(RosMessages, OdometryHasAPlaceAndAHeadingWhateverTheLengthOfItsNames) {
  // The names shift what follows, which CDR aligns.
  for (const char* frame : {"", "o", "od", "odo", "odom", "odomet", "odometr"}) {
    RosMessage odometry = message();
    odometry.header(17, 250'000'001, frame).text("base_link");
    for (const double value : {1.5, -2.25, 0.0, 0.0, 0.0, std::sin(0.3), std::cos(0.3)}) odometry.number(value);
    const auto pose = decoded<PoseMessage>(type("nav_msgs", "Odometry"), odometry);
    EXPECT_EQ(pose.time.count(), 17'250'000'001) << frame;
    EXPECT_EQ(pose.x_m, 1.5) << frame;
    EXPECT_EQ(pose.y_m, -2.25) << frame;
    EXPECT_NEAR(pose.heading_rad, 0.6, 1e-15) << frame;
  }
}

TEST_P(RosMessages, ImagesHaveTheirPixels) {
  const std::string pixels{"abcdef\0\0ghijkl\0\0", 16};
  RosMessage image = message();
  image.header(1, 2, "camera").number(std::uint32_t{2}).number(std::uint32_t{2}).text("bgr8").number(std::uint8_t{0});
  image.number(std::uint32_t{8}).data(pixels);
  const auto read = decoded<ImageMessage>(type("sensor_msgs", "Image"), image);
  EXPECT_EQ(read.format, "bgr8");
  EXPECT_EQ(read.width_px, 2);
  EXPECT_EQ(read.step, 8U);
  EXPECT_EQ(read.bytes, pixels);

  for (const auto& [written, format] :
       {std::pair{"jpeg", "jpeg"}, {"rgb8; png compressed bgr8", "png"}, {"jpg", "jpeg"}}) {
    RosMessage compressed = message();
    compressed.header(1, 2, "camera").text(written).data("content");
    EXPECT_EQ(decoded<ImageMessage>(type("sensor_msgs", "CompressedImage"), compressed).format, format);
  }
}

TEST_P(RosMessages, ALensHasItsMatrixAndCoefficients) {
  RosMessage info = message();
  info.header(1, 2, "camera").number(std::uint32_t{480}).number(std::uint32_t{640}).text("plumb_bob");
  info.number(std::uint32_t{2}).number(-0.25).number(0.125);
  for (int i = 0; i < 9; ++i) info.number(double(i));
  const auto lens = decoded<LensMessage>(type("sensor_msgs", "CameraInfo"), info);
  EXPECT_EQ(lens.width_px, 640);
  EXPECT_THAT(lens.coefficients, ElementsAre(-0.25, 0.125));
  EXPECT_EQ(lens.matrix[8], 8);
}

TEST_P(RosMessages, AMessageThatEndsEarlyIsRefused) {
  RosMessage image = message();
  image.header(1, 2, "camera").number(std::uint32_t{2}).number(std::uint32_t{2}).text("bgr8").number(std::uint8_t{0});
  image.number(std::uint32_t{6}).data("123456789012");
  const std::string name = type("sensor_msgs", "Image");
  for (std::size_t size = 0; size < image.bytes().size(); ++size) {
    EXPECT_NE(refusal(name, GetParam().encoding, image.bytes().first(size)), "") << size;
  }
}

TEST(FoxgloveMessages, AreRead) {
  foxglove::PoseInFrame pose;
  pose.mutable_timestamp()->set_seconds(3);
  pose.mutable_timestamp()->set_nanos(4);
  pose.mutable_pose()->mutable_position()->set_x(1.5);
  pose.mutable_pose()->mutable_orientation()->set_w(std::cos(0.3));
  pose.mutable_pose()->mutable_orientation()->set_z(std::sin(0.3));
  const std::string bytes = pose.SerializeAsString();
  const auto read =
      std::get<PoseMessage>(decode("foxglove.PoseInFrame", Encoding::kProtobuf, std::as_bytes(std::span(bytes))));
  EXPECT_EQ(read.time.count(), 3'000'000'004);
  EXPECT_EQ(read.x_m, 1.5);
  EXPECT_NEAR(read.heading_rad, 0.6, 1e-15);
}

TEST(Messages, WhatIsNotReadIsNamed) {
  const std::string bytes(100, '\1');
  const auto raw = std::as_bytes(std::span(bytes));
  EXPECT_THAT(refusal("sensor_msgs/msg/LaserScan", Encoding::kCdr, raw),
              HasSubstr("sensor_msgs/msg/LaserScan is not read"));
  EXPECT_THAT(refusal("sensor_msgs/msg/Image", Encoding::kProtobuf, raw), HasSubstr("not read as protobuf"));
  EXPECT_THAT(refusal("foxglove.RawImage", Encoding::kCdr, raw), HasSubstr("as protobuf only"));
  EXPECT_THAT(refusal("sensor_msgs/msg/Image", Encoding::kCdr, raw), HasSubstr("must be 0 or 1"));
  EXPECT_EQ(kind_of("sensor_msgs/msg/Image"), MessageKind::kImage);
  EXPECT_EQ(kind_of("tf2_msgs/msg/TFMessage"), MessageKind::kNone);
}

}  // namespace
}  // namespace twocone::importer
