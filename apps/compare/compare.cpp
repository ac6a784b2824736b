// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <algorithm>
#include <array>
#include <future>
#include <mutex>
#include <tuple>

#include <fmt/format.h>

#include "apps/compare/both_runs.h"
#include "apps/compare/findings.h"
#include "base/errors.h"

namespace twocone::compare {
namespace {

// Images from poses farther apart than this show different views: an object at 2 m is displaced by some ten pixels.
constexpr double kSamePlace_m = 0.15;
constexpr std::size_t kMostPoses = 2000;
constexpr std::size_t kExhibits = 6;
constexpr int kHeldOutFrames = 60;  // frames that measure the gap of ranges

void check(const Settings& settings) {
  base::Complaints bad;
  for (const auto& [name, value, least] :
       {std::tuple{"fit_frames", settings.fit_frames, int(vision::CalibrationResult::kMinFrames)},
        {"every", settings.every, 1},
        {"jobs", settings.jobs, 1}}) {
    bad.require(value >= least, "{} is {}, must be >= {}", name, value, least);
  }
  bad.require_field(settings.false_alarm > 0 && settings.false_alarm < 1, "false_alarm", settings.false_alarm,
                    "within 0 and 1");
  bad.raise("compare");
}

std::vector<double> times_of(const runlog::RunData& run) {
  std::vector<double> times;
  for (const runlog::FrameRow& frame : run.frames) times.push_back(frame.t_s);
  return times;
}

std::vector<runlog::PoseRow> thinned(const std::vector<std::optional<runlog::PoseRow>>& poses) {
  std::vector<runlog::PoseRow> result;
  const std::size_t every = (poses.size() + kMostPoses - 1) / kMostPoses;
  for (std::size_t i = 0; i < poses.size(); i += every) {
    if (poses[i]) result.push_back(*poses[i]);
  }
  return result;
}

std::vector<Exhibit> exhibits_of(const Side& simulated, const Side& real, const std::vector<Match>& by_pose) {
  std::vector<Exhibit> exhibits;
  const std::size_t count = std::min(kExhibits, by_pose.size());
  for (std::size_t i = 0; i < count; ++i) {
    // Takes the nearest pair of each part of the run.
    const auto from = by_pose.begin() + std::ptrdiff_t(i * by_pose.size() / count);
    const auto to = by_pose.begin() + std::ptrdiff_t((i + 1) * by_pose.size() / count);
    const auto apart = [&](const Match& m) {
      return distance_m(*simulated.reference[m.simulated], *real.reference[m.real]);
    };
    const Match best = *std::ranges::min_element(from, to, {}, apart);
    exhibits.push_back({images_of(simulated.run, best.simulated), images_of(real.run, best.real),
                        *simulated.reference[best.simulated], *real.reference[best.real]});
  }
  return exhibits;
}

/// Calibrates both runs at the same time, each in a thread of its own.
void calibrate_both(Side& simulated, Side& real, int frames, const std::function<void(double)>& progress) {
  std::mutex mutex;
  std::array<double, 2> done{};
  const auto report_part = [&](std::size_t which, double part) {
    const std::lock_guard lock(mutex);
    done[which] = part;
    progress((done[0] + done[1]) / 2);
  };
  auto other =
      std::async(std::launch::async, [&] { calibrate_side(simulated, frames, [&](double p) { report_part(0, p); }); });
  calibrate_side(real, frames, [&](double p) { report_part(1, p); });
  other.get();
}

/// Returns a key for the comparison. Finished parts of an earlier comparison are used only if their key is equal.
std::string key_of(const Side& simulated, const Side& real, const Settings& settings) {
  const auto when = [](const std::filesystem::path& image) {
    std::error_code none;
    return std::filesystem::last_write_time(image, none).time_since_epoch().count();
  };
  const auto one = [&when](const Side& side) {
    const std::size_t frames = side.run.frames.size();
    return fmt::format("{} {} {} {} {} {} {}", std::filesystem::absolute(side.run.folder).string(), frames,
                       side.run.frames.back().t_s, side.run.info.commit, side.run.info.seed,
                       when(images_of(side.run, 0)[0]), when(images_of(side.run, frames - 1)[1]));
  };
  return fmt::format("2|{}|{}|every {} fit {} poses {}", one(simulated), one(real), settings.every, settings.fit_frames,
                     settings.real_poses.string());
}

void note_differences(const Side& simulated, const Side& real, std::vector<std::string>& notes) {
  const config::Robot &a = simulated.run.robot, &b = real.run.robot;
  const auto size = [](const auto& camera) {
    return fmt::format("{} x {}", camera.settings.width_px, camera.settings.height_px);
  };
  if (size(a.lower) != size(b.lower) || size(a.upper) != size(b.upper)) {
    notes.push_back(fmt::format("the images are of different size ({} and {} px): colours are not compared",
                                size(a.lower), size(b.lower)));
  }
  if (simulated.run.map.landmarks != real.run.map.landmarks) {
    notes.push_back(fmt::format("the maps {} and {} have different landmarks", simulated.run.map.file.string(),
                                real.run.map.file.string()));
  }
  for (const Side* const side : {&simulated, &real}) {
    if (!side->run.info.finished) notes.push_back(side->name + ": the run was cut off");
    for (const std::string& left_out : side->left_out) notes.push_back(left_out);
    if (!side->calibration) notes.push_back(side->name + ": its rig cannot be determined: " + side->why_no_calibration);
  }
}

}  // namespace

Result<Outcome> compare(const Settings& settings) {
  check(settings);
  // Shares of the work, as measured: each calibration makes the sightings of its frames several times.
  constexpr double kFitted = 0.4, kLocated = 0.42, kMeasured = 0.95;
  auto simulated = read_side(settings.simulated, {});
  if (!simulated) return simulated.error();
  auto real = read_side(settings.real, settings.real_poses);
  if (!real) return real.error();
  if (const std::string why = why_other_rooms(simulated->run.map, real->run.map); !why.empty()) {
    return Error(ErrorCode::kBadData,
                 "{} ({}) and {} ({}) are not of one room: {}; compare runs among the same landmarks",
                 settings.simulated.string(), simulated->run.map.file.string(), settings.real.string(),
                 real->run.map.file.string(), why);
  }
  calibrate_both(*simulated, *real, settings.fit_frames, [&](double done) { settings.progress(done * kFitted); });
  if (settings.stop && *settings.stop) return stopped_error();
  settings.progress(kFitted);
  locate(*simulated);
  locate(*real);
  const std::vector<double> of_simulated = times_of(simulated->run), of_real = times_of(real->run);
  BothRuns both{.simulated = *simulated,
                .real = *real,
                .simulated_timing = timing_of(simulated->run),
                .real_timing = timing_of(real->run),
                .is_rendered = settings.is_rendered};
  both.by_time = match_by_time(of_simulated, of_real, 0.5 / std::max(both.simulated_timing.rate_hz, 1.0));
  both.by_pose = match_by_pose(simulated->reference, real->reference, kSamePlace_m);

  auto images = measure_images(
      *simulated, *real, both.by_pose,
      {settings.work, key_of(*simulated, *real, settings), settings.every, settings.jobs,
       [&](double done) { settings.progress(kLocated + (kMeasured - kLocated) * done); }, settings.stop});
  if (!images) return images.error();

  Comparison found;
  found.simulated = simulated->name;
  found.real = real->name;
  found.is_rendered = settings.is_rendered;
  found.reference = real->reference_is;
  found.simulated_frames = of_simulated.size();
  found.real_frames = of_real.size();
  found.matched_by_time = both.by_time.size();
  found.matched_by_pose = both.by_pose.size();
  found.false_alarm = settings.false_alarm;
  found.map = real->run.map;
  found.simulated_robot = simulated->run.robot;
  found.real_robot = real->run.robot;
  note_differences(*simulated, *real, found.notes);
  for (const std::string& text : images->unreadable) found.notes.push_back("left out: " + text);
  if (images->unreadable_count > images->unreadable.size()) {
    found.notes.push_back(
        fmt::format("{} more images cannot be read", images->unreadable_count - images->unreadable.size()));
  }
  found.sources = find_sources(both, *images, settings.false_alarm, found.level);
  const auto held_out = held_out_ranges(*real, found.sources, kHeldOutFrames,
                                        [&](double done) { settings.progress(kMeasured + (1 - kMeasured) * done); });
  if (!held_out) return held_out.error();
  found.gaps = find_gaps(both, *held_out, *images, found.sources);
  Residuals residuals_simulated = residuals_of(*simulated), residuals_real = residuals_of(*real);
  found.rows = find_rows(both, residuals_simulated, residuals_real, found.sources, settings.limits);
  found.simulated_residuals = std::move(residuals_simulated.points);
  found.real_residuals = std::move(residuals_real.points);
  found.simulated_path = thinned(simulated->reference);
  found.real_path = thinned(real->reference);
  found.real_odometry = thinned({real->run.odometry.begin(), real->run.odometry.end()});
  found.exhibits = exhibits_of(*simulated, *real, both.by_pose);
  settings.progress(1);
  return Outcome{std::move(found), *std::move(images), std::move(real->calibration)};
}

}  // namespace twocone::compare
