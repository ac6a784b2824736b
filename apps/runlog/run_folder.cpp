// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/run_folder.h"

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "apps/runlog/tables/truth_files.h"
#include "base/errors.h"

namespace twocone::runlog {
namespace {

constexpr const char* kSummary = "summary.json";

template <typename Row>
LineFile table(const std::filesystem::path& file, OldLines old) {
  LineFile lines(file, old);
  lines.add(TableReader<Row>::header());
  return lines;
}

/// Summarises the tables in `stage`.
void add_summary(const std::filesystem::path& run, const std::filesystem::path& stage, const std::string& method,
                 const RunInfo* info) {
  if (info == nullptr) return;
  write_whole(stage / kSummary, to_json(summarise(read_run_with(run, stage, method)), *info));
}

}  // namespace

AnswerTables::AnswerTables(const std::filesystem::path& folder, OldLines old)
    : folder_(folder),
      old_(old),
      ranges_(table<RangeRow>(folder / "ranges.csv", old)),
      fixes_(table<FixRow>(folder / "fixes.csv", old)),
      timing_(table<TimingRow>(folder / "timing.csv", old)),
      estimate_(folder / "estimate.tum", old),
      track_(table<TrackRow>(folder / "track.csv", old)) {}

void AnswerTables::add(const AnswerRows& rows) {
  for (const RangeRow& row : rows.ranges) ranges_.add(to_line(row));
  for (const FixRow& row : rows.fixes) fixes_.add(to_line(row));
  if (!rows.sightings.empty() && !sightings_) sightings_ = table<SightingRow>(folder_ / "sightings.csv", old_);
  for (const SightingRow& row : rows.sightings) sightings_->add(to_line(row));
  if (!rows.landmarks.empty() && !landmarks_) landmarks_ = table<LandmarkRow>(folder_ / "landmarks.csv", old_);
  for (const LandmarkRow& row : rows.landmarks) landmarks_->add(to_line(row));
  if (rows.timing) timing_.add(to_line(*rows.timing), Equal::kNot);
  if (!rows.track) return;
  track_.add(to_line(*rows.track));
  if (const auto pose = pose_of(*rows.track)) estimate_.add(to_line(*pose));
}

RunFolder::RunFolder(const std::filesystem::path& folder, OldLines old)
    : folder_(folder),
      old_(old),
      new_(folder, old),
      frames_(table<FrameRow>(folder / "frames.csv", old)),
      drive_(table<DriveRow>(folder / "drive.csv", old)),
      truth_(folder / "truth.tum", old),
      odometry_(folder / "odometry.tum", old),
      answers_(folder, old) {}

void RunFolder::store(const std::filesystem::path& file, const Image& image) const {
  if (old_ == OldLines::kKeep) {
    const auto stored = read_image(file);
    const auto rgb = to_rgb8(image);
    if (stored && rgb && *stored == *rgb) return;
  }
  write_image(file, image);
}

void RunFolder::add(const FrameRecord& record, const Image& lower, const Image& upper,
                    const std::vector<OtherImage>& others, const std::vector<CameraTruth>& truth) {
  store(lower_image_file(folder_, record.frame.frame), lower);
  store(upper_image_file(folder_, record.frame.frame), upper);
  for (const OtherImage& other : others) {
    const auto file = camera_image_file(folder_, other.camera, record.frame.frame);
    make_folder(file.parent_path());
    store(file, *other.image);
  }
  for (const CameraTruth& of : truth) write_truth(folder_, of.camera, record.frame.frame, of.pixels);
  drive_.add(to_line(record.drive));
  answers_.add(record.answer);
  if (record.truth) truth_.add(to_line(*record.truth));
  if (!record.scan.empty() && !scans_) scans_ = table<ScanRow>(folder_ / "scan.csv", old_);
  for (const ScanRow& row : to_rows(record.frame.frame, record.frame.t_s, record.scan)) scans_->add(to_line(row));
  odometry_.add(to_line(record.odometry));
  frames_.add(to_line(record.frame), Equal::kButLastField);  // the last field is from the machine's clock
  new_.keep();
}

void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<AnswerRows>& answers, OnTop on_top, const RunInfo* info) {
  ResultsExchange exchange(folder, method);
  AnswerTables tables(exchange.stage());
  for (const AnswerRows& answer : answers) tables.add(answer);
  add_summary(folder, exchange.stage(), method, info);
  exchange.commit(on_top);
}

void file_results(const std::filesystem::path& folder, const std::string& method, const RunInfo* info) {
  ResultsExchange exchange(folder, method);
  for (const char* const name : kResultFiles) {
    if (std::string_view(name) == kSummary || !std::filesystem::exists(folder / name)) continue;
    write_whole(exchange.stage() / name, config::read_text(folder / name));
  }
  add_summary(folder, exchange.stage(), method, info);
  exchange.commit(OnTop::kYes);
}

void write_summary(const RunData& run) {
  const std::string json = to_json(summarise(run), run.info);
  make_folder(run.folder / "methods" / run.method);
  write_whole(run.folder / "methods" / run.method / kSummary, json);
  write_whole(run.folder / kSummary, json);
}

StoredImages::StoredImages(std::filesystem::path folder, bool with_truth)
    : folder_(std::move(folder)), with_truth_(with_truth) {
  TableReader<FrameRow> rows(folder_ / "frames.csv");
  while (const auto row = rows.next()) {
    frame_of_[{"lower", row->lower_sequence}] = row->frame;
    frame_of_[{"upper", row->upper_sequence}] = row->frame;
    last_host_t_s_ = row->host_t_s.value_or(0);
    ++frames_;
  }
}

std::shared_ptr<const Image> StoredImages::operator()(const std::string& camera, std::uint64_t sequence) const {
  const auto frame = frame_of_.find({camera, sequence});
  if (frame == frame_of_.end()) return nullptr;
  if (with_truth_ && !has_truth(folder_, camera, frame->second)) return nullptr;
  auto image = read_image(camera_image_file(folder_, camera, frame->second));
  return image ? std::make_shared<const Image>(*std::move(image)) : nullptr;
}

}  // namespace twocone::runlog
