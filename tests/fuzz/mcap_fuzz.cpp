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
#include <string>
#include <vector>

#include <unistd.h>

#include "apps/config/yaml/text_file.h"
#include "apps/import/messages.h"
#include "apps/import/topics.h"
#include "apps/mcap/mcap.h"
#include "apps/mcap/records.h"

using namespace twocone;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream from(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(from), {}};
}

/// Writes a file with a message of each type that import reads, whose content is noise, and of each encoding.
void write_sample(const fs::path& file, std::mt19937_64& random) {
  mcap::Writer writer(file, "fuzz");
  for (const char* type :
       {"sensor_msgs/msg/Image", "sensor_msgs/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo",
        "nav_msgs/msg/Odometry", "nav_msgs/Odometry", "foxglove.RawImage", "foxglove.CompressedImage",
        "foxglove.PoseInFrame", "foxglove.CameraCalibration", "unknown/Type"}) {
    const auto schema = writer.add(mcap::Schema{type, "ros2msg", ""});
    for (const char* encoding : {"cdr", "ros1", "protobuf", "json"}) {
      const auto channel = writer.add(mcap::Channel{std::string("/") + type, encoding, schema, {}});
      std::string text(random() % 200, '\0');
      for (char& c : text) c = random() % 2 == 0 ? '\0' : char(random() % 8);
      if (text.size() > 4) text[0] = 0, text[1] = 1;
      writer.add({channel, 0, random(), random(), std::as_bytes(std::span(text))});
    }
  }
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
      importer::read_messages(file, [&](const importer::TopicMessage& message) {
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
  std::printf("%ld files: %ld refused; %ld messages, %ld decoded\n", times, refused, messages, decoded);
  return status;
}
