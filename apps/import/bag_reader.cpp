// SPDX-License-Identifier: Apache-2.0
// The program that reads bags of ROS 1 (bag.h).
//   twocone_rosbag BAG MCAP      writes the bag's messages as an MCAP file; failures are one line on standard error
#include <cstdint>
#include <cstdio>
#include <exception>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "apps/mcap/mcap.h"

namespace mcap = twocone::mcap;

namespace {

void convert(const char* from, const char* to) {
  rosbag::Bag bag;
  bag.open(from, rosbag::bagmode::Read);
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

}  // namespace

int main(int argc, char** words) {
  if (argc != 3) return std::fputs("twocone_rosbag BAG MCAP\n", stderr), 2;
  try {
    convert(words[1], words[2]);
    return 0;
  } catch (const rosbag::BagUnindexedException&) {
    std::fputs("has no index, because it was cut off: `rosbag reindex` repairs it\n", stderr);
  } catch (const rosbag::BagException& error) {
    std::fprintf(stderr, "%s\n", error.what());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "is damaged: %s\n", error.what());
  }
  return 1;
}
