// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace twocone::importer {

/// Writes the messages of a bag of ROS 1, version 2.0, as an MCAP file. A program of its own reads the bag, because the
/// library that does so reads beyond its memory where a bag is damaged, and because it brings others with it, Python
/// among them.
/// @throws config::FileError for a damaged bag, one without an index, and in a build without rosbag_storage
void bag_to_mcap(const std::filesystem::path& bag, const std::filesystem::path& mcap);

}  // namespace twocone::importer
