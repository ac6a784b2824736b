// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/stored_runs.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::viewer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kDeepest = 3;           // folders below a path that are searched
constexpr std::size_t kMostOpen = 4;  // runs in memory

bool is_run(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / "run.yaml", ignored);
}

// NOLINTNEXTLINE(misc-no-recursion): at most kDeepest calls deep.
void add_runs(const fs::path& folder, int depth, std::vector<fs::path>& runs) {
  if (is_run(folder)) {
    runs.push_back(folder);
    return;
  }
  if (depth == 0) return;
  std::error_code failed;
  for (auto entry = fs::directory_iterator(folder, failed); !failed && entry != fs::directory_iterator();
       entry.increment(failed)) {
    std::error_code ignored;
    if (entry->is_directory(ignored) && !entry->is_symlink(ignored)) add_runs(entry->path(), depth - 1, runs);
  }
}

std::optional<std::size_t> number_of(const web::Query& query, const char* key) {
  const auto value = query.find(key);
  std::size_t number = 0;
  if (value == query.end() || !runlog::parse_field(value->second, number)) return std::nullopt;
  return number;
}

/// Returns the frames of which a run has a point cloud, in rising order.
Json clouds_of(const fs::path& folder) {
  std::vector<std::size_t> frames;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(runlog::cloud_file(folder, 0).parent_path(), none)) {
    std::size_t frame = 0;
    const fs::path& file = entry.path();
    if (file.extension() == ".ply" && runlog::parse_field(file.stem().string(), frame)) frames.push_back(frame);
  }
  std::ranges::sort(frames);
  return frames;
}

/// Returns the most important results of a run. What its summary does not have is left out.
Json results_of(const fs::path& folder) {
  Json row{{"name", folder.filename().string()}};
  const runlog::RunYaml run = runlog::read_run_yaml(folder);
  const std::string table = config::read_text(folder / "frames.csv");
  const auto lines = std::count(table.begin(), table.end(), '\n');
  const auto frames = std::max<std::ptrdiff_t>(lines - 1, 0);  // the first line names the columns
  row.update({{"robot", run.robot.name},
              {"behaviour", run.info.behaviour},
              {"method", run.info.method},
              {"seed", run.info.seed},
              {"frames", frames},
              {"finished", run.info.finished}});
  std::ifstream file(folder / "summary.json");
  const Json summary = Json::parse(file, nullptr, false);
  if (!summary.is_object()) return row;
  const auto take = [&](const char* name, const char* pointer) {
    const Json::json_pointer at(pointer);
    if (summary.contains(at)) row[name] = summary.at(at);
  };
  if (const Json::json_pointer at("/fix/frames_with_fix"); frames > 0 && summary.contains(at)) {
    row["fixes_share"] = summary.at(at).get<double>() / double(frames);
  }
  take("mean_error_m", "/fix/position_error/mean_m");
  take("p95_error_m", "/fix/position_error/p95_m");
  take("max_error_m", "/fix/position_error/max_m");
  take("coverage_95", "/fix/position_in_95_percent_ellipse/share");
  take("track_mean_error_m", "/estimate/position_error/mean_m");
  return row;
}

}  // namespace

std::vector<fs::path> find_runs(const std::vector<fs::path>& paths) {
  std::vector<fs::path> runs;
  for (const fs::path& path : paths) {
    if (!fs::exists(path)) throw config::FileError("{}: no such folder", path.string());
    const std::size_t before = runs.size();
    add_runs(path, kDeepest, runs);
    if (runs.size() == before) {
      throw config::FileError("{}: no run here, and none in the folders below it: there is no run.yaml", path.string());
    }
    std::sort(runs.begin() + std::ptrdiff_t(before), runs.end());
  }
  return runs;
}

StoredRuns::StoredRuns(std::vector<fs::path> folders) : folders_(std::move(folders)) {}
StoredRuns::~StoredRuns() = default;

Result<std::string> StoredRuns::open(const PageAddress& at) {
  return serve("view", "twocone: stored runs", "This page shows stored runs.", at, *this, server_);
}

std::string StoredRuns::list() const {
  Json rows = Json::array();
  for (std::size_t i = 0; i < folders_.size(); ++i) {
    Json row{{"run", i}};
    try {
      row.update(results_of(folders_[i]));
    } catch (const std::exception& error) {
      row.update({{"name", folders_[i].filename().string()}, {"error", error.what()}});
    }
    rows.push_back(std::move(row));
  }
  return text_of(rows);
}

const telemetry::StoredRun& StoredRuns::run(std::size_t number) {
  const auto found = std::ranges::find(open_, number, &Open::number);
  if (found != open_.end()) {
    open_.splice(open_.begin(), open_, found);
  } else {
    open_.push_front({number, std::make_unique<telemetry::StoredRun>(folders_[number])});
    if (open_.size() > kMostOpen) open_.pop_back();
  }
  return *open_.front().run;
}

std::optional<web::Answer> StoredRuns::get(std::string_view path, const web::Query& query) {
  if (path == "/runs") return web::Answer{"application/json", list()};
  const auto number = number_of(query, "run");
  if (!number || *number >= folders_.size()) return std::nullopt;
  if (path == "/telemetry") {
    const telemetry::StoredRun& stored = run(*number);
    const std::size_t from = std::min(number_of(query, "from").value_or(0), stored.size());
    const std::size_t count =
        std::min({number_of(query, "count").value_or(kMostFrames), kMostFrames, stored.size() - from});
    Json first = stored.run();
    first["frames_stored"] = stored.size();
    if (const Json clouds = clouds_of(folders_[*number]); !clouds.empty()) first["clouds"] = clouds;
    std::string lines = text_of(first) + '\n';
    for (std::size_t row = from; row < from + count; ++row) {
      lines += text_of(stored.frame(row)) + '\n';
    }
    return web::Answer{"application/x-ndjson", std::move(lines)};
  }
  const auto frame = number_of(query, "frame");
  if (!frame) return std::nullopt;
  if (path == "/cloud")
    return file_of(*number, runlog::cloud_file(folders_[*number], *frame), "application/octet-stream");
  const auto view = query.find("view");
  if (path != "/image" || view == query.end()) return std::nullopt;
  if (view->second != "lower" && view->second != "upper") return std::nullopt;
  return file_of(*number, runlog::camera_image_file(folders_[*number], view->second, *frame), "image/png");
}

std::optional<web::Answer> StoredRuns::file_of(std::size_t number, const fs::path& file, const char* type) const {
  std::error_code missing;
  if (!fs::is_regular_file(file, missing)) return std::nullopt;
  // A run folder of somebody else may hold links to files that are none of it.
  const fs::path folder = fs::canonical(folders_[number]) / file.parent_path().filename();
  if (fs::canonical(file).parent_path() != folder) return std::nullopt;
  return web::Answer{type, config::read_text(file)};
}

}  // namespace twocone::viewer
