// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <algorithm>
#include <chrono>
#include <deque>

#include <fmt/format.h>

#include "apps/compare/both_runs.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/import/motion.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"
#include "apps/runs/run.h"
#include "drivers/sim_povray/simulation.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::compare {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kImageTimeout{600'000};
// Number of frames that are being rendered: enough to keep POV-Ray's processes busy with little memory.
constexpr std::size_t kOnTheWay = 6;
constexpr double kPosesShare = 0.15, kImagesShare = 0.85;

/// A frame that is to be rendered or is rendered already.
struct Place {
  runlog::FrameRow frame;
  runlog::PoseRow pose;
};

Result<std::vector<Place>> places_of(const Side& real) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < real.run.frames.size(); ++i) {
    if (real.reference[i]) places.push_back({real.run.frames[i], *real.reference[i]});
  }
  if (places.empty()) {
    return Error(ErrorCode::kBadData,
                 "{}: no frame's pose is known, so none can be rendered again: give them with --poses FILE.tum",
                 real.name);
  }
  return places;
}

/// Requests the images of the scene's two cameras at a pose. They may still be rendering when this returns.
Result<std::array<twocone::Frame, 2>> look(sim_povray::SimulationHost& host, const config::Robot& robot,
                                           const Place& place) {
  sim_povray::SessionSettings session;
  session.body.start = robot.start.value_or(Pose2{});
  session.body.begin = Pose2{place.pose.x_m, place.pose.y_m, place.pose.heading_rad};
  session.body.radius_m = 0;  // the real robot stood there, so nothing obstructs it
  if (auto empty = host.reset(); !empty) return empty.error();
  auto simulation = sim_povray::Simulation::join(host, session);
  if (!simulation) return simulation.error();
  std::vector<std::unique_ptr<Camera>> cameras;
  for (const auto& [name, entry] : {std::pair{"lower", &robot.lower}, {"upper", &robot.upper}}) {
    auto camera = (*simulation)->open_camera({name, entry->antialias, {}});
    if (!camera) return camera.error();
    if (auto applied = (*camera)->configure(entry->settings); !applied) return applied.error();
    if (auto started = (*camera)->start(); !started) return started.error();
    cameras.push_back(*std::move(camera));
  }
  auto lower = cameras[0]->grab(kImageTimeout);
  if (!lower) return lower.error();
  auto upper = cameras[1]->grab(kImageTimeout);
  if (!upper) return upper.error();
  return std::array<twocone::Frame, 2>{*std::move(lower), *std::move(upper)};
}

/// Returns everything that determines the images: the map, the scene, the files beside it that it can include, the
/// cameras and the poses.
std::string recipe_of(const config::Robot& robot, const config::Map& map, const std::vector<Place>& places) {
  std::string recipe = config::read_text(map.file);
  std::vector<std::filesystem::path> sources;
  std::error_code none;  // an unreadable folder is reported when the scene is opened
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::absolute(*map.scene).parent_path(), none)) {
    const auto kind = entry.path().extension();
    if (kind == ".pov" || kind == ".inc") sources.push_back(entry.path());
  }
  std::sort(sources.begin(), sources.end());
  for (const auto& source : sources) recipe += fmt::format("\n{}:\n{}", source.string(), config::read_text(source));
  for (const auto* const camera : {&robot.lower, &robot.upper}) {
    recipe += fmt::format("\n{} x {} px, antialias {}", camera->settings.width_px, camera->settings.height_px,
                          camera->antialias);
  }
  for (const Place& place : places) {
    recipe += fmt::format("\n{} {:.6f} {:.6f} {:.6f}", place.frame.frame, place.pose.x_m, place.pose.y_m,
                          place.pose.heading_rad);
  }
  return recipe;
}

/// Removes images of another scene or of other poses.
void keep_those_of(const std::string& recipe, const std::filesystem::path& folder) {
  const auto kept = folder / "rendered_from.txt";
  std::error_code error;
  if (!std::filesystem::exists(kept, error) || config::read_text(kept) != recipe) {
    for (const char* const view : {"lower", "upper"}) std::filesystem::remove_all(folder / view, error);
  }
  for (const char* const view : {"lower", "upper"}) std::filesystem::create_directories(folder / view, error);
  if (error) throw runlog::DiskError("cannot make {}: {}", folder.string(), error.message());
  runlog::write_whole(kept, recipe);
}

struct Coming {
  std::uint64_t frame;
  std::array<twocone::Frame, 2> images;
};

