// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/sweep_folder.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <system_error>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/old_names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/tables/csv_fields.h"
#include "apps/runlog/version.h"

namespace twocone::tradeoff {
namespace {

namespace fs = std::filesystem;

// ---- rows

template <typename Row>
struct Columns;
template <>
struct Columns<FrameRow> {
  static constexpr const char* file = "frames.csv";
  static constexpr const char* header =
      "setting,episode,step,verdict,error_m,heading_error_rad,in_ellipse,bound_m,vision_s,localisation_s";
  static auto of(auto& r) {
    return std::tie(r.setting, r.episode, r.step, r.verdict, r.error_m, r.heading_error_rad, r.in_ellipse, r.bound_m,
                    r.vision_s, r.localisation_s);
  }
};
template <>
struct Columns<RangeRow> {
  static constexpr const char* file = "ranges.csv";
  static constexpr const char* header = "setting,episode,step,error_m";
  static auto of(auto& r) { return std::tie(r.setting, r.episode, r.step, r.error_m); }
};
template <>
struct Columns<RenderRow> {
  static constexpr const char* file = "renders.csv";
  static constexpr const char* header = "setting,episode,step,cpu_s";
  static auto of(auto& r) { return std::tie(r.setting, r.episode, r.step, r.cpu_s); }
};
template <>
struct Columns<MemoryRow> {
  static constexpr const char* file = "memory.csv";
  static constexpr const char* header = "setting,peak_bytes";
  static auto of(auto& r) { return std::tie(r.setting, r.peak_bytes); }
};
template <>
struct Columns<RenderMemoryRow> {
  static constexpr const char* file = "render_memory.csv";
  static constexpr const char* header = "setting,peak_bytes";
  static auto of(auto& r) { return std::tie(r.setting, r.peak_bytes); }
};

template <typename Row>
void write(const fs::path& folder, const std::vector<Row>& rows) {
  std::string text = std::string(Columns<Row>::header) + '\n';
  for (const Row& row : rows) text += runlog::join_fields(Columns<Row>::of(row)) + '\n';
  runlog::write_whole(folder / Columns<Row>::file, text);
}

template <typename Row>
void read(const fs::path& folder, std::vector<Row>& rows) {
  const fs::path file = folder / Columns<Row>::file;
  std::istringstream lines(config::read_text(file));
  std::string line;
  const auto refuse = [&](int number, const std::string& why) {
    throw config::FileError(
        fmt::format("{}:{}: {}; remove {} and the shard is made again", file.string(), number, why, folder.string()));
  };
  if (!std::getline(lines, line) || config::present_columns(line) != Columns<Row>::header) {
    refuse(1, fmt::format("the first line must be {}", Columns<Row>::header));
  }
  for (int number = 2; std::getline(lines, line); ++number) {
    Row& row = rows.emplace_back();
    const std::vector<std::string> fields = runlog::split_fields(line);
    const auto take_all = [&](auto&... value) {
      std::size_t at = 0;
      return fields.size() == sizeof...(value) && (runlog::parse_field(fields[at++], value) && ...);
    };
    const bool is_row = std::apply(take_all, Columns<Row>::of(row));
    if (!is_row) refuse(number, fmt::format("'{}' is not a row of {}", line, Columns<Row>::header));
  }
}

// ---- the plan's file

/// Returns everything that a shard's results depend on. The map's scene is included; files that the scene includes are
/// only named in it.
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
  put("robot", config::load_robot_node(robot.file));
  put("map", config::load_map_node(map.file));
  if (map.scene) put("scene", config::read_text(*map.scene));
  out << YAML::EndMap;
  return std::string(out.c_str()) + '\n';
}

/// Returns the first line in which two texts differ.
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

}  // namespace

SweepFolder::SweepFolder(fs::path folder, const config::Robot& robot, const config::Map& map, const Plan& plan)
    : folder_(std::move(folder)), shards_(plan.shards.size()) {
  const fs::path file = folder_ / "plan.yaml";
  std::error_code error;
  fs::create_directories(folder_ / "shards", error);
  if (error) throw config::FileError(fmt::format("cannot make {}: {}", (folder_ / "shards").string(), error.message()));
  const std::string wanted = plan_text(robot, map, plan);
  if (fs::exists(file, error)) {
    const std::string there = config::read_text(file);
    if (there == wanted) return;
    throw config::FileError(fmt::format("{} belongs to another sweep: {}. Give another --out, or remove that folder",
                                        file.string(), first_difference(there, wanted)));
  }
  // Array tasks begin at the same time. Each writes the same text, through its own temporary file.
  const fs::path coming = folder_ / fmt::format("plan-{}.yaml", ::getpid());
  runlog::write_whole(coming, wanted);
  fs::rename(coming, file, error);
  if (error) throw runlog::DiskError(fmt::format("cannot make {}: {}", file.string(), error.message()));
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
  if (error) throw runlog::DiskError(fmt::format("cannot make {}: {}", coming.string(), error.message()));
  write(coming, record.frames);
  write(coming, record.ranges);
  write(coming, record.renders);
  write(coming, record.memory);
  write(coming, record.render_memory);
  fs::rename(coming, folder, error);
  if (!error) return;
  const std::string why = error.message();
  fs::remove_all(coming, error);
  if (!has(shard)) throw runlog::DiskError(fmt::format("cannot make {}: {}", folder.string(), why));
}

ShardRecord SweepFolder::read_all() const {
  if (const auto gaps = missing(); !gaps.empty()) {
    throw config::FileError(fmt::format("{}: {} of {} shards are missing: {}", folder_.string(), gaps.size(), shards_,
                                        fmt::join(gaps, ", ")));
  }
  ShardRecord all;
  for (std::size_t i = 0; i < shards_; ++i) {
    const fs::path folder = shard_folder(folder_, i);
    read(folder, all.frames);
    read(folder, all.ranges);
    read(folder, all.renders);
    read(folder, all.memory);
    read(folder, all.render_memory);
  }
  return all;
}

}  // namespace twocone::tradeoff
