// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/shard.h"

#include <unistd.h>

#include <sstream>
#include <system_error>
#include <tuple>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/tables/tables.h"
#include "apps/runlog/version.h"

namespace twocone::tradeoff {
namespace {

namespace fs = std::filesystem;

// ---- rows

/// Calls `handle(file, header, rows, fields_of_a_row)` for each table of a shard.
void for_each_table(auto& record, const auto& handle) {
  handle("frames.csv",
         "setting,episode,step,verdict,error_m,heading_error_rad,in_ellipse,bound_m,vision_s,localisation_s",
         record.frames, [](auto& r) {
           return std::tie(r.setting, r.episode, r.step, r.verdict, r.error_m, r.heading_error_rad, r.in_ellipse,
                           r.bound_m, r.vision_s, r.localisation_s);
         });
  handle("ranges.csv", "setting,episode,step,error_m", record.ranges,
         [](auto& r) { return std::tie(r.setting, r.episode, r.step, r.error_m); });
  handle("renders.csv", "setting,episode,step,cpu_s", record.renders,
         [](auto& r) { return std::tie(r.setting, r.episode, r.step, r.cpu_s); });
  const auto memory_fields = [](auto& r) { return std::tie(r.setting, r.peak_bytes); };
  handle("memory.csv", "setting,peak_bytes", record.memory, memory_fields);
  handle("render_memory.csv", "setting,peak_bytes", record.render_memory, memory_fields);
}

void write(const fs::path& folder, const ShardRecord& record) {
  for_each_table(record, [&](const char* file, const char* header, const auto& rows, const auto& fields_of) {
    std::string text = std::string(header) + '\n';
    for (const auto& row : rows) text += runlog::join_fields(fields_of(row)) + '\n';
    runlog::write_whole(folder / file, text);
  });
}

/// Appends the rows of the folder's tables to `record`.
void read(const fs::path& folder, ShardRecord& record) {
  for_each_table(record, [&](const char* name, const char* header, auto& rows, const auto& fields_of) {
    const fs::path file = folder / name;
    std::istringstream lines(config::read_text(file));
    std::string line;
    const auto refuse = [&](int number, const std::string& why) {
      throw config::FileError("{}:{}: {}; remove {} and the shard is made again", file.string(), number, why,
                              folder.string());
    };
    if (!std::getline(lines, line) || config::present_columns(line) != header) {
      refuse(1, fmt::format("the first line must be {}", header));
    }
    for (int number = 2; std::getline(lines, line); ++number) {
      const std::vector<std::string> fields = runlog::split_fields(line);
      const auto take_all = [&](auto&... value) {
        std::size_t at = 0;
        return fields.size() == sizeof...(value) && (runlog::parse_field(fields[at++], value) && ...);
      };
      if (!std::apply(take_all, fields_of(rows.emplace_back()))) {
        refuse(number, fmt::format("'{}' is not a row of {}", line, header));
      }
    }
  });
}

// ---- the plan's file

/// Returns the text of plan.yaml: everything that a shard's results depend on. It contains the map's scene. Of files
/// that the scene includes, it contains only the names.
std::string plan_text(const config::Robot& robot, const config::Map& map, const Plan& plan) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::Comment("A sweep of twocone tradeoff: shards made from anything else are not of it.");
  out << YAML::BeginMap;
  const auto put = [&out](const char* key, const auto& value) { out << YAML::Key << key << YAML::Value << value; };
  put("twocone", runlog::version());
  put("commit", runlog::commit());
  put("seed", plan.options.seed);
  put("episodes", plan.options.episodes);
  put("fine", plan.options.fine);
  put("shards", plan.shards.size());
  put("settings", plan.settings.size());
  std::vector<std::string> settings;
  for (const Setting& setting : plan.settings) settings.push_back(describe(setting));
  put("list", settings);
  put("landmarks", plan.landmarks);
  put("robot", config::load_robot_node(robot));
  put("map", config::load_map_node(map.file));
  if (map.scene) put("scene", config::read_text(*map.scene));
  out << YAML::EndMap;
  return std::string(out.c_str()) + '\n';
}

/// Returns a message with the first line in which two texts differ.
std::string first_difference(const std::string& there, const std::string& wanted) {
  std::istringstream a(there);
  std::istringstream b(wanted);
  for (std::string was, is;;) {
    const bool more_there = bool(std::getline(a, was));
    const bool more_wanted = bool(std::getline(b, is));
    if (!more_there || !more_wanted || was != is) {
      return fmt::format("it has '{}' where this one has '{}'", more_there ? was : "nothing",
                         more_wanted ? is : "nothing");
    }
  }
}

fs::path shard_folder(const fs::path& sweep, std::size_t shard) {
  return sweep / "shards" / fmt::format("{:04}", shard);
}

/// Returns "3, 5 to 9, 12".
std::string ranges_of(const std::vector<std::size_t>& rising) {
  std::string text;
  for (std::size_t i = 0; i < rising.size();) {
    std::size_t last = i;
    while (last + 1 < rising.size() && rising[last + 1] == rising[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", rising[i]);
    if (last > i) text += fmt::format("{}{}", last == i + 1 ? ", " : " to ", rising[last]);
    i = last + 1;
  }
  return text;
}

}  // namespace

SweepFolder::SweepFolder(fs::path folder, const config::Robot& robot, const config::Map& map, const Plan& plan)
    : folder_(std::move(folder)), shards_(plan.shards.size()) {
  const fs::path file = folder_ / "plan.yaml";
  std::error_code error;
  fs::create_directories(folder_ / "shards", error);
  if (error) throw config::FileError("cannot make {}: {}", (folder_ / "shards").string(), error.message());
  const std::string wanted = plan_text(robot, map, plan);
  if (fs::exists(file, error)) {
    const std::string there = config::read_text(file);
    if (there == wanted) return;
    throw config::FileError("{} belongs to another sweep: {}. Give another --out, or remove that folder", file.string(),
                            first_difference(there, wanted));
  }
  // The tasks of a job array begin at the same time. Each one writes the same text through its own temporary file.
  const fs::path coming = folder_ / fmt::format("plan-{}.yaml", ::getpid());
  runlog::write_whole(coming, wanted);
  fs::rename(coming, file, error);
  if (error) throw runlog::DiskError("cannot make {}: {}", file.string(), error.message());
}

bool SweepFolder::has(std::size_t shard) const {
  std::error_code error;
  return fs::is_directory(shard_folder(folder_, shard), error);
}

std::vector<std::size_t> SweepFolder::missing() const {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < shards_; ++i) {
    if (!has(i)) missing.push_back(i);
  }
  return missing;
}

void SweepFolder::add(std::size_t shard, const ShardRecord& record) const {
  const fs::path folder = shard_folder(folder_, shard);
  // The name belongs to this process, because another one may be running the same shard.
  const fs::path coming = folder_ / "shards" / fmt::format("coming-{:04}-{}", shard, ::getpid());
  std::error_code error;
  fs::remove_all(coming, error);
  fs::create_directories(coming, error);
  if (error) throw runlog::DiskError("cannot make {}: {}", coming.string(), error.message());
  write(coming, record);
  fs::rename(coming, folder, error);
  if (!error) return;
  const std::string why = error.message();
  fs::remove_all(coming, error);
  if (!has(shard)) throw runlog::DiskError("cannot make {}: {}", folder.string(), why);
}

ShardRecord SweepFolder::read_all() const {
  if (const auto gaps = missing(); !gaps.empty()) {
    throw config::FileError("{} of {} shards are missing in {}: {}", gaps.size(), shards_, folder_.string(),
                            ranges_of(gaps));
  }
  ShardRecord all;
  for (std::size_t i = 0; i < shards_; ++i) read(shard_folder(folder_, i), all);
  return all;
}

}  // namespace twocone::tradeoff
