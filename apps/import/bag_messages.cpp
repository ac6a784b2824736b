// SPDX-License-Identifier: Apache-2.0
#include "apps/import/bag_messages.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "apps/mcap/mcap.h"

namespace twocone::importer {

void write_messages(const rosbag::Bag& bag, const std::filesystem::path& to) {
  rosbag::View view(bag);
  mcap::Writer writer(to, "twocone_rosbag");
  std::map<std::string, std::uint16_t> channels;
  std::vector<std::uint8_t> bytes;
  for (const rosbag::MessageInstance& message : view) {
    const std::string& topic = message.getTopic();
    auto channel = channels.find(topic);
    if (channel == channels.end()) {
      const auto schema = writer.add(mcap::Schema{message.getDataType(), "ros1msg", message.getMessageDefinition()});
      channel = channels.emplace(topic, writer.add(mcap::Channel{topic, "ros1", schema, {}})).first;
    }
    bytes.resize(message.size());
    ros::serialization::OStream stream(bytes.data(), std::uint32_t(bytes.size()));
    message.write(stream);
    const std::uint64_t time_ns = message.getTime().toNSec();
    writer.add({channel->second, 0, time_ns, time_ns, std::as_bytes(std::span(bytes))});
  }
  writer.finish();
}

}  // namespace twocone::importer
