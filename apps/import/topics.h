// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/import/messages.h"

/// Recordings that are one file with the messages of several topics.
namespace twocone::importer {

/// A message of a recording, before it is decoded. All is valid during the call that receives it.
struct TopicMessage {
  std::string_view topic, type;
  Encoding encoding;
  std::span<const std::byte> bytes;
};

/// Calls `use` for the messages of an MCAP file, in the order of the file. Those of other encodings than protobuf, cdr
/// and ros1 are left out. @returns whether the file is complete; false: it was cut off
/// @throws config::FileError for a file of another kind, and for one that is damaged
bool read_messages(const std::filesystem::path& file, const std::function<void(const TopicMessage&)>& use);

/// The topics to import. Empty names are chosen: see unpack().
struct TopicNames {
  std::string lower, upper, odometry;
};

/// What unpack() has written.
struct Unpacked {
  std::filesystem::path lower, upper;  ///< folders of images, whose names are their times in nanoseconds
  std::filesystem::path odometry;      ///< CSV file of poses; empty: the recording has none
  TopicNames topics;                   ///< those that were chosen; no odometry: the recording has none
  std::vector<std::string> events;     ///< one sentence each
};

/// Writes the images and the odometry of a recording, an MCAP file or a bag of ROS 1, as files that import_run() reads,
/// and the lenses of its cameras as VIEW_camera_info.yaml.
///
/// The times are those of the messages' headers. Where a topic is not named, the only image topic whose name has
/// `lower` or `upper` in it is that view's, or the first and the second of exactly two image topics by their names; and
/// the only topic of poses is the odometry.
/// @throws config::FileError naming the topics where the choice is not clear; for a message that cannot be read; for
/// pixels in an unknown encoding; as bag_to_mcap(). runlog::DiskError
Unpacked unpack(const std::filesystem::path& recording, const TopicNames& names, const std::filesystem::path& folder);

}  // namespace twocone::importer
