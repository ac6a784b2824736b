// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/hall.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/sim_povray/confined_povray.h"
#include "drivers/sim_povray/darkroom.h"
#include "drivers/sim_povray/effects/camera_stage.h"
#include "drivers/sim_povray/effects/choice.h"
#include "drivers/sim_povray/outline.h"
#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/pool_renderer.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {
namespace {

constexpr std::string_view kRobot = "robot";

/// The pictures of one instant that were asked for and may be unfinished.
struct Instant {
  std::uint64_t tick;
  std::vector<std::shared_future<ImageResult>> pictures;
};

bool is_ready(const std::shared_future<ImageResult>& picture) {
  return picture.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

bool is_finished(const Instant& instant) {
  return std::all_of(instant.pictures.begin(), instant.pictures.end(), is_ready);
}

/// The scene as it is to be rendered, and what in it moves.
struct Stage {
  RenderChoice choice;
  Scene scene;
  std::vector<NamedBlock> movers;  ///< robots and moving things
};

/// A robot that is, or was, in the world.
struct Resident {
  std::optional<World::RobotId> id;
  Pose2 start;  // where the scene shows it
  bool seated = false;
  bool asked = false;  ///< for the next instant
};

/// A camera's wish for a rate.
struct RateClaim {
  std::string camera;
  double rate_hz;
};

class OpenHall final : public Hall, public std::enable_shared_from_this<OpenHall> {
 public:
  OpenHall(const PlaceSettings& place, Stage stage, std::optional<Povray> povray, std::unique_ptr<Renderer> renderer)
      : place_(place),
        choice_(std::move(stage.choice)),
        scene_(std::move(stage.scene)),
        movers_(std::move(stage.movers)),
        povray_(std::move(povray)),
        renderer_(std::move(renderer)),
        world_(place) {
    for (std::size_t i = 0; i < place_.moving.size(); ++i) moving_starts_.push_back(world_.moving_pose(i));
  }
  ~OpenHall() override {
    stop_.raise();    // whoever looks for a mirror gives up
    moulds_.clear();  // and is gone before the renderer that it would order from
    renderer_.reset();
  }

  Result<std::unique_ptr<Seat>> take_seat(const SeatSettings& settings) override;
  [[nodiscard]] std::string rendering() const override { return renderer_->describe(); }

 private:
  friend class LocalSeat;

  void leave(const std::string& robot);
  Status step(const std::string& robot, Seat::SteadyTime deadline);
  void step_if_all_asked();
  [[nodiscard]] std::string who_has_not_asked() const;
  [[nodiscard]] bool waits_for(const std::string& robot) const;
  Status claim_rate(const void* view, const std::string& camera, double rate_hz);
  void drop_rate(const void* view);
  std::shared_ptr<ComingMould> mould(const NamedBlock& robot, const NamedBlock& camera, const CameraSettings& size,
                                     int antialias);
  /// Whether pictures may leave out what is outside the mirror.
  [[nodiscard]] bool looks_for_mirror() const {
    return povray_ && !place_.render.whole_picture && choice_.why_whole.empty();
  }
  [[nodiscard]] MouldResult make_mould(const NamedBlock& robot, const NamedBlock& camera, const CameraSettings& size,
                                       int antialias) const;
  [[nodiscard]] std::string pose_text(const std::string& robot, std::chrono::nanoseconds before) const;
  [[nodiscard]] FloorMotion motion_of(const NamedBlock& mover, std::chrono::nanoseconds before) const;

  const PlaceSettings place_;
  const RenderChoice choice_;
  const Scene scene_;
  const std::vector<NamedBlock> movers_;
  const std::optional<Povray> povray_;
  StopSignal stop_;
  std::unique_ptr<Renderer> renderer_;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  World world_;
  std::vector<Pose2> moving_starts_;           // where the scene shows the moving things
  std::map<std::string, Resident> residents_;  // by their blocks' names, so that their order is not that of coming
  std::uint64_t steps_ = 0;                    // ever
  std::map<const void*, RateClaim> claims_;
  struct MouldKey {
    std::string camera;
    int width_px, height_px, antialias;
    friend auto operator<=>(const MouldKey&,
                            const MouldKey&) = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 misreads it
  };
  std::map<MouldKey, std::shared_ptr<ComingMould>> moulds_;
};

class LocalSeat final : public Seat {
 public:
  LocalSeat(std::shared_ptr<OpenHall> hall, NamedBlock robot, World::RobotId id, const SeatSettings& settings)
      : hall_(std::move(hall)), robot_(std::move(robot)), id_(id), settings_(settings) {}
  ~LocalSeat() override {
    for (const auto& view : views_) release(*view);
    hall_->leave(robot_.name);
  }

  [[nodiscard]] const SeatState& state() const override { return state_; }

  Result<ViewId> open_view(const ViewSettings& settings) override {
    // robot.2 has the cameras lower.2 and upper.2.
    auto block = hall_->scene_.camera(settings.camera_name + robot_.name.substr(kRobot.size()));
    if (!block) return block.error();
    views_.push_back(std::make_unique<View>(View{settings, *std::move(block), nullptr}));
    return ViewId(views_.size() - 1);
  }

  Status configure_view(ViewId number, const CameraSettings& settings) override {
    View& view = *views_.at(number);
    const std::lock_guard lock(hall_->mutex_);
    if (auto claimed = hall_->claim_rate(&view, view.block.name, settings.rate_hz); !claimed) return claimed;
    try {
      view.mould = hall_->mould(robot_, view.block, settings, view.settings.antialias);
    } catch (const std::system_error& e) {
      return Error{ErrorCode::kUnavailable,
                   fmt::format("camera '{}': no thread is to be had: {}", view.block.name, e.what())};
    }
    return {};
  }

  void release_view(ViewId view) noexcept override { release(*views_.at(view)); }

  Status step(SteadyTime deadline) override {
    while (true) {
      std::erase_if(unfinished_, is_finished);
      if (unfinished_.size() < std::size_t(settings_.run_ahead_frames)) break;
      // A failed picture is a finished one: its error waits in its frame.
      for (const auto& picture : unfinished_.front().pictures) {
        if (picture.wait_until(deadline) != std::future_status::ready) {
          return Error{
              ErrorCode::kTimeout,
              fmt::format("the pictures of {} instants, the oldest being frame {}, are still being rendered; the "
                          "world waits for them",
                          unfinished_.size(), unfinished_.front().tick)};
        }
      }
    }
    if (auto stepped = hall_->step(robot_.name, deadline); !stepped) return stepped;
    refresh();
    return {};
  }

  std::shared_future<ImageResult> picture(ViewId number) override {
    const View& view = *views_.at(number);
    PictureOrder order{fmt::format("frame {}, view {}", state_.tick, view.block.name),
                       {},
                       view.settings.effects,
                       settings_.body.seed,
                       view.settings.camera_name,
                       state_.tick,
                       settings_.rendered};
    {
      const std::lock_guard lock(hall_->mutex_);
      for (const auto before : exposures_before(view.settings.effects)) {
        order.poses.push_back(hall_->pose_text(robot_.name, before));
      }
    }
    auto picture = take_picture(*hall_->renderer_, *view.mould, std::move(order));
    if (unfinished_.empty() || unfinished_.back().tick != state_.tick) unfinished_.push_back({state_.tick, {}});
    unfinished_.back().pictures.push_back(picture);
    return picture;
  }

  Status command(const WheelSpeeds& speeds) override {
    const std::lock_guard lock(hall_->mutex_);
    hall_->world_.command(id_, speeds);
    return {};
  }
  Status halt() noexcept override {
    const std::lock_guard lock(hall_->mutex_);
    hall_->world_.halt(id_);
    return {};
  }

  [[nodiscard]] bool is_waited_for() const override { return hall_->waits_for(robot_.name); }

  /// Reads the world's state anew.
  void refresh() {
    const std::lock_guard lock(hall_->mutex_);
    const World& world = hall_->world_;
    const World::Turned& turned = world.turned(id_);
    // The pose belongs to the pictures: it is that of the middle of the first camera's exposure.
    const auto before = views_.empty() ? std::chrono::nanoseconds(0) : capture_before(views_.front()->settings.effects);
    state_ = {world.tick(),    world.now(),      world.pose_before(id_, before),
              turned.left_rad, turned.right_rad, world.contact(id_)};
  }

 private:
  struct View {
    ViewSettings settings;
    NamedBlock block;
    std::shared_ptr<ComingMould> mould;  // once it is configured
  };

  void release(const View& view) noexcept {
    const std::lock_guard lock(hall_->mutex_);
    hall_->drop_rate(&view);
  }

  const std::shared_ptr<OpenHall> hall_;
  const NamedBlock robot_;
  const World::RobotId id_;
  const SeatSettings settings_;
  SeatState state_;
  std::vector<std::unique_ptr<View>> views_;
  std::deque<Instant> unfinished_;  // oldest first
};

Result<std::unique_ptr<Seat>> OpenHall::take_seat(const SeatSettings& settings) {
  check(settings);
  auto robot = scene_.robot(settings.name);
  if (!robot) return robot.error();
  if (!settings.map_outline.empty()) {
    if (const std::string difference = first_difference(settings.map_outline, outline_of(place_));
        !difference.empty()) {
      return Error{ErrorCode::kRefused, fmt::format("the robot's map is not that of this world: {}", difference)};
    }
  }
  std::unique_ptr<LocalSeat> seat;
  {
    const std::lock_guard lock(mutex_);
    Resident& resident = residents_[robot->name];
    if (resident.seated) {
      return Error{ErrorCode::kRefused, fmt::format("{} is taken by another program", robot->name)};
    }
    // Who comes anew begins where it is to begin, whatever became of its forerunner.
    if (resident.id) world_.remove(*resident.id);
    resident = {};
    RobotBody body = settings.body;
    body.name = robot->name;
    body.command_timeout = settings.drive.command_timeout;
    const auto id = world_.add_robot(body);
    if (!id) {
      residents_.erase(robot->name);
      return id.error();
    }
    resident.id = *id;
    resident.start = wrapped(body.start);
    resident.seated = true;
    seat = std::make_unique<LocalSeat>(shared_from_this(), *std::move(robot), *id, settings);
  }
  seat->refresh();
  return std::unique_ptr<Seat>(std::move(seat));
}

void OpenHall::leave(const std::string& robot) {
  const std::lock_guard lock(mutex_);
  Resident& resident = residents_.at(robot);
  world_.abandon(*resident.id);
  resident.seated = resident.asked = false;
  const bool empty =
      std::none_of(residents_.begin(), residents_.end(), [](const auto& entry) { return entry.second.seated; });
  if (empty) {
    residents_.clear();
    claims_.clear();
    world_.begin_anew();
  } else {
    step_if_all_asked();
  }
  changed_.notify_all();
}

Status OpenHall::step(const std::string& robot, Seat::SteadyTime deadline) {
  std::unique_lock lock(mutex_);
  if (world_.rate_hz() == 0) {
    return Error{ErrorCode::kInvalidState, "no camera of this world has been configured, so it has no rate to step at"};
  }
  residents_.at(robot).asked = true;
  const std::uint64_t before = steps_;
  step_if_all_asked();
  if (changed_.wait_until(lock, deadline, [&] { return steps_ != before; })) return {};
  const Error late{ErrorCode::kTimeout, fmt::format("the world waits for {}", who_has_not_asked())};
  residents_.at(robot).asked = false;
  return late;
}

void OpenHall::step_if_all_asked() {
  for (const auto& [name, resident] : residents_) {
    if (resident.seated && !resident.asked) return;
  }
  world_.step();
  ++steps_;
  for (auto& [name, resident] : residents_) resident.asked = false;
  changed_.notify_all();
}

std::string OpenHall::who_has_not_asked() const {
  std::vector<std::string> names;
  for (const auto& [name, resident] : residents_) {
    if (resident.seated && !resident.asked) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

bool OpenHall::waits_for(const std::string& robot) const {
  const std::lock_guard lock(mutex_);
  return !residents_.at(robot).asked &&
         std::any_of(residents_.begin(), residents_.end(), [](const auto& entry) { return entry.second.asked; });
}

Status OpenHall::claim_rate(const void* view, const std::string& camera, double rate_hz) {
  for (const auto& [other, claim] : claims_) {
    if (other != view && claim.rate_hz != rate_hz) {
      return Error{ErrorCode::kRefused,
                   fmt::format("camera '{}' wants {} Hz, but this world's camera '{}' runs at {} Hz, and a world has "
                               "one rate",
                               camera, rate_hz, claim.camera, claim.rate_hz)};
    }
  }
  claims_[view] = {camera, rate_hz};
  world_.set_rate(rate_hz);
  return {};
}

void OpenHall::drop_rate(const void* view) { claims_.erase(view); }

std::shared_ptr<ComingMould> OpenHall::mould(const NamedBlock& robot, const NamedBlock& camera,
                                             const CameraSettings& size, int antialias) {
  auto& mould = moulds_[{camera.name, size.width_px, size.height_px, antialias}];
  if (mould) return mould;
  if (!looks_for_mirror()) {
    mould = std::make_shared<ComingMould>(make_mould(robot, camera, size, antialias));
  } else {
    mould = std::make_shared<ComingMould>([=, this] { return make_mould(robot, camera, size, antialias); });
  }
  return mould;
}

MouldResult OpenHall::make_mould(const NamedBlock& robot, const NamedBlock& camera, const CameraSettings& size,
                                 int antialias) const {
  std::optional<MirrorSight> mirror;
  if (looks_for_mirror()) {
    auto found = find_mirror(*povray_, scene_, robot, camera, size.width_px, size.height_px, stop_.fd());
    if (!found) return found.error();
    mirror = *std::move(found);
  }
  Mould mould = scene_.mould(movers_, camera, mirror ? mirror->mask : std::string());
  mould.width_px = size.width_px;
  mould.height_px = size.height_px;
  mould.antialias = antialias;
  mould.quality = choice_.quality;
  mould.one_shot = choice_.one_shot;
  if (mirror) mould.window = mirror->window;
  return std::make_shared<const Mould>(std::move(mould));
}

FloorMotion OpenHall::motion_of(const NamedBlock& mover, std::chrono::nanoseconds before) const {
  const auto robot = residents_.find(mover.name);
  if (robot != residents_.end()) {
    return motion_between(robot->second.start, world_.pose_before(*robot->second.id, before));
  }
  for (std::size_t i = 0; i < place_.moving.size(); ++i) {
    if (mover.name == "moving." + place_.moving[i].name) {
      return motion_between(moving_starts_[i], world_.moving_pose_before(i, before));
    }
  }
  return {};  // a robot that nobody has claimed stands where the scene shows it
}

std::string OpenHall::pose_text(const std::string& robot, std::chrono::nanoseconds before) const {
  std::vector<FloorMotion> motions;
  FloorMotion view;
  for (const NamedBlock& mover : movers_) {
    motions.push_back(motion_of(mover, before));
    if (mover.name == robot) view = motions.back();
  }
  return scene_.pose_text(motions, view, place_.unit_m);
}

/// All robots of the scene, and the moving things of the map. A robot that cannot be moved is left to whoever claims
/// it.
Result<std::vector<NamedBlock>> find_movers(const Scene& scene, const std::vector<MovingThing>& moving) {
  std::vector<NamedBlock> movers;
  for (const std::string& name : scene.names()) {
    if (name != kRobot && !name.starts_with("robot.")) continue;
    if (auto block = scene.object(name)) movers.push_back(*std::move(block));
  }
  for (const MovingThing& thing : moving) {
    const std::string name = "moving." + thing.name;
    auto block = scene.object(name);
    if (!block) return block.error();
    movers.push_back(*std::move(block));
  }
  return movers;
}

Result<Stage> set_stage(const PlaceSettings& place, const Scene& scene) {
  auto choice = choose_rendering(scene, place.switches, SceneAccess(place.scene, place.scene_paths));
  if (!choice) return choice.error();
  if (!choice->calls.endless.empty()) return Error{ErrorCode::kRefused, choice->calls.endless};
  auto chosen = Scene::parse(choice->text, scene.path());
  if (!chosen) return chosen.error();
  auto movers = find_movers(*chosen, place.moving);
  if (!movers) return movers.error();
  return Stage{*std::move(choice), *std::move(chosen), *std::move(movers)};
}

}  // namespace

Result<std::shared_ptr<Hall>> Hall::open(const PlaceSettings& place, const Scene& scene,
                                         std::unique_ptr<Renderer> renderer) {
  check(place);
  auto stage = set_stage(place, scene);
  if (!stage) return stage.error();
  return std::shared_ptr<Hall>(std::make_shared<OpenHall>(place, *std::move(stage), std::nullopt, std::move(renderer)));
}

Result<std::shared_ptr<Hall>> Hall::open(const PlaceSettings& place) {
  check(place);
  auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  // Before POV-Ray is missed: a scene can be put right without it.
  auto stage = set_stage(place, *scene);
  if (!stage) return stage.error();
  auto povray = confined_povray(place, stage->choice.calls);
  if (!povray) return povray.error();
  auto renderer = make_renderer(*povray, place.render);
  return std::shared_ptr<Hall>(
      std::make_shared<OpenHall>(place, *std::move(stage), *std::move(povray), std::move(renderer)));
}

}  // namespace twocone::sim_povray
