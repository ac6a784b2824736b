// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "apps/mcap/mcap.h"
#include "apps/mcap/records.h"

namespace twocone::mcap {
namespace {

// A reader decompresses a chunk as a whole. Images make up nearly all of a file, so that some frames fill one.
constexpr std::size_t kChunkBytes = 4U << 20U;
constexpr int kLevel = 3;  // of zstd, its default

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  return std::uint32_t(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string compressed(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), kLevel);
  // It fails only for want of memory.
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();
  result.resize(size);
  return result;
}

std::string record_of(std::uint16_t id, const Schema& schema) {
  return Content().number(id).text(schema.name).text(schema.encoding).text(schema.data).record(Kind::kSchema);
}

std::string record_of(std::uint16_t id, const Channel& channel) {
  return Content()
      .number(id)
      .number(channel.schema.value_or(0))
      .text(channel.topic)
      .text(channel.message_encoding)
      .texts(channel.metadata)
      .record(Kind::kChannel);
}

}  // namespace

struct Writer::ChunkIndex {
  std::uint64_t begin_ns, end_ns, offset, length, index_length, compressed, uncompressed;
  std::map<std::uint16_t, std::uint64_t> message_indexes;  ///< their places in the file, by channel
};

Writer::Writer(const std::filesystem::path& file, std::string_view library)
    : file_(file), to_(file, std::ios::binary | std::ios::trunc) {
  if (!to_) throw McapError("{}: cannot be written", file.string());
  write(kMagic);
  write(Content().text("").text(library).record(Kind::kHeader));
}

Writer::~Writer() = default;

void Writer::write(std::string_view bytes) {
  to_.write(bytes.data(), std::streamsize(bytes.size()));
  if (!to_) throw McapError("{}: the disk does not accept it after {} bytes", file_.string(), written_);
  written_ += bytes.size();
}

std::uint16_t Writer::add(Schema schema) {
  if (schemas_.size() == std::numeric_limits<std::uint16_t>::max())
    throw McapError("{}: too many schemas", file_.string());
  schemas_.push_back(std::move(schema));
  const auto id = std::uint16_t(schemas_.size());  // 0 means that a channel has none
  chunk_ += record_of(id, schemas_.back());
  return id;
}

std::uint16_t Writer::add(Channel channel) {
  if (channels_.size() == std::numeric_limits<std::uint16_t>::max()) {
    throw McapError("{}: too many channels", file_.string());
  }
  channels_.push_back(std::move(channel));
  counts_.push_back(0);
  const auto id = std::uint16_t(channels_.size() - 1);
  chunk_ += record_of(id, channels_.back());
  return id;
}

void Writer::add_metadata(const std::string& name, const std::map<std::string, std::string>& texts) {
  const std::string record = Content().text(name).texts(texts).record(Kind::kMetadata);
  metadata_index_ +=
      Content().number(written_).number(std::uint64_t(record.size())).text(name).record(Kind::kMetadataIndex);
  ++metadata_count_;
  write(record);
}

void Writer::add(const Message& message) {
  std::uint32_t& count = counts_.at(message.channel);
  if (places_.empty()) chunk_begin_ns_ = chunk_end_ns_ = message.log_time_ns;
  chunk_begin_ns_ = std::min(chunk_begin_ns_, message.log_time_ns);
  chunk_end_ns_ = std::max(chunk_end_ns_, message.log_time_ns);
  places_[message.channel].emplace_back(message.log_time_ns, chunk_.size());
  chunk_ += Content()
                .number(message.channel)
                .number(count++)
                .number(message.log_time_ns)
                .number(message.publish_time_ns)
                .raw({reinterpret_cast<const char*>(message.data.data()), message.data.size()})
                .record(Kind::kMessage);
  if (chunk_.size() >= kChunkBytes) write_chunk();
}

