// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/render_again.h"

#include <algorithm>
#include <chrono>
#include <deque>

#include <fmt/format.h>

#include "apps/compare/matching.h"
#include "apps/compare/residuals.h"
#include "apps/compare/side.h"
#include "apps/files/file_error.h"
#include "apps/files/text_file.h"
#include "apps/files/to_layers.h"
#include "apps/foreign/motion.h"
#include "apps/runs/disk.h"
#include "apps/runs/run.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/tables.h"

namespace twocone::compare {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPictureTimeout{600'000};
// Pictures on their way: enough for POV-Ray's processes to be busy, and little memory.
constexpr std::size_t kOnTheWay = 6;
constexpr double kPosesShare = 0.15, kPicturesShare = 0.85;

/// A frame that is rendered, or is there already.
struct Place {
  runs::FrameRow frame;
  runs::PoseRow pose;
};

Result<std::vector<Place>> places_of(const Side& real) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < real.run.frames.size(); ++i) {
    if (real.reference[i]) places.push_back({real.run.frames[i], *real.reference[i]});
  }
  if (places.empty()) {
    return Error{ErrorCode::kBadData, fmt::format("{}: no frame's pose is known, so none can be rendered again: give "
                                                  "them with --poses FILE.tum",
                                                  real.name)};
  }
  return places;
}

/// What the two cameras of the scene see from one place after the other.
class CamerasOfScene {
 public:
  CamerasOfScene(const files::Robot& robot, const files::Map& map, const sim_povray::RenderSettings& render)
      : robot_(robot), place_(files::to_place(map)) {
    place_.render = render;
  }

  Status open() {
    auto venue = sim_povray::Venue::open(place_);
    if (!venue) return venue.error();
    venue_ = *std::move(venue);
    return {};
  }

  Result<std::array<Frame, 2>> look(const Place& place) {
    sim_povray::SeatSettings seat;
    const files::Start start = robot_.start.value_or(files::Start{});
    seat.body.start = {start.x_m, start.y_m, start.heading_rad};
    seat.body.begin = Pose2{place.pose.x_m, place.pose.y_m, place.pose.heading_rad};
    seat.body.radius_m = 0;  // where a real robot was, nothing was in its way
    auto simulation = venue_->enter(seat);
    if (!simulation) return simulation.error();
    std::vector<std::unique_ptr<Camera>> cameras;
    for (const auto& [name, entry] : {std::pair{"lower", &robot_.lower}, {"upper", &robot_.upper}}) {
      sim_povray::ViewSettings view{name, entry->antialias, {}};
      auto camera = (*simulation)->open_camera(view);
      if (!camera) return camera.error();
      CameraSettings settings;
      settings.width_px = entry->width_px;
      settings.height_px = entry->height_px;
      settings.rate_hz = entry->rate_hz;
      if (auto applied = (*camera)->configure(settings); !applied) return applied.error();
      if (auto started = (*camera)->start(); !started) return started.error();
      cameras.push_back(*std::move(camera));
    }
    auto lower = cameras[0]->grab(kPictureTimeout);
    if (!lower) return lower.error();
    auto upper = cameras[1]->grab(kPictureTimeout);
    if (!upper) return upper.error();
    return std::array<Frame, 2>{*std::move(lower), *std::move(upper)};
  }

 private:
  files::Robot robot_;
  sim_povray::PlaceSettings place_;
  std::optional<sim_povray::Venue> venue_;
};

/// What the pictures are made of: the map, its scene with what stands beside it to be included, the cameras, the
/// places.
std::string recipe_of(const files::Robot& robot, const files::Map& map, const std::vector<Place>& places) {
  std::string recipe = files::read_text(map.file);
  std::vector<std::filesystem::path> sources;
  std::error_code none;  // what is wrong with a scene's place is told when it is opened
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::absolute(*map.scene).parent_path(), none)) {
    const auto kind = entry.path().extension();
    if (kind == ".pov" || kind == ".inc") sources.push_back(entry.path());
  }
  std::sort(sources.begin(), sources.end());
  for (const auto& source : sources) recipe += fmt::format("\n{}:\n{}", source.string(), files::read_text(source));
  for (const files::CameraEntry* const camera : {&robot.lower, &robot.upper}) {
    recipe += fmt::format("\n{} x {} px, antialias {}", camera->width_px, camera->height_px, camera->antialias);
  }
  for (const Place& place : places) {
    recipe += fmt::format("\n{} {:.6f} {:.6f} {:.6f}", place.frame.frame, place.pose.x_m, place.pose.y_m,
                          place.pose.heading_rad);
  }
  return recipe;
}

/// Removes pictures of another scene or of other places.
void keep_those_of(const std::string& recipe, const std::filesystem::path& folder) {
  const auto kept = folder / "rendered_from.txt";
  std::error_code error;
  if (!std::filesystem::exists(kept, error) || files::read_text(kept) != recipe) {
    for (const char* const view : {"lower", "upper"}) std::filesystem::remove_all(folder / view, error);
  }
  for (const char* const view : {"lower", "upper"}) std::filesystem::create_directories(folder / view, error);
  if (error) throw runs::DiskError(fmt::format("cannot make {}: {}", folder.string(), error.message()));
  runs::write_whole(kept, recipe);
}

