// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "apps/mcap/mcap.h"
#include "apps/mcap/records.h"

namespace twocone::mcap {
namespace {

// A record or a chunk that is larger is no recording of a robot: a file may state any size.
constexpr std::uint64_t kMostBytes = 1U << 30U;
// Memory is taken as the file has content for it, not as it states sizes.
constexpr std::size_t kPiece = 1U << 20U;

}  // namespace

struct Reader::Record {
  Kind kind;
  Bytes content;
  bool is_of_chunk;
};

void Reader::fail(const std::string& what) const { throw McapError("{}: byte {}: {}", file_.string(), at_, what); }

Reader::Reader(const std::filesystem::path& file) : file_(file), from_(file, std::ios::binary) {
  std::error_code error;
  size_ = std::filesystem::file_size(file, error);
  if (error || !from_) throw McapError("{}: cannot be read", file.string());
  std::array<char, kMagic.size()> magic{};
  from_.read(magic.data(), magic.size());
  if (!from_ || std::string_view(magic.data(), magic.size()) != kMagic) {
    fail("is no MCAP file of version 0: it does not begin with its eight bytes");
  }
  at_ = magic.size();
}

Reader::~Reader() = default;

std::optional<Reader::Record> Reader::record_of_file() {
  std::array<std::byte, kRecordHead> head{};
  if (size_ - at_ < head.size() || !from_.read(reinterpret_cast<char*>(head.data()), head.size())) return std::nullopt;
  Fields fields(head);
  const auto kind = Kind(fields.number<std::uint8_t>());
  const auto size = fields.number<std::uint64_t>();
  // The last record of a file that was cut off.
  if (size > size_ - at_ - head.size()) return std::nullopt;
  if (size > kMostBytes) fail(fmt::format("a record of {} bytes, must be at most {}", size, kMostBytes));
  record_.resize(size);
  if (!from_.read(reinterpret_cast<char*>(record_.data()), std::streamsize(size))) fail("cannot be read");
  at_ += head.size() + size;
  return Record{kind, record_, false};
}

std::optional<Reader::Record> Reader::next_record() {
  if (in_chunk_ == chunk_.size()) return record_of_file();
  const Bytes left = Bytes(chunk_).subspan(in_chunk_);
  Fields fields(left);
  const auto kind = Kind(fields.number<std::uint8_t>());
  const Bytes content = fields.raw(fields.number<std::uint64_t>());
  if (fields.has_failed()) fail("a record is longer than the chunk that has it");
  in_chunk_ += kRecordHead + content.size();
  return Record{kind, content, true};
}

void Reader::open_chunk(Bytes content) {
  Fields fields(content);
  fields.raw(16);  // the times of its messages
  const auto size = fields.number<std::uint64_t>();
  const auto crc = fields.number<std::uint32_t>();
  const std::string compression = fields.text();
  const Bytes small = fields.raw(fields.number<std::uint64_t>());
  if (fields.has_failed()) fail("a chunk is shorter than its parts");
  if (size > kMostBytes) fail(fmt::format("a chunk of {} bytes, must be at most {}", size, kMostBytes));
  chunk_.clear();
  in_chunk_ = 0;
  if (compression.empty()) {
    chunk_.assign(small.begin(), small.end());
  } else if (compression == "zstd") {
    const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(), ZSTD_freeDStream);
    ZSTD_inBuffer in{small.data(), small.size(), 0};
    while (true) {
      const std::size_t before = chunk_.size();
      chunk_.resize(std::min<std::size_t>(size, before + kPiece));
      ZSTD_outBuffer out{chunk_.data() + before, chunk_.size() - before, 0};
      const std::size_t status = ZSTD_decompressStream(stream.get(), &out, &in);
      if (ZSTD_isError(status) != 0) fail(fmt::format("a damaged chunk ({})", ZSTD_getErrorName(status)));
      chunk_.resize(before + out.pos);
      if (status == 0 || out.pos == 0) break;
    }
  } else {
    fail(fmt::format(
        "chunks are compressed by '{}', must be zstd or not at all: `mcap compress` makes such a file of it",
        compression));
  }
  if (chunk_.size() != size) fail(fmt::format("a chunk has {} bytes, and states {}", chunk_.size(), size));
  const auto found = ::crc32_z(0, reinterpret_cast<const Bytef*>(chunk_.data()), chunk_.size());
  if (crc != 0 && crc != found) fail("a chunk does not have its checksum: the file is damaged");
}

void Reader::take_schema(Bytes content) {
  Fields fields(content);
  const auto id = fields.number<std::uint16_t>();
  Schema schema{fields.text(), fields.text(), fields.text()};
  if (fields.has_failed() || id == 0) fail("a damaged schema");
  schemas_.try_emplace(id, std::move(schema));
}

void Reader::take_channel(Bytes content) {
  Fields fields(content);
  const auto id = fields.number<std::uint16_t>();
  const auto schema = fields.number<std::uint16_t>();
  Channel channel{fields.text(), fields.text(), {}, fields.texts()};
  if (fields.has_failed()) fail("a damaged channel");
  if (schema != 0) channel.schema = schema;
  if (schema != 0 && !schemas_.contains(schema)) {
    fail(fmt::format("topic {} has the schema {}, which was not there before", channel.topic, schema));
  }
  channels_.try_emplace(id, std::move(channel));
}

Message Reader::take_message(Bytes content) const {
  Fields fields(content);
  Message message;
  message.channel = fields.number<std::uint16_t>();
  message.sequence = fields.number<std::uint32_t>();
  message.log_time_ns = fields.number<std::uint64_t>();
  message.publish_time_ns = fields.number<std::uint64_t>();
  message.data = fields.rest();
  if (fields.has_failed()) fail("a damaged message");
  if (!channels_.contains(message.channel)) {
    fail(fmt::format("a message of the channel {}, which was not there before", message.channel));
  }
  return message;
}

std::optional<Message> Reader::next() {
  while (!is_at_end_) {
    const auto record = next_record();
    if (!record) break;
    switch (record->kind) {
      case Kind::kSchema:
        take_schema(record->content);
        break;
      case Kind::kChannel:
        take_channel(record->content);
        break;
      case Kind::kMessage:
        return take_message(record->content);
      case Kind::kChunk:
        if (record->is_of_chunk) fail("a chunk within a chunk");
        open_chunk(record->content);
        break;
      case Kind::kDataEnd:
      case Kind::kFooter:
        is_complete_ = true;
        is_at_end_ = true;
        break;
      default:
        break;  // an index, or a kind of a later version
    }
  }
  is_at_end_ = true;
  return std::nullopt;
}

}  // namespace twocone::mcap
