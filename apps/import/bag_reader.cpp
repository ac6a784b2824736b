// SPDX-License-Identifier: Apache-2.0
// The program that reads bags of ROS 1 (bag.h).
//   twocone_rosbag BAG MCAP      writes the bag's messages as an MCAP file; failures are one line on standard error
#include <cstdio>
#include <exception>

#include <rosbag/bag.h>

#include "apps/import/bag_messages.h"

int main(int argc, char** words) {
  if (argc != 3) return std::fputs("twocone_rosbag BAG MCAP\n", stderr), 2;
  try {
    rosbag::Bag bag;
    bag.open(words[1], rosbag::bagmode::Read);
    twocone::importer::write_messages(bag, words[2]);
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
