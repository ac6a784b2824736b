// SPDX-License-Identifier: Apache-2.0
#include "apps/import/topics.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/yaml/text_file.h"
#include "apps/import/bag.h"
#include "apps/mcap/mcap.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "hal/image.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;

bool is_bag(const fs::path& file) {
  constexpr std::string_view kMagic = "#ROSBAG";
  std::array<char, kMagic.size()> begin{};
  std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
  return std::string_view(begin.data(), begin.size()) == kMagic;
}

std::optional<Encoding> encoding_named(std::string_view name) {
  if (name == "protobuf") return Encoding::kProtobuf;
  if (name == "cdr") return Encoding::kCdr;
  if (name == "ros1") return Encoding::kRos1;
  return std::nullopt;
}

/// The topics of a kind with their numbers of messages.
using Topics = std::map<std::string, std::size_t>;

std::string listed(const Topics& topics) {
  std::vector<std::string> names;
  for (const auto& [name, count] : topics) names.push_back(fmt::format("{} ({})", name, count));
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

/// Returns the topic that is named, or the one that `is_meant` is true of.
template <typename IsMeant>
std::string choose(const fs::path& file, const std::string& named, const char* option, const char* what,
                   const Topics& topics, IsMeant is_meant) {
  if (!named.empty()) {
    if (topics.contains(named)) return named;
    throw config::FileError("{}: {} {} is no topic of {}; there are: {}", file.string(), option, named, what,
                            listed(topics));
  }
  std::vector<std::string> meant;
  for (const auto& [name, count] : topics) {
    if (is_meant(name)) meant.push_back(name);
  }
  if (meant.size() == 1) return meant.front();
  throw config::FileError("{}: the topics of {} are: {}; {} must name one of them", file.string(), what, listed(topics),
                          option);
}

struct FoundTopics {
  Topics images, poses, lenses;
};

FoundTopics topics_of(const fs::path& file) {
  FoundTopics found;
  read_messages(file, [&](const TopicMessage& message) {
    const MessageKind kind = kind_of(message.type);
    if (kind == MessageKind::kImage) ++found.images[std::string(message.topic)];
    if (kind == MessageKind::kPose) ++found.poses[std::string(message.topic)];
    if (kind == MessageKind::kLens) ++found.lenses[std::string(message.topic)];
  });
  return found;
}

/// Returns the pixel format of a name that messages use, or nothing.
std::optional<PixelFormat> format_named(const std::string& name) {
  constexpr std::array kKnown{std::pair{"rgb8", PixelFormat::kRgb8}, std::pair{"bgr8", PixelFormat::kBgr8},
                              std::pair{"mono8", PixelFormat::kGrey8}, std::pair{"yuyv", PixelFormat::kYuyv},
                              std::pair{"uyvy", PixelFormat::kUyvy}};
  const auto found = std::ranges::find(kKnown, name, [](const auto& known) { return std::string_view(known.first); });
  return found == kKnown.end() ? std::nullopt : std::optional(found->second);
}

/// Returns the pixels of a message without the padding of its rows. @throws BadMessage
Image pixels_of(const ImageMessage& message) {
  const auto format = format_named(message.format);
  if (!format) {
    throw BadMessage("its pixels are '{}', must be rgb8, bgr8, mono8, yuyv or uyvy", message.format);
  }
  const auto size = image_bytes(*format, message.width_px, message.height_px);
  if (!size) throw BadMessage("{} has no image of {} x {}", message.format, message.width_px, message.height_px);
  const std::size_t row = *size / std::size_t(message.height_px);
  const std::size_t step = std::max(message.step, row);
  if (message.bytes.size() < step * std::size_t(message.height_px - 1) + row) {
    throw BadMessage("it has {} bytes of pixels, must have {} rows of {}", message.bytes.size(), message.height_px,
                     step);
  }
  Image image{message.width_px, message.height_px, *format, {}};
  image.bytes.resize(*size);
  for (std::size_t i = 0; i < std::size_t(message.height_px); ++i) {
    const auto from = message.bytes.begin() + std::ptrdiff_t(i * step);
    std::copy(from, from + std::ptrdiff_t(row), image.bytes.begin() + i * row);
  }
  return image;
}

void store(const ImageMessage& message, const fs::path& folder) {
  const std::string stem = fmt::format("{:019}", message.time.count());
  if (message.format == "png" || message.format == "jpeg") {
    runlog::write_whole(folder / fmt::format("{}.{}", stem, message.format), message.bytes);
  } else {
    runlog::write_image(folder / (stem + ".png"), pixels_of(message));
  }
}

/// Returns a lens as a camera_info file of ROS.
std::string camera_info(const LensMessage& lens) {
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_matrix: {{rows: 3, cols: 3, data: [{}]}}\n{}"
      "distortion_coefficients: {{rows: 1, cols: {}, data: [{}]}}\n",
      lens.width_px, lens.height_px, fmt::join(lens.matrix, ", "),
      lens.model.empty() ? "" : fmt::format("distortion_model: {}\n", lens.model), lens.coefficients.size(),
      fmt::join(lens.coefficients, ", "));
}

