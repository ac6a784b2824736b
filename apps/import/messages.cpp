// SPDX-License-Identifier: Apache-2.0
#include "apps/import/messages.h"

#include <algorithm>
#include <bit>
#include <climits>
#include <cmath>
#include <concepts>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "apps/recording/foxglove.pb.h"

namespace twocone::importer {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are in memory");

// ---- ROS

/// Reads the fields of a ROS message in their order. Beyond the end it throws BadMessage.
class RosFields {
 public:
  RosFields(Encoding encoding, std::span<const std::byte> bytes) : bytes_(bytes) {
    if (encoding == Encoding::kRos1) return;
    is_aligned_ = true;
    constexpr std::size_t kHead = 4;  // two bytes that name the representation, two of options
    if (bytes.size() < kHead) throw BadMessage("it has {} bytes, and its head needs 4", bytes.size());
    const int representation = int(bytes[0]) * 256 + int(bytes[1]);
    if (representation > 1) throw BadMessage("its representation is {}, must be 0 or 1 (plain CDR)", representation);
    is_swapped_ = representation == 0;
    bytes_ = bytes.subspan(kHead);
  }

  template <typename Number>
  Number number() {
    if (is_aligned_) at_ = (at_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number);
    std::array<std::byte, sizeof(Number)> raw{};
    std::ranges::copy(take(sizeof(Number)), raw.begin());
    if (is_swapped_) std::ranges::reverse(raw);
    return std::bit_cast<Number>(raw);
  }
  std::span<const std::byte> take(std::size_t size) {
    if (at_ > bytes_.size() || size > bytes_.size() - at_) throw BadMessage("it ends after {} bytes", bytes_.size());
    const auto taken = bytes_.subspan(at_, size);
    at_ += size;
    return taken;
  }
  std::string bytes() {
    const auto raw = take(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }
  /// A text of ROS 2 ends with a zero, which is counted.
  std::string text() {
    std::string text = bytes();
    if (is_aligned_ && !text.empty() && text.back() == '\0') text.pop_back();
    return text;
  }
  std::vector<double> numbers() {
    const auto count = number<std::uint32_t>();
    if (count > bytes_.size() / sizeof(double)) throw BadMessage("it ends after {} bytes", bytes_.size());
    std::vector<double> result(count);
    for (double& value : result) value = number<double>();
    return result;
  }
  /// Reads std_msgs/Header, and returns its stamp.
  Stamp header() {
    if (!is_aligned_) number<std::uint32_t>();  // seq
    const auto seconds = number<std::uint32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    text();  // frame_id
    return std::chrono::seconds(seconds) + Stamp(nanoseconds);
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool is_aligned_ = false, is_swapped_ = false;
};

int to_pixels(std::uint32_t size) {
  constexpr std::uint32_t kMost = 16384;
  if (size == 0 || size > kMost) throw BadMessage("an image of {} pixels a side, must be 1 to {}", size, kMost);
  return int(size);
}

double heading_of(double x, double y, double z, double w) {
  return std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/// Returns png or jpeg for the formats that are written in many ways, as "bgr8; jpeg compressed bgr8".
std::string compression_of(const std::string& format) {
  for (const char* const known : {"png", "jpeg"}) {
    if (format.find(known) != std::string::npos) return known;
  }
  if (format.find("jpg") != std::string::npos) return "jpeg";
  throw BadMessage("its format is '{}', must be png or jpeg", format);
}

/// Returns the name that Foxglove and ROS 1 use.
std::string pixels_of(const std::string& encoding) {
  if (encoding == "8UC1") return "mono8";
  if (encoding == "8UC3") return "bgr8";
  if (encoding == "yuv422_yuy2") return "yuyv";
  if (encoding == "yuv422") return "uyvy";
  return encoding;
}

Content ros_image(RosFields& fields) {
  ImageMessage image;
  image.time = fields.header();
  image.height_px = to_pixels(fields.number<std::uint32_t>());
  image.width_px = to_pixels(fields.number<std::uint32_t>());
  image.format = pixels_of(fields.text());
  fields.number<std::uint8_t>();  // is_bigendian, which says nothing of single bytes
  image.step = fields.number<std::uint32_t>();
  image.bytes = fields.bytes();
  return image;
}

Content ros_compressed_image(RosFields& fields) {
  ImageMessage image;
  image.time = fields.header();
  image.format = compression_of(fields.text());
  image.bytes = fields.bytes();
  return image;
}

Content ros_camera_info(RosFields& fields) {
  LensMessage lens;
  fields.header();
  lens.height_px = to_pixels(fields.number<std::uint32_t>());
  lens.width_px = to_pixels(fields.number<std::uint32_t>());
  lens.model = fields.text();
  lens.coefficients = fields.numbers();
  for (double& value : lens.matrix) value = fields.number<double>();
  return lens;
}

Content ros_odometry(RosFields& fields) {
  PoseMessage pose;
  pose.time = fields.header();
  fields.text();  // child_frame_id
  pose.x_m = fields.number<double>();
  pose.y_m = fields.number<double>();
  fields.number<double>();
  std::array<double, 4> turn{};
  for (double& value : turn) value = fields.number<double>();
  pose.heading_rad = heading_of(turn[0], turn[1], turn[2], turn[3]);
  return pose;
}

// ---- Foxglove

template <typename Message>
Message parsed(std::span<const std::byte> bytes) {
  Message message;
  if (bytes.size() > INT_MAX || !message.ParseFromArray(bytes.data(), int(bytes.size()))) {
    throw BadMessage("it is no {}", message.GetTypeName());
  }
  return message;
}

Stamp stamp_of(const google::protobuf::Timestamp& stamp) {
  constexpr std::int64_t kMost_s = 9'000'000'000;  // nanoseconds in 64 bits
  if (stamp.seconds() < 0 || stamp.seconds() > kMost_s) throw BadMessage("its time is {} s", stamp.seconds());
  return std::chrono::seconds(stamp.seconds()) + Stamp(stamp.nanos());
}

Content foxglove_raw_image(std::span<const std::byte> bytes) {
  auto message = parsed<foxglove::RawImage>(bytes);
  ImageMessage image;
  image.time = stamp_of(message.timestamp());
  image.width_px = to_pixels(message.width());
  image.height_px = to_pixels(message.height());
  image.format = pixels_of(message.encoding());
  image.step = message.step();
  image.bytes = std::move(*message.mutable_data());
  return image;
}

Content foxglove_compressed_image(std::span<const std::byte> bytes) {
  auto message = parsed<foxglove::CompressedImage>(bytes);
  ImageMessage image;
  image.time = stamp_of(message.timestamp());
  image.format = compression_of(message.format());
  image.bytes = std::move(*message.mutable_data());
  return image;
}

Content foxglove_calibration(std::span<const std::byte> bytes) {
  const auto message = parsed<foxglove::CameraCalibration>(bytes);
  LensMessage lens;
  lens.width_px = to_pixels(message.width());
  lens.height_px = to_pixels(message.height());
  lens.model = message.distortion_model();
  lens.coefficients.assign(message.d().begin(), message.d().end());
  if (message.k_size() != int(lens.matrix.size()))
    throw BadMessage("its matrix K has {} numbers, must have 9", message.k_size());
  std::ranges::copy(message.k(), lens.matrix.begin());
  return lens;
}

Content foxglove_pose(std::span<const std::byte> bytes) {
  const auto message = parsed<foxglove::PoseInFrame>(bytes);
  const foxglove::Vector3& place = message.pose().position();
  const foxglove::Quaternion& turn = message.pose().orientation();
  return PoseMessage{stamp_of(message.timestamp()), place.x(), place.y(),
                     heading_of(turn.x(), turn.y(), turn.z(), turn.w())};
}

/// A type that import reads.
struct KnownType {
  std::string_view name;  ///< of ROS: as in ROS 1, without msg/
  MessageKind kind;
  Content (*of_ros)(RosFields&);
  Content (*of_protobuf)(std::span<const std::byte>);
};
constexpr std::array kKnownTypes{
    KnownType{"sensor_msgs/Image", MessageKind::kImage, ros_image, nullptr},
    KnownType{"sensor_msgs/CompressedImage", MessageKind::kImage, ros_compressed_image, nullptr},
    KnownType{"sensor_msgs/CameraInfo", MessageKind::kLens, ros_camera_info, nullptr},
    KnownType{"nav_msgs/Odometry", MessageKind::kPose, ros_odometry, nullptr},
    KnownType{"foxglove.RawImage", MessageKind::kImage, nullptr, foxglove_raw_image},
    KnownType{"foxglove.CompressedImage", MessageKind::kImage, nullptr, foxglove_compressed_image},
    KnownType{"foxglove.CameraCalibration", MessageKind::kLens, nullptr, foxglove_calibration},
    KnownType{"foxglove.PoseInFrame", MessageKind::kPose, nullptr, foxglove_pose}};

const KnownType* find_type(std::string_view type) {
  std::string name(type);
  if (const auto at = name.find("/msg/"); at != std::string::npos) name.erase(at, 4);
  const auto found = std::ranges::find(kKnownTypes, name, &KnownType::name);
  return found == kKnownTypes.end() ? nullptr : &*found;
}

}  // namespace

MessageKind kind_of(std::string_view type) {
  const KnownType* const known = find_type(type);
  return known != nullptr ? known->kind : MessageKind::kNone;
}

Content decode(std::string_view type, Encoding encoding, std::span<const std::byte> bytes) {
  const KnownType* const known = find_type(type);
  if (known == nullptr) throw BadMessage("type {} is not read", type);
  if (encoding == Encoding::kProtobuf) {
    if (known->of_protobuf == nullptr) throw BadMessage("type {} is not read as protobuf", type);
    return known->of_protobuf(bytes);
  }
  if (known->of_ros == nullptr) throw BadMessage("type {} is read as protobuf only", type);
  RosFields fields(encoding, bytes);
  return known->of_ros(fields);
}

}  // namespace twocone::importer
