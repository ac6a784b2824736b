// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/report/data.h"
#include "apps/report/kit/overhead.h"
#include "apps/runlog/storage/disk.h"
#include "apps/telemetry/telemetry.h"
#include "apps/web/document.h"

namespace twocone::report {
namespace {

void check(const runlog::RunData& run, const ReportSettings& settings) {
  std::string bad;
  for (const auto& [name, value] : {std::pair{"error_budget_draws", settings.error_budget_draws},
                                    {"error_budget_pose_step", settings.error_budget_pose_step}}) {
    if (value < 1) bad += fmt::format("\n  {} is {}, must be >= 1", name, value);
  }
  std::error_code ignored;
  if (!std::filesystem::is_directory(run.folder, ignored)) {
    bad += fmt::format("\n  folder is '{}', must be a run's folder", run.folder.string());
  }
  if (!bad.empty()) throw std::invalid_argument("write_report:" + bad);
}

}  // namespace

// Its keys are those of run_json(), those of telemetry::embedded(), and `error_budget`, `disparity`, `panoramas`,
// `overhead` (an image of the arena from above, which covers the map's bounds) and `notes`.
nlohmann::ordered_json report_json(const runlog::RunData& run, const ReportSettings& settings) {
  check(run, settings);
  settings.progress(0);
  std::vector<std::string> notes;
  const runlog::Summary summary = runlog::summarise(run);
  nlohmann::ordered_json json{{"page", "report"}};
  json.update(run_json(run, summary, baseline_of(run, notes)));
  settings.progress(0.1);
  if (auto overhead = overhead_uri(run.folder / "figures", run.map, "Figure 7 is", notes)) {
    json["overhead"] = *std::move(overhead);
  }
  if (run.truth.empty()) {
    notes.emplace_back("There is no ground truth, so there is no figure of the position error.");
  }
  settings.progress(0.4);
  json["error_budget"] =
      error_budget_json(error_budget_of(run, settings.error_budget_draws, settings.error_budget_pose_step));
  settings.progress(0.5);
  json["disparity"] = disparity_json(run, notes);
  json["panoramas"] = panoramas_json(run);
  settings.progress(0.6);
  json.update(telemetry::embedded(telemetry::StoredRun(run)));
  json["notes"] = notes;
  settings.progress(0.95);
  return json;
}

Result<ReportResult> write_report(const runlog::RunData& run, const ReportSettings& settings) {
  const nlohmann::ordered_json json = report_json(run, settings);
  ReportResult result{run.folder / "report.html", json["notes"]};
  std::vector<std::string> said;  // the notes are on the page
  try {
    runlog::write_whole(result.html, web::document(json, std::string(json["title"]), table_of(run, said)));
  } catch (const runlog::DiskError& error) {
    return Error{ErrorCode::kUnavailable, error.what()};
  }
  settings.progress(1);
  return result;
}

}  // namespace twocone::report
