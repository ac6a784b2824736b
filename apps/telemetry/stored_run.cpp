// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/estimation/mapping.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"
#include "apps/telemetry/telemetry.h"

namespace twocone::telemetry {
namespace {

using Json = nlohmann::ordered_json;

/// Returns the rows of a frame, from a table in the order of its frames.
template <typename Row>
std::vector<Row> rows_at(const std::vector<Row>& table, std::uint64_t frame) {
  return {std::ranges::lower_bound(table, frame, {}, &Row::frame),
          std::ranges::upper_bound(table, frame, {}, &Row::frame)};
}

template <typename Row>
std::optional<Row> row_at(const std::vector<Row>& table, std::uint64_t frame) {
  const auto row = std::ranges::lower_bound(table, frame, {}, &Row::frame);
  return row != table.end() && row->frame == frame ? std::optional(*row) : std::nullopt;
}

/// Rounds all numbers to nine digits, which are more than any measurement here has. It halves a page.
// NOLINTNEXTLINE(misc-no-recursion): as deep as a line of telemetry.
void shorten(Json& json) {
  if (json.is_number_float()) {
    json = std::stod(fmt::format("{:.9g}", json.get<double>()));
  } else if (json.is_structured()) {
    for (Json& part : json) shorten(part);
  }
}

/// Returns a small copy of an image file; nothing if the file cannot be read.
std::optional<std::string> small_image(const std::filesystem::path& file) {
  constexpr int kWidth_px = 320;
  constexpr int kQuality = 40;
  const auto image = runlog::read_rgb(file);
  if (!image) return std::nullopt;
  cv::Mat small = *image;
  if (image->cols > kWidth_px) {
    const int height_px = std::max(1, int(std::lround(double(image->rows) * kWidth_px / image->cols)));
    cv::resize(*image, small, {kWidth_px, height_px}, 0, 0, cv::INTER_AREA);
  }
  return runlog::jpeg_uri(estimation::as_image(small), kQuality);
}

}  // namespace

StoredRun::StoredRun(const std::filesystem::path& folder) : own_(runlog::read_run(folder)), run_(&*own_) { index(); }
StoredRun::StoredRun(const runlog::RunData& run) : run_(&run) { index(); }

void StoredRun::index() {
  landmarks_ = runlog::read_table<runlog::LandmarkRow>(run_->folder / "landmarks.csv");
  scans_ = runlog::read_scans(run_->folder / "scan.csv");
  truth_ = runlog::at_frames(*run_, run_->truth);
  odometry_ = runlog::at_frames(*run_, run_->odometry);
  lines_.emplace(run_->robot, run_->info.maps ? estimation::without_landmarks(run_->map) : run_->map);
}

Json StoredRun::run() const {
  std::error_code ignored;
  const Sensors sensors{
      .images = !run_->frames.empty() && std::filesystem::exists(runlog::images_of(*run_, 0)[0], ignored),
      .odometry = runlog::has_odometry(*run_),
      .truth = !run_->truth.empty(),
      .fixes = !run_->info.maps,
      .skew = run_->info.capture.has_value() || run_->info.behaviour == runlog::kImported};
  return lines_->run(run_->folder.filename().string(), run_->info, sensors);
}

runlog::FrameRecord StoredRun::record(std::size_t row) const {
  runlog::FrameRecord record;
  record.frame = run_->frames[row];
  const std::uint64_t frame = record.frame.frame;
  if (row < run_->drive.size()) record.drive = run_->drive[row];
  record.truth = truth_[row];
  record.odometry = odometry_[row].value_or(runlog::PoseRow{});
  record.answer.ranges = rows_at(run_->ranges, frame);
  record.answer.fixes = rows_at(run_->fixes, frame);
  record.answer.sightings = rows_at(run_->sightings, frame);
  record.answer.landmarks = rows_at(landmarks_, frame);
  record.answer.timing = row_at(run_->timing, frame);
  record.answer.track = row_at(run_->track, frame);
  if (const auto scan = scans_.find(frame); scan != scans_.end()) record.scan = scan->second;
  return record;
}

Json StoredRun::frame(std::size_t row) const {
  Json json = lines_->frame(record(row));
  if (!runlog::has_odometry(*run_)) {
    json.erase("drive");
    json.erase("odometry");
  }
  return json;
}

Json embedded(const StoredRun& run) {
  const std::size_t every =
      run.size() <= kMostFrames ? 1 : std::max<std::size_t>(2, (run.size() + kMostOfLongRun - 1) / kMostOfLongRun);
  Json frames = Json::array(), images = Json::object();
  for (std::size_t row = 0; row < run.size(); row += every) {
    shorten(frames.emplace_back(run.frame(row)));
    const auto files = runlog::images_of(run.data(), row);
    Json pair = Json::object();
    if (auto lower = small_image(files[0])) pair["lower"] = *std::move(lower);
    if (auto upper = small_image(files[1])) pair["upper"] = *std::move(upper);
    if (!pair.empty()) images[std::to_string(run.data().frames[row].frame)] = std::move(pair);
  }
  return {{"run", run.run()}, {"every", every}, {"frames", std::move(frames)}, {"images", std::move(images)}};
}

}  // namespace twocone::telemetry
