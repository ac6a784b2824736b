// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/text_file.h"
#include "apps/import/bag.h"

namespace twocone::importer {

bool read_bag(const std::filesystem::path& file, const std::function<void(const TopicMessage&)>& /*use*/) {
  throw config::FileError(
      "{}: a bag of ROS 1, which this build does not read: install librosbag-storage-dev and build again, or make an "
      "MCAP "
      "file of it with `mcap convert`",
      file.string());
}

}  // namespace twocone::importer
