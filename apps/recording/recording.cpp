// SPDX-License-Identifier: Apache-2.0
#include "apps/recording/recording.h"

#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/estimation/mapping.h"
#include "apps/recording/run_messages.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/version.h"
#include "apps/telemetry/telemetry.h"

namespace twocone::recording {
namespace {

namespace fs = std::filesystem;

/// Returns the content of a file, or nothing.
std::optional<std::string> content_of(const fs::path& file) {
  std::ifstream from(file, std::ios::binary);
  if (!from) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(from), {});
}

/// Adds messages to a file. Channels and schemas are added with their first message.
class McapMessages {
 public:
  explicit McapMessages(mcap::Writer& to) : to_(to) {}

  void add(const RunMessage& message) {
    const std::uint64_t time_ns = to_ns(message.t_s);
    to_.add({channel_of(message), 0, time_ns, time_ns, std::as_bytes(std::span(message.bytes))});
    ++count_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::uint16_t channel_of(const RunMessage& message) {
    if (const auto known = channels_.find(message.topic); known != channels_.end()) return known->second;
    const auto [schema, is_new] = schemas_.try_emplace(&message.schema, 0);
    if (is_new) schema->second = to_.add(message.schema);
    return channels_[message.topic] =
               to_.add(mcap::Channel{message.topic, std::string(message.encoding), schema->second, {}});
  }

  mcap::Writer& to_;
  std::map<std::string, std::uint16_t> channels_;  ///< by topic
  std::map<const mcap::Schema*, std::uint16_t> schemas_;
  std::size_t count_ = 0;
};

ExportCounts write(const telemetry::StoredRun& run, mcap::Writer& to, const std::function<void(double)>& progress) {
  const runlog::RunData& data = run.data();
  const runlog::RunInfo& info = data.info;
  to.add_metadata("twocone", {{"version", info.version},
                              {"commit", info.commit},
                              {"behaviour", info.behaviour},
                              {"method", data.method},
                              {"robot", data.robot.file.string()},
                              {"map", data.robot.map.string()}});
  McapMessages file(to);
  const RunMessages messages(data.robot, info.maps ? estimation::without_landmarks(data.map) : data.map,
                             [&file](const RunMessage& message) { file.add(message); });
  messages.begin(run.run().dump());
  for (const std::string& event : info.events) messages.event(0, event);
  ExportCounts counts;
  for (; counts.frames < run.size(); ++counts.frames) {
    const runlog::FrameRecord record = run.record(counts.frames);
    const auto files = runlog::images_of(data, counts.frames);
    bool has_both = true;
    for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
      auto content = content_of(files[std::size_t(side)]);
      has_both = has_both && content;
      const double t_s = side == vision::Side::kLower ? record.frame.lower_t_s : record.frame.upper_t_s;
      if (content) messages.image(side, t_s, "png", *std::move(content));
    }
    if (!has_both) ++counts.without_images;
    messages.frame(record, runlog::has_odometry(data), run.frame(counts.frames).dump());
    progress(double(counts.frames + 1) / double(run.size()));
  }
  counts.messages = file.count();
  return counts;
}

}  // namespace

ExportCounts export_run(const fs::path& run, const fs::path& file, const std::function<void(double)>& progress) {
  const telemetry::StoredRun stored(run);
  const fs::path coming = file.string() + ".part";
  try {
    mcap::Writer to(coming, fmt::format("twocone {}", runlog::version()));
    const ExportCounts counts = write(stored, to, progress);
    to.finish();
    std::error_code error;
    fs::rename(coming, file, error);
    if (error) throw runlog::DiskError("{}: {}", file.string(), error.message());
    return counts;
  } catch (...) {
    std::error_code ignored;
    fs::remove(coming, ignored);
    throw;
  }
}

}  // namespace twocone::recording
