// SPDX-License-Identifier: Apache-2.0
// Feeds damaged MCAP files to the reader and what it returns to the decoders of messages: files whose bytes are
// changed, cut, doubled or swapped, and whose numbers are extreme; compressed and not. The exit status is 1 if anything
// else than config::FileError or BadMessage is thrown. A crash or a report of a sanitizer ends the program earlier.
//   mcap_fuzz TIMES SEED [BAG]      with a small bag of ROS 1: damaged copies of it instead
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <unistd.h>

#include "apps/config/yaml/text_file.h"
#include "apps/import/bag.h"
#include "apps/import/messages.h"
#include "apps/import/topics.h"
#include "apps/mcap/mcap.h"
#include "apps/mcap/records.h"
#include "apps/recording/foxglove.pb.h"
#include "tests/import/ros_message.h"

using namespace twocone;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream from(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(from), {}};
}

/// Returns a message of ROS that is right. @param type as in ROS 1
std::string ros_message(const std::string& type, importer::Encoding encoding, bool is_big_endian) {
  importer::RosMessage message(encoding, is_big_endian);
  message.header(100, 5, "frame");
  constexpr std::uint32_t kWidth_px = 4, kHeight_px = 3;
  if (type == "sensor_msgs/Image") {
    message.number(kHeight_px).number(kWidth_px).text("bgr8").number(std::uint8_t{0}).number(3 * kWidth_px);
    message.data(std::string(std::size_t(3) * kWidth_px * kHeight_px, 'x'));
  } else if (type == "sensor_msgs/CompressedImage") {
    message.text("jpeg").data("content");
  } else if (type == "sensor_msgs/CameraInfo") {
    message.number(kHeight_px).number(kWidth_px).text("plumb_bob").number(std::uint32_t{2}).number(0.1).number(0.2);
    for (int i = 0; i < 9; ++i) message.number(double(i));
  } else {
    message.text("base");
    for (int i = 0; i < 7; ++i) message.number(double(i));
  }
  return message.raw();
}

/// Returns a message of Foxglove that is right.
std::string foxglove_message(const std::string& type) {
  if (type == "foxglove.RawImage") {
    foxglove::RawImage image;
    image.set_width(4);
    image.set_height(3);
    image.set_encoding("rgb8");
    image.set_step(12);
    image.set_data(std::string(36, 'x'));
    return image.SerializeAsString();
  }
  if (type == "foxglove.CompressedImage") {
    foxglove::CompressedImage image;
    image.mutable_timestamp()->set_seconds(7);
    image.set_format("png");
    image.set_data("content");
    return image.SerializeAsString();
  }
  if (type == "foxglove.CameraCalibration") {
    foxglove::CameraCalibration lens;
    lens.set_width(4);
    lens.set_height(3);
    for (int i = 0; i < 9; ++i) lens.add_k(i);
    return lens.SerializeAsString();
  }
  foxglove::PoseInFrame pose;
  pose.mutable_timestamp()->set_nanos(7);
  pose.mutable_pose()->mutable_position()->set_x(1.5);
  pose.mutable_pose()->mutable_orientation()->set_w(1);
  return pose.SerializeAsString();
}

/// Writes a file with messages of each type that import reads, and of one that it does not.
void write_sample(const fs::path& file, std::mt19937_64& random) {
  mcap::Writer writer(file, "fuzz");
  const auto add = [&](const std::string& type, const char* encoding, const std::string& content) {
    const auto schema = writer.add(mcap::Schema{type, encoding, ""});
    const auto channel = writer.add(mcap::Channel{"/" + type, encoding, schema, {}});
    writer.add({channel, 0, random(), random(), std::as_bytes(std::span(content))});
  };
  for (const std::string name : {"Image", "CompressedImage", "CameraInfo", "Odometry"}) {
    const std::string package = name == "Odometry" ? "nav_msgs/" : "sensor_msgs/";
    const std::string type = package + name;
    add(package + "msg/" + name, "cdr", ros_message(type, importer::Encoding::kCdr, random() % 2 == 0));
    add(type, "ros1", ros_message(type, importer::Encoding::kRos1, false));
  }
  for (const char* const type :
       {"foxglove.RawImage", "foxglove.CompressedImage", "foxglove.PoseInFrame", "foxglove.CameraCalibration"}) {
    add(type, "protobuf", foxglove_message(type));
  }
  add("unknown/Type", "json", "{}");
  writer.finish();
}

