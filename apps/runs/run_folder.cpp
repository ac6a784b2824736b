// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run_folder.h"

#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/files/text_file.h"
#include "apps/runs/tables.h"

namespace twocone::runs {
namespace {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw DiskError(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
}

void remove_file(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) throw DiskError(fmt::format("cannot remove {}: {}", file.string(), error.message()));
}

std::filesystem::path prepare(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "run.yaml") || std::filesystem::exists(folder / "frames.csv")) {
    throw DiskError(fmt::format("{} holds a run already: choose another --out, or remove it first", folder.string()));
  }
  make_folder(folder / "lower");
  make_folder(folder / "upper");
  return folder;
}

LineFile table(const std::filesystem::path& file, const std::string& header) {
  LineFile lines(file);
  lines.add(header);
  return lines;
}

std::string text_of(const std::string& header, const std::vector<std::string>& lines) {
  std::string text = header.empty() ? "" : header + '\n';
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

}  // namespace

RunFolder::RunFolder(const std::filesystem::path& folder)
    : folder_(prepare(folder)),
      frames_(table(folder / "frames.csv", frames_header())),
      drive_(table(folder / "drive.csv", drive_header())),
      ranges_(table(folder / "ranges.csv", ranges_header())),
      fixes_(table(folder / "fixes.csv", fixes_header())),
      effort_(table(folder / "effort.csv", effort_header())),
      truth_(folder / "truth.tum"),
      odometry_(folder / "odometry.tum"),
      estimate_(folder / "estimate.tum"),
      track_(table(folder / "track.csv", track_header())) {}

void RunFolder::add(const FrameRecord& record, const Image& lower, const Image& upper,
                    const std::vector<OtherPicture>& others) {
  write_picture(lower_picture(folder_, record.frame.frame), lower);
  write_picture(upper_picture(folder_, record.frame.frame), upper);
  for (const OtherPicture& other : others) {
    const auto file = camera_picture(folder_, other.camera, record.frame.frame);
    make_folder(file.parent_path());
    write_picture(file, *other.image);
  }
  drive_.add(to_line(record.drive));
  for (const RangeRow& row : record.answer.ranges) ranges_.add(to_line(row));
  for (const FixRow& row : record.answer.fixes) fixes_.add(to_line(row));
  if (!record.answer.sightings.empty() && !sightings_) {
    sightings_.emplace(table(folder_ / "sightings.csv", sightings_header()));
  }
  for (const SightingRow& row : record.answer.sightings) sightings_->add(to_line(row));
  if (record.answer.effort) effort_.add(to_line(*record.answer.effort));
  if (record.truth) truth_.add(to_line(*record.truth));
  odometry_.add(to_line(record.odometry));
  if (record.answer.track) {
    track_.add(to_line(*record.answer.track));
    if (const auto pose = pose_of(*record.answer.track)) estimate_.add(to_line(*pose));
  }
  frames_.add(to_line(record.frame));
}

void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<AnswerRows>& answers, OnTop on_top) {
  std::vector<std::string> ranges;
  std::vector<std::string> fixes;
  std::vector<std::string> sightings;
  std::vector<std::string> effort;
  std::vector<std::string> estimate;
  std::vector<std::string> track;
  for (const AnswerRows& answer : answers) {
    for (const RangeRow& row : answer.ranges) ranges.push_back(to_line(row));
    for (const FixRow& row : answer.fixes) fixes.push_back(to_line(row));
    for (const SightingRow& row : answer.sightings) sightings.push_back(to_line(row));
    if (answer.effort) effort.push_back(to_line(*answer.effort));
    if (!answer.track) continue;
    track.push_back(to_line(*answer.track));
    if (const auto pose = pose_of(*answer.track)) estimate.push_back(to_line(*pose));
  }
  make_folder(folder / "methods" / method);
  std::vector<std::filesystem::path> places{folder / "methods" / method};
  if (on_top == OnTop::kYes) places.push_back(folder);
  for (const auto& place : places) {
    write_whole(place / "ranges.csv", text_of(ranges_header(), ranges));
    write_whole(place / "fixes.csv", text_of(fixes_header(), fixes));
    write_whole(place / "effort.csv", text_of(effort_header(), effort));
    write_whole(place / "estimate.tum", text_of("", estimate));
    write_whole(place / "track.csv", text_of(track_header(), track));
    if (sightings.empty()) {
      remove_file(place / "sightings.csv");  // another method's, which this one's ranges do not rest on
    } else {
      write_whole(place / "sightings.csv", text_of(sightings_header(), sightings));
    }
  }
}

void file_results(const std::filesystem::path& folder, const std::string& method) {
  make_folder(folder / "methods" / method);
  for (const char* name : {"ranges.csv", "fixes.csv", "effort.csv", "estimate.tum", "track.csv"}) {
    write_whole(folder / "methods" / method / name, files::read_text(folder / name));
  }
  if (std::filesystem::exists(folder / "sightings.csv")) {
    write_whole(folder / "methods" / method / "sightings.csv", files::read_text(folder / "sightings.csv"));
  }
}

void write_summary(const std::filesystem::path& folder, const std::string& method, const std::string& json,
                   OnTop on_top) {
  make_folder(folder / "methods" / method);
  write_whole(folder / "methods" / method / "summary.json", json);
  if (on_top == OnTop::kYes) write_whole(folder / "summary.json", json);
}

Result<Image> read_picture(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return Error{ErrorCode::kNotFound, fmt::format("no picture {}", file.string())};
  cv::Mat bgr = cv::imread(file.string(), cv::IMREAD_COLOR);
  if (bgr.empty())
    return Error{ErrorCode::kBadData, fmt::format("{} is not a picture that can be read", file.string())};
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  Image image{rgb.cols, rgb.rows, PixelFormat::kRgb8, {}};
  image.bytes.assign(rgb.datastart, rgb.dataend);
  return image;
}

void write_picture(const std::filesystem::path& file, const Image& image) {
  const bool is_grey = image.format == PixelFormat::kGrey8;
  const auto rgb = is_grey ? Result<Image>(image) : to_rgb8(image);
  if (!rgb) throw std::runtime_error(fmt::format("{}: {}", file.string(), rgb.error().message));
  const cv::Mat pixels(rgb->height_px, rgb->width_px, is_grey ? CV_8UC1 : CV_8UC3,
                       const_cast<std::uint8_t*>(rgb->bytes.data()));
  cv::Mat bgr;  // or grey: what imencode() takes
  if (is_grey) {
    bgr = pixels;
  } else {
    cv::cvtColor(pixels, bgr, cv::COLOR_RGB2BGR);
  }
  std::vector<std::uint8_t> png;
  // The fastest compression: a run writes 30 of these a second of its own time, and they shrink by half all the same.
  cv::imencode(".png", bgr, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
  write_whole(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace twocone::runs
