// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/errors.h"

/// The container format MCAP (https://mcap.dev/spec), version 0: messages of several topics with their times, in chunks
/// that are compressed by zstd, with an index.
namespace twocone::mcap {

/// A file is no MCAP file, is damaged, or has what this reader does not know; or the disk does not accept it. The
/// message is one line: the file, the byte where it is, and what is wrong.
struct McapError : base::FormattedError {
  using Formatted::Formatted;
};

/// The definition of a message's content.
struct Schema {
  std::string name;      ///< foxglove.CompressedImage
  std::string encoding;  ///< protobuf, ros2msg, ...
  std::string data;      ///< for protobuf a FileDescriptorSet; text for ros2msg
};

struct Channel {
  std::string topic;
  std::string message_encoding;                 ///< protobuf, cdr, ...
  std::optional<std::uint16_t> schema;          ///< identifies a schema; none: the encoding describes itself
  std::map<std::string, std::string> metadata;  ///< for readers that look for them
};

using Bytes = std::span<const std::byte>;

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;                          ///< counts a channel's messages
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;  ///< since 1970, or since the start of a recording
  Bytes data;                                          ///< valid until the next call of the reader
};

/// Writes a file from begin to end. A file that was not finished, because its program ended, can be read up to its last
/// whole chunk.
class Writer {
 public:
  /// @param library the name of the writing program. @throws McapError if the file cannot be made
  Writer(const std::filesystem::path& file, std::string_view library);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Add a schema or a channel, and return its identifier. At most 65,535 of each. @throws McapError
  std::uint16_t add(Schema schema);
  std::uint16_t add(Channel channel);
  /// Adds named texts that belong to the whole file. @throws McapError
  void add_metadata(const std::string& name, const std::map<std::string, std::string>& texts);
  /// @param message its sequence is counted here, whatever it states. @throws McapError; std::out_of_range for a
  /// channel that was not added
  void add(const Message& message);
  /// Writes what is left and the index. Nothing can be added then. @throws McapError
  void finish();

 private:
  struct ChunkIndex;
  void write(std::string_view bytes);
  void write_chunk();

  std::filesystem::path file_;
  std::ofstream to_;
  std::uint64_t written_ = 0;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<std::uint32_t> counts_;  ///< of each channel's messages
  std::string chunk_;                  ///< the records of the present chunk
  std::uint64_t chunk_begin_ns_ = 0, chunk_end_ns_ = 0;
  /// Of the present chunk: for each channel, the times and places of its messages.
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> places_;
  std::vector<ChunkIndex> chunks_;
  std::string metadata_index_;  ///< its records
  std::uint32_t metadata_count_ = 0;
  bool is_finished_ = false;
};

/// Reads a file's messages from begin to end, in the order in which they were written. It does not use the index, so
/// that a file which was cut off is read as far as it goes.
class Reader {
 public:
  /// @throws McapError
  explicit Reader(const std::filesystem::path& file);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// Returns the next message, or nothing at the end. @throws McapError for damaged content and unknown compressions
  std::optional<Message> next();

  /// Those that were read so far, by their identifiers; those of a message's channel always were.
  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  /// Returns whether all data are there; false: the file was cut off. Known at the end.
  [[nodiscard]] bool is_complete() const { return is_complete_; }

 private:
  struct Record;
  std::optional<Record> next_record();
  std::optional<Record> record_of_file();
  void open_chunk(Bytes content);
  void take_schema(Bytes content);
  void take_channel(Bytes content);
  Message take_message(Bytes content) const;
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path file_;
  std::ifstream from_;
  std::uint64_t size_ = 0, at_ = 0;  ///< of the file
  std::vector<std::byte> record_;    ///< the content of the present record
  std::vector<std::byte> chunk_;     ///< the records of the present chunk, decompressed
  std::size_t in_chunk_ = 0;         ///< the place in it
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  bool is_complete_ = false;
  bool is_at_end_ = false;
};

}  // namespace twocone::mcap