Status render_all(const Settings& settings, const Side& real, const config::Map& map,
                  const std::vector<Place>& places) {
  auto host = sim_povray::SimulationHost::open(config::to_place(map));
  if (!host) return host.error();
  std::deque<Coming> coming;
  const auto keep_first = [&]() -> Status {
    const Coming first = std::move(coming.front());
    coming.pop_front();
    const auto lower = first.images[0].image(kImageTimeout);
    if (!lower) return lower.error();
    runlog::write_image(runlog::lower_image_file(settings.simulated, first.frame), **lower);
    // The upper image is written last, so if it exists, both do.
    const auto upper = first.images[1].image(kImageTimeout);
    if (!upper) return upper.error();
    runlog::write_image(runlog::upper_image_file(settings.simulated, first.frame), **upper);
    return {};
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (settings.stop && *settings.stop) return stopped_error();
    if (!std::filesystem::exists(runlog::upper_image_file(settings.simulated, places[i].frame.frame))) {
      auto frames = look(**host, real.run.robot, places[i]);
      if (!frames) return with_name(fmt::format("frame {}", places[i].frame.frame), frames.error());
      coming.push_back({places[i].frame.frame, *std::move(frames)});
      if (coming.size() >= kOnTheWay) {
        if (auto kept = keep_first(); !kept) return kept;
      }
    }
    settings.progress(kPosesShare + (kImagesShare - kPosesShare) * double(i + 1) / double(places.size()));
  }
  while (!coming.empty()) {
    if (auto kept = keep_first(); !kept) return kept;
  }
  return {};
}

/// Writes the tables that need no image: frames, wheels, poses. frames.csv comes last.
void write_tables(const Settings& settings, const std::filesystem::path& scene, const Side& real,
                  const std::vector<Place>& places) {
  std::vector<localisation::Pose> poses;
  poses.reserve(places.size());
  for (const Place& place : places) poses.push_back(pose_of(place.pose));
  const auto wheels = importer::wheels_of(poses, config::to_wheels(real.run.robot));
  std::string truth, drive = runlog::TableReader<runlog::DriveRow>::header() + "\n",
                     frames = runlog::TableReader<runlog::FrameRow>::header() + "\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    runlog::PoseRow pose = places[i].pose;
    pose.t_s = places[i].frame.t_s;
    truth += runlog::to_line(pose) + "\n";
    drive +=
        runlog::to_line(runlog::DriveRow{pose.t_s, {}, {}, wheels.turns[i].left_rad, wheels.turns[i].right_rad}) + "\n";
    runlog::FrameRow row{.frame = places[i].frame.frame, .lower_sequence = i, .upper_sequence = i};
    row.t_s = row.lower_t_s = row.upper_t_s = pose.t_s;
    frames += runlog::to_line(row) + "\n";
  }
  runlog::write_run_yaml_for_map(settings.real, scene,
                                 fmt::format("the places of {} ({}), rendered again", real.name, real.reference_is),
                                 settings.simulated);
  runlog::write_whole(settings.simulated / "truth.tum", truth);
  runlog::write_whole(settings.simulated / "odometry.tum", truth);
  runlog::write_whole(settings.simulated / "drive.csv", drive);
  runlog::write_whole(settings.simulated / "frames.csv", frames);
}

}  // namespace

Status render_again(const Settings& settings, const std::filesystem::path& scene) {
  const config::Map map = config::read_map(scene);
  if (!map.scene) throw config::FileError("{}: has no `scene:`, so there is nothing to render", scene.string());
  auto real = read_side(settings.real, settings.real_poses);
  if (!real) return real.error();
  if (const std::string why = why_other_rooms(map, real->run.map); !why.empty()) {
    return Error(ErrorCode::kBadData, "{} is not of the room of {} ({}): {}; name a map of the same landmarks",
                 scene.string(), settings.real.string(), real->run.map.file.string(), why);
  }
  calibrate_side(*real, settings.fit_frames, [&](double done) { settings.progress(kPosesShare * done); });
  // The truth of a simulated "real" run is ignored: as for a real run, the poses come from its own images.
  if (settings.real_poses.empty()) real->is_reference_apart = false;
  locate(*real);
  const auto places = places_of(*real);
  if (!places) return places.error();
  keep_those_of(recipe_of(real->run.robot, map, *places), settings.simulated);
  if (auto rendered = render_all(settings, *real, map, *places); !rendered) return rendered;
  write_tables(settings, scene, *real, *places);
  const auto localised = runs::localise(settings.simulated, estimation::Method::kOutline, [&](double done) {
    settings.progress(kImagesShare + (1 - kImagesShare) * done);
  });
  if (!localised) return localised.error();
  return {};
}

}  // namespace twocone::compare
