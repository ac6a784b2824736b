// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace rosbag {
class Bag;
}

namespace twocone::importer {

/// Writes the messages of an open bag of ROS 1 as the MCAP file `to`. Call it only in a process
/// of its own, as the program twocone_rosbag does (bag.h): the library may crash where a bag is damaged.
/// @throws rosbag::BagException, std::exception for a damaged bag, or if the file cannot be written
void write_messages(const rosbag::Bag& bag, const std::filesystem::path& to);

}  // namespace twocone::importer
