// SPDX-License-Identifier: Apache-2.0
#include "apps/import/import_run.h"

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/method.h"
#include "apps/import/images.h"
#include "apps/import/motion.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/tables/tables.h"
#include "apps/runlog/version.h"
#include "localisation/odometry.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;

struct Camera {
  ImageList list;
  std::vector<Stamp> times;
  ImageSize size;
};

Camera open_camera(const fs::path& folder, const fs::path& times_file, StampUnit unit,
                   const drivers::CameraPart& entry) {
  Camera camera{list_images(folder, times_file, unit), {}, {entry.settings.width_px, entry.settings.height_px}};
  try {
    check_image(camera.list.images.back().file, camera.size);
  } catch (const UnreadableImage& bad) {
    camera.list.events.push_back(fmt::format("the last image is left out: {}", bad.what()));
    camera.list.images.pop_back();
  }
  if (camera.list.images.empty()) throw config::FileError("{}: no image that can be read", folder.string());
  for (const StampedImage& image : camera.list.images) camera.times.push_back(image.time);
  return camera;
}

double ms(Stamp stamp) { return to_seconds(stamp) * 1e3; }

Stamp skew_limit(const Recording& recording, const Camera& lower, const Camera& upper, const config::Robot& robot) {
  const Stamp nominal(std::llround(1e9 / robot.lower.settings.rate_hz));
  const Stamp period =
      std::min(median_period(lower.times).value_or(nominal), median_period(upper.times).value_or(nominal));
  if (!recording.max_skew_s) return period / 2;
  const double limit_s = *recording.max_skew_s;
  if (!(limit_s > 0) || limit_s > to_seconds(period)) {
    throw config::FileError("--max-skew-ms is {}, must be > 0 and at most the images' period of {:.3f} ms",
                            limit_s * 1e3, ms(period));
  }
  return Stamp(std::llround(limit_s * 1e9));
}

std::string span(Stamp first, Stamp last) {
  return fmt::format("{:.3f} s to {:.3f} s", to_seconds(first), to_seconds(last));
}

std::vector<Pair> find_pairs(const Recording& recording, const Camera& lower, const Camera& upper, Stamp limit) {
  auto pairs = pair_images(lower.times, upper.times, limit);
  if (pairs.empty()) {
    throw config::FileError("no image of {} ({}) is within {:.3f} ms of one of {} ({}): both must be of one clock",
                            recording.lower.string(), span(lower.times.front(), lower.times.back()), ms(limit),
                            recording.upper.string(), span(upper.times.front(), upper.times.back()));
  }
  return pairs;
}

/// Leaves out the pairs that `source` does not cover.
template <typename Source>
void keep_covered(const Source& source, const fs::path& file, const Camera& lower, std::vector<Pair>& pairs,
                  std::vector<std::string>& events) {
  const std::string images = span(lower.times[pairs.front().lower], lower.times[pairs.back().lower]);
  const std::size_t uncovered =
      std::erase_if(pairs, [&](const Pair& pair) { return !source.at(lower.times[pair.lower]).has_value(); });
  const std::string covered = span(source.timeline().first(), source.timeline().last());
  if (pairs.empty()) {
    throw config::FileError("{} covers {}, the images are of {}: both must be of one clock", file.string(), covered,
                            images);
  }
  if (uncovered > 0) {
    events.push_back(
        fmt::format("{} frames are left out because {} ({}) does not cover them", uncovered, file.string(), covered));
  }
}

std::vector<runlog::FrameRow> frame_rows(const std::vector<Pair>& pairs, const Camera& lower, const Camera& upper) {
  std::vector<std::size_t> of_lower;
  std::vector<std::size_t> of_upper;
  for (const Pair& pair : pairs) {
    of_lower.push_back(pair.lower);
    of_upper.push_back(pair.upper);
  }
  const auto lower_lost = lost_before(lower.times, of_lower);
  const auto upper_lost = lost_before(upper.times, of_upper);
  const Stamp zero = lower.times[of_lower.front()];
  std::vector<runlog::FrameRow> rows;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    runlog::FrameRow row;
    row.frame = i;
    row.t_s = row.lower_t_s = to_seconds(lower.times[of_lower[i]] - zero);
    row.upper_t_s = to_seconds(upper.times[of_upper[i]] - zero);
    row.skew_s = to_seconds(upper.times[of_upper[i]] - lower.times[of_lower[i]]);
    row.lower_sequence = of_lower[i];
    row.upper_sequence = of_upper[i];
    row.lower_lost = lower_lost[i];
    row.upper_lost = upper_lost[i];
    rows.push_back(row);
  }
  return rows;
}

void store_images(const std::vector<Pair>& pairs, const Camera& lower, const Camera& upper, const fs::path& out,
                  const std::function<void(double)>& progress) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    try {
      store_image(lower.list.images[pairs[i].lower].file, lower.size, runlog::lower_image_file(out, i));
      store_image(upper.list.images[pairs[i].upper].file, upper.size, runlog::upper_image_file(out, i));
    } catch (const UnreadableImage& bad) {
      throw config::FileError("{}; only the last image of a folder may be so", bad.what());
    }
    progress(double(i + 1) / double(pairs.size()));
  }
}

