// SPDX-License-Identifier: Apache-2.0
#include "apps/mcap/mcap.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace twocone::mcap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Bytes bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string text_of(const Message& message) {
  return {reinterpret_cast<const char*>(message.data.data()), message.data.size()};
}

std::string content_of(const fs::path& file) {
  std::ifstream from(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(from), {}};
}

void write(const fs::path& file, const std::string& content) { std::ofstream(file, std::ios::binary) << content; }

/// What a test writes: two channels, of which one has no schema, and messages of up to 6 kB, some chunks in all.
struct Sample {
  std::vector<std::string> texts;
  std::vector<std::uint16_t> channels;

  explicit Sample(const fs::path& file, int count = 3000) {
    std::mt19937 random(7);
    Writer writer(file, "a test");
    const std::uint16_t schema = writer.add(Schema{"a.B", "jsonschema", R"({"type": "object"})"});
    const std::uint16_t described = writer.add(Channel{"/described", "json", schema, {{"key", "value"}}});
    const std::uint16_t plain = writer.add(Channel{"/plain", "text", {}, {}});
    writer.add_metadata("about", {{"robot", "lab"}});
    for (int i = 0; i < count; ++i) {
      std::string text(random() % 6000, '\0');
      for (char& c : text) c = char('a' + random() % 4);
      texts.push_back(text);
      channels.push_back(i % 3 == 0 ? plain : described);
      writer.add({channels.back(), 99, std::uint64_t(1000 + i), std::uint64_t(2000 + i), bytes_of(texts.back())});
    }
    writer.finish();
  }
};

std::string error_of(const fs::path& file) {
  try {
    Reader reader(file);
    while (reader.next()) continue;
  } catch (const McapError& error) {
    return error.what();
  }
  return "none";
}

TEST(Mcap, WhatIsWrittenIsRead) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  const Sample sample(file);
  Reader reader(file);
  std::size_t count = 0;
  std::vector<std::uint32_t> sequences(2, 0);
  while (const auto message = reader.next()) {
    ASSERT_LT(count, sample.texts.size());
    EXPECT_EQ(text_of(*message), sample.texts[count]);
    EXPECT_EQ(message->channel, sample.channels[count]);
    EXPECT_EQ(message->sequence, sequences[message->channel]++);
    EXPECT_EQ(message->log_time_ns, 1000 + count);
    EXPECT_EQ(message->publish_time_ns, 2000 + count);
    ++count;
  }
  EXPECT_EQ(count, sample.texts.size());
  EXPECT_TRUE(reader.is_complete());
  const Channel& described = reader.channels().at(0);
  EXPECT_EQ(described.topic, "/described");
  EXPECT_EQ(described.metadata.at("key"), "value");
  EXPECT_EQ(reader.schemas().at(*described.schema).name, "a.B");
  EXPECT_FALSE(reader.channels().at(1).schema);
}

TEST(Mcap, EqualContentGivesEqualBytes) {
  const testing_support::TemporaryFolder folder;
  const Sample one(folder.path() / "a.mcap", 100), two(folder.path() / "b.mcap", 100);
  EXPECT_EQ(content_of(folder.path() / "a.mcap"), content_of(folder.path() / "b.mcap"));
}

TEST(Mcap, AFileWithoutMessagesIsOne) {
  const testing_support::TemporaryFolder folder;
  Writer(folder.path() / "a.mcap", "a test").finish();
  Reader reader(folder.path() / "a.mcap");
  EXPECT_FALSE(reader.next());
  EXPECT_TRUE(reader.is_complete());
}

// Catches a recording of a robot that lost its power, which nobody can open.
TEST(Mcap, AFileThatWasCutOffIsReadUpToItsLastChunk) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  const Sample sample(file);
  const std::string whole = content_of(file);
  std::size_t before = 0;
  for (const double share : {0.2, 0.5, 0.8}) {
    write(file, whole.substr(0, std::size_t(share * double(whole.size()))));
    Reader reader(file);
    std::size_t count = 0;
    while (const auto message = reader.next()) EXPECT_EQ(text_of(*message), sample.texts[count++]);
    EXPECT_FALSE(reader.is_complete());
    EXPECT_GE(count, before);
    before = count;
  }
  EXPECT_GT(before, sample.texts.size() / 3);
}

TEST(Mcap, DamageIsNamed) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  const Sample sample(file, 20);
  const std::string whole = content_of(file);
  write(file, "PNG");
  EXPECT_THAT(error_of(file), HasSubstr("is no MCAP file"));
  EXPECT_THAT(error_of(folder.path() / "none.mcap"), HasSubstr("cannot be read"));
  std::string damaged = whole;
  damaged[whole.size() / 2] ^= 0x40;  // within the only chunk
  write(file, damaged);
  EXPECT_THAT(error_of(file), HasSubstr("chunk"));
  // Another compression, by the same number of letters.
  damaged = whole;
  damaged.replace(whole.find("zstd"), 4, "lzma");
  write(file, damaged);
  EXPECT_THAT(error_of(file), HasSubstr("compressed by 'lzma', must be zstd or not at all"));
}

// Catches a size that a file states, for which memory is taken before there is content.
TEST(Mcap, ASizeThatCannotBeIsRefused) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.mcap";
  const Sample sample(file, 20);
  std::string content = content_of(file);
  const std::size_t compression = content.find("zstd");
  const std::uint64_t huge = std::uint64_t{1} << 40U;
  std::memcpy(content.data() + compression - 16, &huge, sizeof huge);  // the size of the chunk's records
  write(file, content);
  EXPECT_THAT(error_of(file), HasSubstr("must be at most"));
}

TEST(Mcap, ADiskThatTakesNothingIsNamed) {
  const testing_support::TemporaryFolder folder;
  EXPECT_THROW(Writer(folder.path() / "none" / "a.mcap", "a test"), McapError);
}

}  // namespace
}  // namespace twocone::mcap
