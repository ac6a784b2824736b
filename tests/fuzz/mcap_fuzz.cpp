// SPDX-License-Identifier: Apache-2.0
// Feeds damaged MCAP files to the reader and what it returns to the decoders of messages: files whose bytes are
// changed, cut, doubled or swapped, and whose numbers are extreme; compressed and not. The exit status is 1 if anything
// else than config::FileError or BadMessage is thrown. A crash or a report of a sanitizer ends the program earlier.
//   mcap_fuzz TIMES SEED [BAG]      with a small bag of ROS 1: damaged copies of it instead
// The library that reads bags may crash, as in twocone_rosbag, the program that calls it for twocone. Here a child
// process calls it, for a hundred files, because a process for each takes ten times as long.
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef TWOCONE_HAVE_ROSBAG
#include <rosbag/bag.h>
#endif

#include "apps/config/yaml/text_file.h"
#include "apps/import/bag_messages.h"
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

struct Counts {
  long files = 0, refused = 0, messages = 0, decoded = 0;
  bool has_failed = false;
  bool is_reading = false;  ///< in the code of this project, which must not crash
};

/// Damages and reads files until there are as many as asked for, or one fails.
class Fuzz {
 public:
  Fuzz(std::vector<std::string> samples, long times, std::uint64_t seed)
      : samples_(std::move(samples)), times_(times), seed_(seed) {}

  /// @param most how many files at most
  /// @param to_mcap (damaged file): returns the MCAP file to read. @throws config::FileError
  template <typename ToMcap>
  void run(Counts& counts, long most, const fs::path& file, const ToMcap& to_mcap) const {
    for (; most > 0 && !has_ended(counts); --most) {
      std::mt19937_64 random(seed_ + std::uint64_t(counts.files));
      ++counts.files;  // before the file is read: it is not read again if it ends the process
      std::ofstream(file, std::ios::binary) << Damage(random).of(samples_[random() % samples_.size()]);
      try {
        const fs::path readable = to_mcap(file);
        counts.is_reading = true;
        read(readable, counts);
      } catch (const config::FileError&) {
        ++counts.refused;
      } catch (const std::exception& error) {
        std::fprintf(stderr, "file %ld: %s\n", counts.files, error.what());
        counts.has_failed = true;
      }
      counts.is_reading = false;
    }
  }

  [[nodiscard]] bool has_ended(const Counts& counts) const { return counts.files >= times_ || counts.has_failed; }

 private:
  static void read(const fs::path& file, Counts& counts) {
    importer::read_messages(file, [&](const importer::TopicMessage& message) {
      ++counts.messages;
      if (importer::kind_of(message.type) == importer::MessageKind::kNone) return;
      try {
        static_cast<void>(importer::decode(message.type, message.encoding, message.bytes));
        ++counts.decoded;
      } catch (const importer::BadMessage&) {
        return;
      }
    });
  }

  std::vector<std::string> samples_;
  long times_;
  std::uint64_t seed_;
};

Counts with_files(const fs::path& file, long times, std::uint64_t seed) {
  std::vector<std::string> samples;
  std::mt19937_64 random(seed);
  const fs::path other = file.string() + "_opened";
  for (int i = 0; i < 4; ++i) {
    write_sample(file, random);
    samples.push_back(content_of(file));
    samples.push_back(opened(file, other));
  }
  fs::remove(other);
  Counts counts;
  Fuzz(samples, times, seed).run(counts, times, file, [](const fs::path& damaged) { return damaged; });
  return counts;
}

#ifdef TWOCONE_HAVE_ROSBAG
Counts with_bags(const fs::path& sample, const fs::path& file, long times, std::uint64_t seed) {
  constexpr unsigned kPatience_s = 60;
  const Fuzz fuzz({content_of(sample)}, times, seed);
  auto& counts =
      *new (::mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Counts;
  const fs::path converted = file.string() + "_converted";
  // Each child has its own copies. They are made once, because each looks for plug-ins in all of /usr/share.
  std::deque<rosbag::Bag> bags(100);
  std::size_t next = 0;
  const auto to_mcap = [&](const fs::path& damaged) {
    ::alarm(kPatience_s);
    try {
      rosbag::Bag& bag = bags[next++];
      bag.open(damaged.string(), rosbag::bagmode::Read);
      importer::write_messages(bag, converted);
    } catch (const std::exception& error) {
      throw config::FileError("{}: {}", damaged.string(), error.what());
    }
    return converted;
  };
  long crashes = 0, hangs = 0;
  while (!fuzz.has_ended(counts)) {
    const pid_t child = ::fork();
    if (child < 0) return std::perror("fork"), counts.has_failed = true, counts;
    if (child == 0) {
      ::dup2(::open("/dev/null", O_WRONLY), STDERR_FILENO);  // a sanitizer's reports of the library's crashes
      fuzz.run(counts, long(bags.size()), file, to_mcap);
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (status != 0 && counts.is_reading) {
      std::fprintf(stderr, "file %ld: a crash after the library has read it\n", counts.files);
      counts.has_failed = true;
    }
    crashes += status == 0 ? 0 : 1;
    hangs += WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM ? 1 : 0;
  }
  fs::remove(converted);
  counts.refused += crashes;
  std::printf("the library that reads bags ended its process %ld times (crash, memory), %ld of them after %u s; ",
              crashes, hangs, kPatience_s);
  return counts;
}
#endif

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return std::fputs("mcap_fuzz TIMES SEED [BAG]\n", stderr), 2;
  const long times = std::atol(argv[1]);
  const std::uint64_t seed = std::strtoull(argv[2], nullptr, 10);
  // In memory, where there is such a folder.
  const fs::path folder = fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
  const fs::path file = folder / ("twocone_mcap_fuzz_" + std::to_string(::getpid()));
#ifdef TWOCONE_HAVE_ROSBAG
  const Counts counts = argc == 4 ? with_bags(argv[3], file, times, seed) : with_files(file, times, seed);
#else
  if (argc == 4) return std::fputs("this build does not read bags: install librosbag-storage-dev\n", stderr), 2;
  const Counts counts = with_files(file, times, seed);
#endif
  fs::remove(file);
  std::printf("%ld files: %ld refused; %ld messages, %ld decoded\n", counts.files, counts.refused, counts.messages,
              counts.decoded);
  return counts.has_failed ? 1 : 0;
}
