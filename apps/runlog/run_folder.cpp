// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/run_folder.h"

#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::runlog {
namespace {

constexpr const char* kSummary = "summary.json";

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw DiskError(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
}

LineFile table(const std::filesystem::path& file, const std::string& header, OldLines old) {
  LineFile lines(file, old);
  lines.add(header);
  return lines;
}

std::string text_of(const std::string& header, const std::vector<std::string>& lines) {
  std::string text = header.empty() ? "" : header + '\n';
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

}  // namespace

RunFolder::RunFolder(const std::filesystem::path& folder, OldLines old)
    : folder_(folder),
      old_(old),
      new_(folder, old),
      frames_(table(folder / "frames.csv", frames_header(), old)),
      drive_(table(folder / "drive.csv", drive_header(), old)),
      ranges_(table(folder / "ranges.csv", ranges_header(), old)),
      fixes_(table(folder / "fixes.csv", fixes_header(), old)),
      timing_(table(folder / "timing.csv", timing_header(), old)),
      truth_(folder / "truth.tum", old),
      odometry_(folder / "odometry.tum", old),
      estimate_(folder / "estimate.tum", old),
      track_(table(folder / "track.csv", track_header(), old)) {}

void RunFolder::store(const std::filesystem::path& file, const Image& image) const {
  if (old_ == OldLines::kKeep) {
    const auto stored = read_image(file);
    const auto rgb = to_rgb8(image);
    if (stored && rgb && *stored == *rgb) return;
  }
  write_image(file, image);
}

void RunFolder::add(const FrameRecord& record, const Image& lower, const Image& upper,
                    const std::vector<OtherImage>& others) {
  store(lower_image_file(folder_, record.frame.frame), lower);
  store(upper_image_file(folder_, record.frame.frame), upper);
  for (const OtherImage& other : others) {
    const auto file = camera_image_file(folder_, other.camera, record.frame.frame);
    make_folder(file.parent_path());
    store(file, *other.image);
  }
  drive_.add(to_line(record.drive));
  for (const RangeRow& row : record.answer.ranges) ranges_.add(to_line(row));
  for (const FixRow& row : record.answer.fixes) fixes_.add(to_line(row));
  if (!record.answer.sightings.empty() && !sightings_) {
    sightings_.emplace(table(folder_ / "sightings.csv", sightings_header(), old_));
  }
  for (const SightingRow& row : record.answer.sightings) sightings_->add(to_line(row));
  if (record.answer.timing) timing_.add(to_line(*record.answer.timing), Equal::kNot);
  if (record.truth) truth_.add(to_line(*record.truth));
  odometry_.add(to_line(record.odometry));
  if (record.answer.track) {
    track_.add(to_line(*record.answer.track));
    if (const auto pose = pose_of(*record.answer.track)) estimate_.add(to_line(*pose));
  }
  frames_.add(to_line(record.frame), Equal::kButLastField);  // the last field is from the machine's clock
  new_.keep();
}

void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<runlog::AnswerRows>& answers, OnTop on_top, const SummaryOf& summary) {
  std::vector<std::string> ranges;
  std::vector<std::string> fixes;
  std::vector<std::string> sightings;
  std::vector<std::string> timing;
  std::vector<std::string> estimate;
  std::vector<std::string> track;
  for (const runlog::AnswerRows& answer : answers) {
    for (const RangeRow& row : answer.ranges) ranges.push_back(to_line(row));
    for (const FixRow& row : answer.fixes) fixes.push_back(to_line(row));
    for (const SightingRow& row : answer.sightings) sightings.push_back(to_line(row));
    if (answer.timing) timing.push_back(to_line(*answer.timing));
    if (!answer.track) continue;
    track.push_back(to_line(*answer.track));
    if (const auto pose = pose_of(*answer.track)) estimate.push_back(to_line(*pose));
  }
  ResultsExchange exchange(folder, method);
  const std::filesystem::path& stage = exchange.stage();
  write_whole(stage / "ranges.csv", text_of(ranges_header(), ranges));
  write_whole(stage / "fixes.csv", text_of(fixes_header(), fixes));
  write_whole(stage / "timing.csv", text_of(timing_header(), timing));
  write_whole(stage / "estimate.tum", text_of("", estimate));
  write_whole(stage / "track.csv", text_of(track_header(), track));
  if (!sightings.empty()) write_whole(stage / "sightings.csv", text_of(sightings_header(), sightings));
  if (summary) write_whole(stage / kSummary, summary(stage));
  exchange.commit(on_top);
}

void file_results(const std::filesystem::path& folder, const std::string& method, const SummaryOf& summary) {
  ResultsExchange exchange(folder, method);
  for (const char* const name : kResultFiles) {
    if (std::string_view(name) == kSummary || !std::filesystem::exists(folder / name)) continue;
    write_whole(exchange.stage() / name, config::read_text(folder / name));
  }
  if (summary) write_whole(exchange.stage() / kSummary, summary(exchange.stage()));
  exchange.commit(OnTop::kYes);
}

void write_summary(const std::filesystem::path& folder, const std::string& method, const std::string& json,
                   OnTop on_top) {
  make_folder(folder / "methods" / method);
  write_whole(folder / "methods" / method / kSummary, json);
  if (on_top == OnTop::kYes) write_whole(folder / kSummary, json);
}

Result<Image> read_image(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return Error{ErrorCode::kNotFound, fmt::format("no image {}", file.string())};
  cv::Mat bgr = cv::imread(file.string(), cv::IMREAD_COLOR);
  if (bgr.empty()) return Error{ErrorCode::kBadData, fmt::format("{} is not an image that can be read", file.string())};
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  Image image{rgb.cols, rgb.rows, PixelFormat::kRgb8, {}};
  image.bytes.assign(rgb.datastart, rgb.dataend);
  return image;
}

void write_image(const std::filesystem::path& file, const Image& image) {
  const bool is_grey = image.format == PixelFormat::kGrey8;
  const auto rgb = is_grey ? Result<Image>(image) : to_rgb8(image);
  if (!rgb) throw std::runtime_error(fmt::format("{}: {}", file.string(), rgb.error().message));
  cv::Mat bgr;  // or grey, in the form for imencode()
  if (is_grey) {
    bgr = estimation::as_mat(*rgb);
  } else {
    cv::cvtColor(estimation::as_mat(*rgb), bgr, cv::COLOR_RGB2BGR);
  }
  std::vector<std::uint8_t> png;
  // The fastest compression is used, because a run writes 30 images per second of its time. It still halves their size.
  cv::imencode(".png", bgr, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
  write_whole(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace twocone::runlog