void Writer::write_chunk() {
  const std::string small = compressed(chunk_);
  const std::string record = Content()
                                 .number(chunk_begin_ns_)
                                 .number(chunk_end_ns_)
                                 .number(std::uint64_t(chunk_.size()))
                                 .number(crc_of(chunk_))
                                 .text("zstd")
                                 .number(std::uint64_t(small.size()))
                                 .raw(small)
                                 .record(Kind::kChunk);
  ChunkIndex index{chunk_begin_ns_, chunk_end_ns_, written_, record.size(), 0, small.size(), chunk_.size(), {}};
  write(record);
  const std::uint64_t indexes_from = written_;
  for (const auto& [channel, places] : places_) {
    Content entries;
    for (const auto& [time_ns, place] : places) entries.number(time_ns).number(place);
    index.message_indexes[channel] = written_;
    write(Content().number(channel).text(entries.bytes()).record(Kind::kMessageIndex));
  }
  index.index_length = written_ - indexes_from;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  places_.clear();
  chunk_begin_ns_ = chunk_end_ns_ = 0;
  to_.flush();
}

void Writer::finish() {
  if (std::exchange(is_finished_, true)) return;
  if (!chunk_.empty()) write_chunk();
  write(Content().number(std::uint32_t(0)).record(Kind::kDataEnd));  // 0: without a checksum of all that is before

  const std::uint64_t summary_start = written_;
  std::string summary, offsets;
  const auto add_group = [&](Kind kind, const std::string& records) {
    if (records.empty()) return;
    offsets += Content()
                   .number(std::uint8_t(kind))
                   .number(summary_start + summary.size())
                   .number(std::uint64_t(records.size()))
                   .record(Kind::kSummaryOffset);
    summary += records;
  };
  std::string records;
  for (std::size_t i = 0; i < schemas_.size(); ++i) records += record_of(std::uint16_t(i + 1), schemas_[i]);
  add_group(Kind::kSchema, std::exchange(records, ""));
  for (std::size_t i = 0; i < channels_.size(); ++i) records += record_of(std::uint16_t(i), channels_[i]);
  add_group(Kind::kChannel, std::exchange(records, ""));

  Content counts;
  std::uint64_t messages = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (counts_[i] > 0) counts.number(std::uint16_t(i)).number(std::uint64_t(counts_[i]));
    messages += counts_[i];
  }
  // Of no messages, both are 0.
  std::uint64_t begin_ns = std::numeric_limits<std::uint64_t>::max(), end_ns = 0;
  for (const ChunkIndex& chunk : chunks_) {
    if (!chunk.message_indexes.empty()) begin_ns = std::min(begin_ns, chunk.begin_ns);
    end_ns = std::max(end_ns, chunk.end_ns);
  }
  if (messages == 0) begin_ns = 0;
  add_group(Kind::kStatistics, Content()
                                   .number(messages)
                                   .number(std::uint16_t(schemas_.size()))
                                   .number(std::uint32_t(channels_.size()))
                                   .number(std::uint32_t(0))  // attachments
                                   .number(metadata_count_)
                                   .number(std::uint32_t(chunks_.size()))
                                   .number(begin_ns)
                                   .number(end_ns)
                                   .text(counts.bytes())
                                   .record(Kind::kStatistics));
  for (const ChunkIndex& chunk : chunks_) {
    Content places;
    for (const auto& [channel, place] : chunk.message_indexes) places.number(channel).number(place);
    records += Content()
                   .number(chunk.begin_ns)
                   .number(chunk.end_ns)
                   .number(chunk.offset)
                   .number(chunk.length)
                   .text(places.bytes())
                   .number(chunk.index_length)
                   .text("zstd")
                   .number(chunk.compressed)
                   .number(chunk.uncompressed)
                   .record(Kind::kChunkIndex);
  }
  add_group(Kind::kChunkIndex, records);
  add_group(Kind::kMetadataIndex, metadata_index_);

  const std::uint64_t offsets_start = summary_start + summary.size();
  // The checksum is that of all from the summary on, with the footer's first two numbers.
  constexpr std::uint64_t kFooterSize = 20;
  const std::string before = summary + offsets +
                             Content()
                                 .number(std::uint8_t(Kind::kFooter))
                                 .number(kFooterSize)
                                 .number(summary_start)
                                 .number(offsets_start)
                                 .bytes();
  write(before);
  write(Content().number(crc_of(before)).raw(kMagic).bytes());
  to_.close();
  if (!to_) throw McapError("{}: the disk does not accept it after {} bytes", file_.string(), written_);
}

}  // namespace twocone::mcap