/// Returns the topic of the lens that belongs to an image topic: of the same folder of names.
std::string lens_of(const std::string& images, const Topics& lenses) {
  const std::string topic = images.substr(0, images.find_last_of('/') + 1) + "camera_info";
  return lenses.contains(topic) ? topic : "";
}

}  // namespace

bool read_messages(const fs::path& file, const std::function<void(const TopicMessage&)>& use) {
  try {
    mcap::Reader reader(file);
    while (const auto message = reader.next()) {
      const mcap::Channel& channel = reader.channels().at(message->channel);
      const auto encoding = encoding_named(channel.message_encoding);
      if (!encoding || !channel.schema) continue;
      use({channel.topic, reader.schemas().at(*channel.schema).name, *encoding, message->data});
    }
    return reader.is_complete();
  } catch (const mcap::McapError& error) {
    throw config::FileError("{}", error.what());
  }
}

Unpacked unpack(const fs::path& recording, const TopicNames& names, const fs::path& folder) {
  const fs::path file = is_bag(recording) ? folder / "bag.mcap" : recording;
  if (file != recording) bag_to_mcap(recording, file);
  const FoundTopics found = topics_of(file);
  // Two image topics whose names do not tell which is which are taken in the order of their names.
  const auto named = [&](const char* view) {
    return std::ranges::count_if(found.images,
                                 [&](const auto& topic) { return topic.first.find(view) != std::string::npos; });
  };
  const bool by_order = found.images.size() == 2 && (named("lower") != 1 || named("upper") != 1);
  const auto is_view = [&](const char* view, bool is_first) {
    return [&found, view, is_first, by_order](const std::string& name) {
      if (by_order) return (name == found.images.begin()->first) == is_first;
      return name.find(view) != std::string::npos;
    };
  };
  const std::string lower =
      choose(recording, names.lower, "--lower-topic", "images", found.images, is_view("lower", true));
  const std::string upper =
      choose(recording, names.upper, "--upper-topic", "images", found.images, is_view("upper", false));
  if (lower == upper) throw config::FileError("{}: both views would be of {}", recording.string(), lower);
  std::string odometry;
  if (!names.odometry.empty() || !found.poses.empty()) {
    const bool is_only = found.poses.size() == 1;
    odometry = choose(recording, names.odometry, "--odometry-topic", "poses", found.poses,
                      [&](const std::string& name) { return is_only || name == "/odometry" || name == "/odom"; });
  }

  Unpacked unpacked{folder / "lower", folder / "upper", {}, {lower, upper, odometry}, {}};
  runlog::make_folder(unpacked.lower);
  runlog::make_folder(unpacked.upper);
  std::string poses = "t_s,x_m,y_m,heading_rad\n";
  std::map<std::string, fs::path> lenses;
  if (const auto topic = lens_of(lower, found.lenses); !topic.empty())
    lenses[topic] = folder / "lower_camera_info.yaml";
  if (const auto topic = lens_of(upper, found.lenses); !topic.empty())
    lenses[topic] = folder / "upper_camera_info.yaml";
  const bool is_complete = read_messages(file, [&](const TopicMessage& message) {
    const std::string topic(message.topic);
    const bool is_wanted = topic == lower || topic == upper || topic == odometry || lenses.contains(topic);
    if (!is_wanted) return;
    try {
      const Content content = decode(message.type, message.encoding, message.bytes);
      if (const auto* image = std::get_if<ImageMessage>(&content)) {
        store(*image, topic == lower ? unpacked.lower : unpacked.upper);
      } else if (const auto* pose = std::get_if<PoseMessage>(&content)) {
        poses += fmt::format("{}.{:09},{},{},{}\n", pose->time.count() / 1'000'000'000,
                             pose->time.count() % 1'000'000'000, pose->x_m, pose->y_m, pose->heading_rad);
      } else if (const auto* lens = std::get_if<LensMessage>(&content)) {
        runlog::write_whole(lenses[topic], camera_info(*lens));
        lenses.erase(topic);  // it is the same in every message
      }
    } catch (const BadMessage& bad) {
      throw config::FileError("{}: a message of {}: {}", recording.string(), topic, bad.what());
    }
  });
  if (!is_complete) unpacked.events.push_back(fmt::format("{} was cut off", recording.string()));
  if (!odometry.empty()) {
    unpacked.odometry = folder / "odometry.csv";
    runlog::write_whole(unpacked.odometry, poses);
  }
  return unpacked;
}

}  // namespace twocone::importer
