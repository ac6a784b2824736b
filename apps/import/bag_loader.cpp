// SPDX-License-Identifier: Apache-2.0
// Loads the module that reads bags.
#include "apps/config/yaml/text_file.h"
#include "apps/import/bag.h"
#include "base/errors.h"
#include "base/module.h"

namespace twocone::importer {

bool read_bag(const std::filesystem::path& file, const std::function<void(const TopicMessage&)>& use) {
  const auto read = [&file] {
    try {
      return reinterpret_cast<BagReader>(base::load_module(TWOCONE_ROSBAG_MODULE, kBagEntry));
    } catch (const base::FormattedError& error) {
      throw config::FileError("{}: a bag of ROS 1: {}", file.string(), error.what());
    }
  }();
  return read(file, use);
}

}  // namespace twocone::importer