struct Coming {
  Place place;
  std::array<Frame, 2> frames;
};

Status keep(const std::filesystem::path& to, const Coming& coming) {
  // The upper one last: where it is there, both are.
  const std::array<std::filesystem::path, 2> files{runs::lower_picture(to, coming.place.frame.frame),
                                                   runs::upper_picture(to, coming.place.frame.frame)};
  for (const std::size_t k : {0, 1}) {
    const auto picture = coming.frames[k].image(kPictureTimeout);
    if (!picture) return picture.error();
    runs::write_picture(files[k], **picture);
  }
  return {};
}

Status render_all(const RenderAgain& settings, const Side& real, const files::Map& map,
                  const std::vector<Place>& places) {
  CamerasOfScene cameras(real.run.robot, map, settings.render);
  if (auto opened = cameras.open(); !opened) return opened;
  std::deque<Coming> coming;
  const auto keep_first = [&]() -> Status {
    Status kept = keep(settings.to, coming.front());
    coming.pop_front();
    return kept;
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (settings.stop && *settings.stop) {
      return Error{ErrorCode::kRefused, "stopped from outside; the same command goes on from here"};
    }
    if (!std::filesystem::exists(runs::upper_picture(settings.to, places[i].frame.frame))) {
      auto frames = cameras.look(places[i]);
      if (!frames)
        return Error{frames.error().code, fmt::format("frame {}: {}", places[i].frame.frame, frames.error().message)};
      coming.push_back({places[i], *std::move(frames)});
      if (coming.size() >= kOnTheWay) {
        if (auto kept = keep_first(); !kept) return kept;
      }
    }
    settings.progress(kPosesShare + (kPicturesShare - kPosesShare) * double(i + 1) / double(places.size()));
  }
  while (!coming.empty()) {
    if (auto kept = keep_first(); !kept) return kept;
  }
  return {};
}

/// Tables of what is known without looking: frames, wheels, poses. frames.csv last.
void write_tables(const RenderAgain& settings, const Side& real, const std::vector<Place>& places) {
  std::vector<localisation::Pose> poses;
  poses.reserve(places.size());
  for (const Place& place : places) poses.push_back({place.pose.x_m, place.pose.y_m, place.pose.heading_rad});
  const auto wheels = foreign::wheels_of(poses, files::to_wheels(real.run.robot));
  std::string truth, drive = runs::drive_header() + "\n", frames = runs::frames_header() + "\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    runs::PoseRow pose = places[i].pose;
    pose.t_s = places[i].frame.t_s;
    truth += runs::to_line(pose) + "\n";
    drive +=
        runs::to_line(runs::DriveRow{pose.t_s, {}, {}, wheels.turns[i].left_rad, wheels.turns[i].right_rad}) + "\n";
    runs::FrameRow row;
    row.frame = places[i].frame.frame;
    row.t_s = row.lower_t_s = row.upper_t_s = pose.t_s;
    row.lower_sequence = row.upper_sequence = i;
    frames += runs::to_line(row) + "\n";
  }
  runs::write_run_yaml_for_map(settings.real, settings.scene,
                               fmt::format("the places of {} ({}), rendered again", real.name, real.reference_is),
                               settings.to);
  runs::write_whole(settings.to / "truth.tum", truth);
  runs::write_whole(settings.to / "odometry.tum", truth);
  runs::write_whole(settings.to / "drive.csv", drive);
  runs::write_whole(settings.to / "frames.csv", frames);
}

}  // namespace

Status render_again(const RenderAgain& settings) {
  const files::Map map = files::read_map(settings.scene);
  if (!map.scene) {
    throw files::FileError(fmt::format("{}: has no `scene:`, so there is nothing to render", settings.scene.string()));
  }
  const auto tell = [&settings](double done) {
    if (settings.progress) settings.progress(done);
  };
  RenderAgain told = settings;
  told.progress = tell;
  auto real = read_side(settings.real, settings.poses);
  if (!real) return real.error();
  if (const std::string why = why_other_rooms(map, real->run.map); !why.empty()) {
    return Error{ErrorCode::kBadData,
                 fmt::format("{} is not of the room of {} ({}): {}; name a map of the same landmarks",
                             settings.scene.string(), settings.real.string(), real->run.map.file.string(), why)};
  }
  calibrate_side(*real, settings.fit_frames, [&](double done) { tell(kPosesShare * done); });
  // Truth of a simulated "real" run counts as none: what a camera saw from where is what is asked here.
  if (settings.poses.empty()) real->is_reference_apart = false;
  locate(*real);
  const auto places = places_of(*real);
  if (!places) return places.error();
  keep_those_of(recipe_of(real->run.robot, map, *places), settings.to);
  if (auto rendered = render_all(told, *real, map, *places); !rendered) return rendered;
  write_tables(settings, *real, *places);
  const auto localised = runs::localise(settings.to, runs::Method::kFull,
                                        [&](double done) { tell(kPicturesShare + (1 - kPicturesShare) * done); });
  if (!localised) return localised.error();
  return {};
}

}  // namespace twocone::compare