/// The tables of the wheels, frame by frame; empty if the wheels are unknown.
struct WheelTables {
  std::string drive = runlog::TableReader<runlog::DriveRow>::header() + '\n';
  std::string odometry;
};

WheelTables wheel_tables(const std::optional<WheelFile>& wheels, const std::vector<Pair>& pairs, const Camera& lower,
                         const std::vector<runlog::FrameRow>& frames, const config::Robot& robot) {
  WheelTables tables;
  if (!wheels) return tables;
  localisation::Odometry odometry(config::to_wheels(robot), config::to_start_pose(robot));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto turns = wheels->at(lower.times[pairs[i].lower]);
    runlog::DriveRow row;
    row.t_s = frames[i].t_s;
    row.left_rad = turns->left_rad;
    row.right_rad = turns->right_rad;
    tables.drive += to_line(row) + '\n';
    const localisation::Pose& pose = odometry.update(row.left_rad, row.right_rad);
    tables.odometry += to_line(runlog::PoseRow{row.t_s, pose.x_m, pose.y_m, pose.heading_rad}) + '\n';
  }
  return tables;
}

std::string absolute_text(const fs::path& file) { return fs::absolute(file).lexically_normal().string(); }

std::string described(const char* view, const fs::path& folder, const fs::path& times_file, const Camera& camera,
                      std::size_t pairs) {
  return fmt::format("{}: {} of {} images of {}, times of {}", view, pairs, camera.list.images.size(),
                     absolute_text(folder), times_file.empty() ? "their names" : absolute_text(times_file));
}

/// The folder of an unpacked recording, which is removed at the end.
class UnpackedFolder {
 public:
  explicit UnpackedFolder(fs::path folder) : folder_(std::move(folder)) {
    runlog::remove_whole(folder_);  // of a program that was killed
    runlog::make_folder(folder_);
  }
  ~UnpackedFolder() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  UnpackedFolder(const UnpackedFolder&) = delete;
  UnpackedFolder& operator=(const UnpackedFolder&) = delete;
  /// Absolute.
  [[nodiscard]] const fs::path& path() const { return folder_; }

 private:
  fs::path folder_;
};

/// Returns the words of `twocone import` without --out.
std::vector<std::string> options_of(const Recording& recording) {
  std::vector<std::string> words;
  const auto add = [&words](const char* option, const fs::path& file) {
    if (!file.empty()) words.insert(words.end(), {option, absolute_text(file)});
  };
  add("--robot", recording.robot_file);
  add("--recording", recording.file);
  for (const auto& [option, topic] : {std::pair{"--lower-topic", recording.topics.lower},
                                      {"--upper-topic", recording.topics.upper},
                                      {"--odometry-topic", recording.topics.odometry}}) {
    if (!topic.empty()) words.insert(words.end(), {option, topic});
  }
  add("--lower", recording.lower);
  add("--upper", recording.upper);
  add("--lower-times", recording.lower_times);
  add("--upper-times", recording.upper_times);
  for (const NamedUnit& named : kNamedUnits) {
    if (named.unit == recording.unit) words.insert(words.end(), {"--times-in", named.name});
  }
  add("--trajectory", recording.trajectory);
  add("--odometry", recording.odometry);
  // Twelve digits remove the rounding error of the division by 1000.
  if (recording.max_skew_s) {
    words.insert(words.end(), {"--max-skew-ms", fmt::format("{:.12g}", *recording.max_skew_s * 1e3)});
  }
  return words;
}

void refuse_if_used(const fs::path& out) {
  std::error_code error;
  if (fs::exists(out) && !(fs::is_directory(out) && fs::is_empty(out, error))) {
    const bool is_run = fs::exists(out / "run.yaml");
    throw runlog::DiskError("{} {}: choose another --out, or remove it first", out.string(),
                            is_run ? "holds a run already" : "is not an empty folder");
  }
}

/// Where the files of a recording come from.
struct Origin {
  std::vector<std::string> options;  ///< for run.yaml
  std::vector<std::string> events{};
  fs::path lenses{};  ///< folder that may have VIEW_camera_info.yaml; empty: none
  /// Puts the names that the user knows into a text.
  std::function<std::string(std::string)> named = [](std::string text) { return text; };
};

