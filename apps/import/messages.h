// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "apps/import/stamps.h"
#include "base/errors.h"

/// Messages of other programs' recordings.
namespace twocone::importer {

/// How a message's bytes hold its fields.
enum class Encoding {
  kProtobuf,  ///< messages of Foxglove
  kCdr,       ///< ROS 2: the Common Data Representation of DDS, little- or big-endian
  kRos1,      ///< ROS 1: little-endian, without padding
};

/// A message does not have the fields of its type. The message is one line.
struct BadMessage : base::FormattedError {
  using Formatted::Formatted;
};

/// An image, compressed or not.
struct ImageMessage {
  Stamp time{};
  std::string format;               ///< png or jpeg; else the encoding of the pixels: rgb8, bgr8, mono8, yuyv, uyvy
  int width_px = 0, height_px = 0;  ///< of pixels; 0 for png and jpeg
  std::size_t step = 0;             ///< bytes of a row; 0 likewise
  std::string bytes;
};

/// A pose of the robot by its odometry.
struct PoseMessage {
  Stamp time{};
  double x_m = 0, y_m = 0, heading_rad = 0;
};

/// The lens of a camera (ROS camera_info).
struct LensMessage {
  int width_px = 0, height_px = 0;
  std::string model;  ///< plumb_bob, rational_polynomial, ...
  std::vector<double> coefficients;
  std::array<double, 9> matrix{};
};

using Content = std::variant<std::monostate, ImageMessage, PoseMessage, LensMessage>;

/// What import takes from a message of that type.
enum class MessageKind { kNone, kImage, kPose, kLens };
/// @param type foxglove.RawImage, sensor_msgs/msg/Image (ROS 2) or sensor_msgs/Image (ROS 1), ...
MessageKind kind_of(std::string_view type);

/// Returns the content of a message whose type has a kind. @throws BadMessage
Content decode(std::string_view type, Encoding encoding, std::span<const std::byte> bytes);

}  // namespace twocone::importer