/// Returns the file with its chunk not compressed, so that changes reach the records in it.
std::string opened(const fs::path& file, const fs::path& to) {
  mcap::Reader reader(file);
  std::string records;
  std::string result(mcap::kMagic);
  result += mcap::Content().text("").text("fuzz").record(mcap::Kind::kHeader);
  std::vector<bool> is_known(65536, false);
  while (const auto message = reader.next()) {
    const mcap::Channel& channel = reader.channels().at(message->channel);
    const mcap::Schema& schema = reader.schemas().at(*channel.schema);
    if (!is_known[message->channel]) {
      is_known[message->channel] = true;
      records += mcap::Content()
                     .number(*channel.schema)
                     .text(schema.name)
                     .text(schema.encoding)
                     .text("")
                     .record(mcap::Kind::kSchema);
      records += mcap::Content()
                     .number(message->channel)
                     .number(*channel.schema)
                     .text(channel.topic)
                     .text(channel.message_encoding)
                     .texts({})
                     .record(mcap::Kind::kChannel);
    }
    records += mcap::Content()
                   .number(message->channel)
                   .number(std::uint32_t(0))
                   .number(message->log_time_ns)
                   .number(message->publish_time_ns)
                   .raw({reinterpret_cast<const char*>(message->data.data()), message->data.size()})
                   .record(mcap::Kind::kMessage);
  }
  result += records;
  std::ofstream(to, std::ios::binary) << result;
  return result;
}

class Damage {
 public:
  explicit Damage(std::mt19937_64& random) : random_(random) {}

  std::string of(std::string content) {
    for (std::uint64_t i = 1 + random_() % 4; i > 0 && !content.empty(); --i) once(content);
    return content;
  }

 private:
  void once(std::string& content) {
    const std::size_t at = random_() % content.size();
    const std::size_t size = 1 + random_() % std::min<std::size_t>(64, content.size() - at);
    switch (random_() % 6) {
      case 0:
        content[at] = char(random_());
        break;
      case 1:
        content[at] = char(content[at] ^ (1 << random_() % 8));
        break;
      case 2:
        content.resize(at);
        break;
      case 3:
        content.insert(at, content.substr(at, size));
        break;
      case 4:
        content.erase(at, size);
        break;
      default: {
        const std::uint64_t numbers[] = {0, 1, 0x7fffffff, 0xffffffff, ~std::uint64_t{0}, std::uint64_t{1} << 40U};
        const std::uint64_t number = numbers[random_() % std::size(numbers)];
        std::memcpy(content.data() + at, &number,
                    std::min<std::size_t>(random_() % 2 == 0 ? 4 : 8, content.size() - at));
      }
    }
  }

  std::mt19937_64& random_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return std::fputs("mcap_fuzz TIMES SEED [BAG]\n", stderr), 2;
  const long times = std::atol(argv[1]);
  std::mt19937_64 random(std::strtoull(argv[2], nullptr, 10));
  // In memory, where there is such a folder.
  const fs::path folder = fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
  const fs::path file = folder / ("twocone_mcap_fuzz_" + std::to_string(::getpid()));
  std::vector<std::string> samples;
  if (argc == 4) samples.push_back(content_of(argv[3]));
  for (int i = 0; i < 4 && argc == 3; ++i) {
    write_sample(file, random);
    samples.push_back(content_of(file));
    samples.push_back(opened(file, folder / (file.filename().string() + "_opened")));
  }
  Damage damage(random);
  long refused = 0, messages = 0, decoded = 0;
  int status = 0;
  for (long i = 0; i < times && status == 0; ++i) {
    std::ofstream(file, std::ios::binary) << damage.of(samples[random() % samples.size()]);
    try {
      const fs::path readable = argc == 4 ? fs::path(file.string() + "_converted") : file;
      if (argc == 4) importer::bag_to_mcap(file, readable);
      importer::read_messages(readable, [&](const importer::TopicMessage& message) {
        ++messages;
        if (importer::kind_of(message.type) == importer::MessageKind::kNone) return;
        try {
          static_cast<void>(importer::decode(message.type, message.encoding, message.bytes));
          ++decoded;
        } catch (const importer::BadMessage&) {
          return;
        }
      });
    } catch (const config::FileError&) {
      ++refused;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "file %ld: %s\n", i, error.what());
      status = 1;
    }
  }
  fs::remove(file);
  fs::remove(folder / (file.filename().string() + "_opened"));
  fs::remove(file.string() + "_converted");
  std::printf("%ld files: %ld refused; %ld messages, %ld decoded\n", times, refused, messages, decoded);
  return status;
}
