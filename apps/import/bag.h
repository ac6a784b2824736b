// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "apps/import/topics.h"

namespace twocone::importer {

/// Reads a bag of ROS 1, version 2.0, as read_messages(). A build without rosbag_storage refuses it.
bool read_bag(const std::filesystem::path& file, const std::function<void(const TopicMessage&)>& use);

/// The function of the module that links rosbag_storage. The program loads it with the first bag: with the libraries of
/// ROS and their Python, it would start a third later.
using BagReader = bool (*)(const std::filesystem::path&, const std::function<void(const TopicMessage&)>&);
inline constexpr const char* kBagEntry = "twocone_read_bag";

}  // namespace twocone::importer