Imported import_files(const Recording& recording, const Origin& origin, const fs::path& out,
                      const std::function<void(double)>& progress) {
  const config::Robot robot = config::read_robot(recording.robot_file);
  const config::Map map = config::read_map(robot.map);
  config::check_landmarks(robot, map);

  const Camera lower = open_camera(recording.lower, recording.lower_times, recording.unit, robot.lower);
  const Camera upper = open_camera(recording.upper, recording.upper_times, recording.unit, robot.upper);
  const Stamp limit = skew_limit(recording, lower, upper, robot);
  std::vector<Pair> pairs = find_pairs(recording, lower, upper, limit);

  std::vector<std::string> events = origin.events;
  events.push_back(described("lower", recording.lower, recording.lower_times, lower, pairs.size()));
  events.push_back(described("upper", recording.upper, recording.upper_times, upper, pairs.size()));
  for (const Camera* camera : {&lower, &upper}) {
    events.insert(events.end(), camera->list.events.begin(), camera->list.events.end());
  }
  const std::size_t unpaired = lower.times.size() + upper.times.size() - 2 * pairs.size();
  if (unpaired > 0) {
    events.push_back(fmt::format("{} images without a partner within {:.3f} ms are left out", unpaired, ms(limit)));
  }

  std::optional<Trajectory> trajectory;
  if (!recording.trajectory.empty()) {
    trajectory.emplace(recording.trajectory);
    events.push_back(fmt::format("truth.tum is a given trajectory, of {}", absolute_text(recording.trajectory)));
    keep_covered(*trajectory, recording.trajectory, lower, pairs, events);
  }
  std::optional<WheelFile> wheels;
  if (recording.odometry.empty()) {
    events.emplace_back("no odometry was given: drive.csv and odometry.tum are empty");
  } else {
    wheels.emplace(recording.odometry, config::to_wheels(robot));
    events.push_back(fmt::format("the wheels' angles are of {}", absolute_text(recording.odometry)));
    events.insert(events.end(), wheels->events().begin(), wheels->events().end());
    keep_covered(*wheels, recording.odometry, lower, pairs, events);
  }
  const Stamp zero = lower.times[pairs.front().lower];
  events.push_back(fmt::format("t = 0 is {}.{:09} s of the recording's clock", zero.count() / 1'000'000'000,
                               zero.count() % 1'000'000'000));

  runlog::NewFolder folder(out);
  store_images(pairs, lower, upper, out, progress);
  const auto frames = frame_rows(pairs, lower, upper);
  for (const char* view : {"lower", "upper"}) {
    const std::string lens = fmt::format("{}_camera_info.yaml", view);
    if (fs::exists(origin.lenses / lens)) runlog::link_or_copy(origin.lenses / lens, out / lens);
  }
  const WheelTables tables = wheel_tables(wheels, pairs, lower, frames, robot);
  runlog::write_whole(out / "drive.csv", tables.drive);
  runlog::write_whole(out / "odometry.tum", tables.odometry);
  if (trajectory) {
    std::string truth;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      runlog::PoseRow pose = *trajectory->at(lower.times[pairs[i].lower]);
      pose.t_s = frames[i].t_s;
      truth += to_line(pose) + '\n';
    }
    runlog::write_whole(out / "truth.tum", truth);
  }
  runlog::RunInfo info;
  info.version = runlog::version();
  info.commit = runlog::commit();
  info.compiler = runlog::compiler();
  info.behaviour = runlog::kImported;
  info.method =
      robot.estimator.method.empty() ? std::string(to_string(estimation::kDefaultMethod)) : robot.estimator.method;
  info.import_options = origin.options;
  info.frames_wanted = int(frames.size());
  info.capture.emplace().unpaired = unpaired;
  info.finished = true;
  for (std::string& event : events) event = origin.named(std::move(event));
  info.events = events;
  runlog::write_run_yaml(out, info, robot, map.file);
  std::string rows = runlog::TableReader<runlog::FrameRow>::header() + '\n';
  for (const runlog::FrameRow& row : frames) rows += to_line(row) + '\n';
  runlog::write_whole(out / "frames.csv", rows);
  folder.keep();
  return {frames.size(), std::move(events)};
}

/// Returns a text with the recording's topics instead of the files into which they were unpacked.
std::string by_topics(std::string text, const fs::path& recording, const Unpacked& unpacked) {
  const auto replace = [&text](const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  };
  for (const auto& [file, topic] : {std::pair{unpacked.lower, unpacked.topics.lower},
                                    {unpacked.upper, unpacked.topics.upper},
                                    {unpacked.odometry, unpacked.topics.odometry}}) {
    if (file.empty()) continue;
    const std::string name = fmt::format("{} of {}", topic, recording.string());
    replace(file.string() + '/', name + ": ");
    replace(file.string(), name);
  }
  return text;
}

Imported import_unpacked(const Recording& given, const fs::path& out, const std::function<void(double)>& progress) {
  const UnpackedFolder folder(fs::absolute(out).lexically_normal().string() + ".unpacked");
  Unpacked unpacked = unpack(given.file, given.topics, folder.path());
  Recording recording = given;
  recording.lower = unpacked.lower;
  recording.upper = unpacked.upper;
  recording.odometry = unpacked.odometry;
  const Origin origin{options_of(given), unpacked.events, folder.path(),
                      [&](std::string text) { return by_topics(std::move(text), given.file, unpacked); }};
  try {
    return import_files(recording, origin, out, progress);
  } catch (const config::FileError& error) {
    throw config::FileError("{}", origin.named(error.what()));
  }
}

}  // namespace

Imported import_run(const Recording& recording, const fs::path& out, const std::function<void(double)>& progress) {
  refuse_if_used(out);
  if (!recording.file.empty()) return import_unpacked(recording, out, progress);
  return import_files(recording, {.options = options_of(recording)}, out, progress);
}

}  // namespace twocone::importer
