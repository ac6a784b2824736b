// SPDX-License-Identifier: Apache-2.0
// The module that links rosbag_storage.
#include "apps/import/bag.h"

#include <cstdint>
#include <exception>
#include <string>
#include <vector>

#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "apps/config/yaml/text_file.h"

namespace config = twocone::config;
using twocone::importer::Encoding;
using twocone::importer::TopicMessage;

extern "C" bool twocone_read_bag(const std::filesystem::path& file,
                                 const std::function<void(const TopicMessage&)>& use) {
  try {
    rosbag::Bag bag;
    bag.open(file.string(), rosbag::bagmode::Read);
    rosbag::View view(bag);
    std::vector<std::uint8_t> bytes;
    for (const rosbag::MessageInstance& message : view) {
      bytes.resize(message.size());
      ros::serialization::OStream stream(bytes.data(), std::uint32_t(bytes.size()));
      message.write(stream);
      use({message.getTopic(), message.getDataType(), Encoding::kRos1, std::as_bytes(std::span(bytes))});
    }
    return true;
  } catch (const rosbag::BagUnindexedException&) {
    throw config::FileError("{}: has no index, because it was cut off: `rosbag reindex` repairs it", file.string());
  } catch (const rosbag::BagException& error) {
    throw config::FileError("{}: {}", file.string(), error.what());
  } catch (const config::FileError&) {
    throw;  // of `use`
  } catch (const std::exception& error) {  // what the library does not expect in a bag
    throw config::FileError("{}: is damaged: {}", file.string(), error.what());
  }
}
