// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/simulation_host.h"

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/child_process.h"
#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/image_pipeline.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/native/native_renderer.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {
namespace {

/// The ordered images of each step, which may be unfinished.
using OrderedImages = std::map<std::uint64_t, std::vector<std::shared_future<ImageResult>>>;

bool is_ready(const std::shared_future<ImageResult>& image) {
  return image.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

bool is_finished(const OrderedImages::value_type& step) { return std::ranges::all_of(step.second, is_ready); }

/// The scene to be rendered, and its blocks that move.
struct Stage {
  RenderChoice choice;
  std::vector<NamedBlock> movers;  ///< robots and moving things
};

/// A robot that is, or was, in the world.
struct HostedRobot {
  std::optional<World::RobotId> id;
  Pose2 start;  ///< pose at which the scene shows it
  bool joined = false;
  bool asked = false;  ///< whether it has requested the next step
};

/// A camera's claim to a rate.
struct RateClaim {
  std::string camera;
  double rate_hz;
};

class LocalHost final : public SimulationHost, public std::enable_shared_from_this<LocalHost> {
 public:
  LocalHost(const PlaceSettings& place, Stage stage, std::optional<Povray> povray, std::unique_ptr<Renderer> renderer)
      : place_(place),
        choice_(std::move(stage.choice)),
        movers_(std::move(stage.movers)),
        povray_(std::move(povray)),
        renderer_(std::move(renderer)),
        world_(place) {}
  ~LocalHost() override {
    stop_.raise();            // any search for a mirror ends
    view_templates_.clear();  // and has ended before its renderer is destroyed
    renderer_.reset();
  }

  Result<std::unique_ptr<RobotSession>> join(const SessionSettings& settings) override;

  Status reset() override {
    const std::lock_guard lock(mutex_);
    // Another robot of the scene could join, and the two would wait for each other.
    if (!is_empty()) {
      return Error{ErrorCode::kRefused,
                   "the host is not empty: the last robot's simulation, cameras, drive or truth are still there"};
    }
    begin_anew();
    return {};
  }

  [[nodiscard]] std::string rendering() const override { return renderer_->describe(); }

 private:
  friend class LocalSession;

  void leave(const std::string& robot) {
    const std::lock_guard lock(mutex_);
    HostedRobot& hosted = robots_.at(robot);
    world_.abandon(*hosted.id);
    hosted.joined = hosted.asked = false;
    if (is_empty()) {
      begin_anew();
    } else {
      step_if_all_asked();
    }
    changed_.notify_all();
  }

  [[nodiscard]] bool is_empty() const {
    return std::none_of(robots_.begin(), robots_.end(), [](const auto& entry) { return entry.second.joined; });
  }

  void begin_anew() {
    robots_.clear();
    claims_.clear();
    world_.begin_anew();
  }

  Status step(const std::string& robot, RobotSession::SteadyTime deadline) {
    std::unique_lock lock(mutex_);
    if (world_.rate_hz() == 0) {
      return Error{ErrorCode::kInvalidState,
                   "no camera of this world has been configured, so it has no rate to step at"};
    }
    robots_.at(robot).asked = true;
    const std::uint64_t before = steps_;
    step_if_all_asked();
    if (changed_.wait_until(lock, deadline, [&] { return steps_ != before; })) return {};
    const Error late(ErrorCode::kTimeout, "the world waits for {}", robots_not_ready());
    robots_.at(robot).asked = false;
    return late;
  }

  void step_if_all_asked() {
    for (const auto& [name, robot] : robots_) {
      if (robot.joined && !robot.asked) return;
    }
    world_.step();
    ++steps_;
    for (auto& [name, robot] : robots_) robot.asked = false;
    changed_.notify_all();
  }

  [[nodiscard]] std::string robots_not_ready() const {
    std::vector<std::string> names;
    for (const auto& [name, robot] : robots_) {
      if (robot.joined && !robot.asked) names.push_back(name);
    }
    return fmt::format("{}", fmt::join(names, ", "));
  }

  [[nodiscard]] bool waits_for(const std::string& robot) const {
    const std::lock_guard lock(mutex_);
    return !robots_.at(robot).asked &&
           std::any_of(robots_.begin(), robots_.end(), [](const auto& entry) { return entry.second.asked; });
  }

  Status claim_rate(const void* view, const std::string& camera, double rate_hz) {
    for (const auto& [other, claim] : claims_) {
      if (other != view && claim.rate_hz != rate_hz) {
        return Error(ErrorCode::kRefused,
                     "camera '{}' wants {} Hz, but this world's camera '{}' runs at {} Hz, and a world has one rate",
                     camera, rate_hz, claim.camera, claim.rate_hz);
      }
    }
    claims_[view] = {camera, rate_hz};
    world_.set_rate(rate_hz);
    return {};
  }

  void drop_rate(const void* view) {
    const std::lock_guard lock(mutex_);
    claims_.erase(view);
  }

  std::shared_ptr<FutureViewTemplate> view_template(const NamedBlock& robot, const NamedBlock& camera,
                                                    const CameraSettings& size, int antialias) {
    auto& view_template = view_templates_[{camera.name, size.width_px, size.height_px, antialias}];
    if (view_template) return view_template;
    const auto make = [=, this, pose = pose_text(robot.name, std::chrono::nanoseconds(0)),
                       expected = renderer_->expect_view()] {
      auto made = make_view_template(robot, camera, size, antialias);
      if (made) renderer_->prepare(*made, pose);
      return made;
    };
    return view_template = looks_for_mirror() ? std::make_shared<FutureViewTemplate>(make)
                                              : std::make_shared<FutureViewTemplate>(make());
  }

  /// Returns whether images may leave out the pixels outside the mirror.
  [[nodiscard]] bool looks_for_mirror() const {
    return povray_ && !place_.render.whole_image && choice_.why_whole.empty();
  }

  [[nodiscard]] ViewTemplateResult make_view_template(const NamedBlock& robot, const NamedBlock& camera,
                                                      const CameraSettings& size, int antialias) const {
    std::optional<MirrorSight> mirror;
    if (looks_for_mirror()) {
      auto found = find_mirror(*povray_, choice_.scene, robot, camera, size.width_px, size.height_px, stop_.fd());
      if (!found) return found.error();
      mirror = *std::move(found);
    }
    ViewTemplate view_template = choice_.scene.view_template(movers_, camera, mirror ? mirror->mask : std::string());
    view_template.carrier = int(std::ranges::find(movers_, robot.name, &NamedBlock::name) - movers_.begin());
    view_template.width_px = size.width_px;
    view_template.height_px = size.height_px;
    view_template.antialias = antialias;
    view_template.quality = choice_.quality;
    view_template.unit_m = place_.unit_m;
    view_template.one_shot = choice_.one_shot;
    if (mirror) view_template.window = mirror->window;
    return std::make_shared<const ViewTemplate>(std::move(view_template));
  }

  [[nodiscard]] std::string pose_text(const std::string& robot, std::chrono::nanoseconds before) const {
    std::vector<FloorMotion> motions;
    FloorMotion view;
    for (const NamedBlock& mover : movers_) {
      motions.push_back(motion_of(mover, before));
      if (mover.name == robot) view = motions.back();
    }
    return choice_.scene.pose_text(motions, view, place_.unit_m);
  }

  [[nodiscard]] FloorMotion motion_of(const NamedBlock& mover, std::chrono::nanoseconds before) const {
    const auto robot = robots_.find(mover.name);
    if (robot != robots_.end()) {
      return motion_between(robot->second.start, world_.pose_before(*robot->second.id, before));
    }
    for (std::size_t i = 0; i < place_.moving.size(); ++i) {
      if (mover.name == "moving." + place_.moving[i].name) {
        // The scene shows it at time 0.
        return motion_between(world_.moving_pose_before(i, world_.now()), world_.moving_pose_before(i, before));
      }
    }
    return {};  // a robot that no session has claimed stands where the scene shows it
  }

  const PlaceSettings place_;
  const RenderChoice choice_;
  const std::vector<NamedBlock> movers_;
  const std::optional<Povray> povray_;
  base::StopSignal stop_;
  std::unique_ptr<Renderer> renderer_;

  mutable std::mutex mutex_;  // protects all members below
  std::condition_variable changed_;
  World world_;
  std::map<std::string, HostedRobot> robots_;  // by block name, so that the order of joining does not matter
  std::uint64_t steps_ = 0;                    // in total
  std::map<const void*, RateClaim> claims_;
  /// By camera, width, height and anti-aliasing.
  std::map<std::tuple<std::string, int, int, int>, std::shared_ptr<FutureViewTemplate>> view_templates_;
};

class LocalSession final : public RobotSession {
 public:
  LocalSession(std::shared_ptr<LocalHost> host, NamedBlock robot, World::RobotId id, const SessionSettings& settings)
      : host_(std::move(host)), robot_(std::move(robot)), id_(id), settings_(settings) {}
  ~LocalSession() override {
    for (const auto& view : views_) host_->drop_rate(view.get());
    host_->leave(robot_.name);
  }

  [[nodiscard]] const SessionState& state() const override { return state_; }

  Result<ViewId> open_view(const ViewSettings& settings) override {
    auto block = host_->choice_.scene.camera_of(robot_, settings.camera_name);
    if (!block) return block.error();
    views_.push_back(std::make_unique<View>(View{settings, *std::move(block), nullptr}));
    return ViewId(views_.size() - 1);
  }

  Status configure_view(ViewId number, const CameraSettings& settings) override {
    View& view = *views_.at(number);
    const std::lock_guard lock(host_->mutex_);
    if (auto claimed = host_->claim_rate(&view, view.block.name, settings.rate_hz); !claimed) return claimed;
    try {
      view.view_template = host_->view_template(robot_, view.block, settings, view.settings.antialias);
    } catch (const std::system_error& e) {
      return Error(ErrorCode::kUnavailable, "camera '{}': no thread is available: {}", view.block.name, e.what());
    }
    return {};
  }

  void release_view(ViewId view) noexcept override { host_->drop_rate(views_.at(view).get()); }

  Status step(SteadyTime deadline) override {
    while (true) {
      std::erase_if(unfinished_, is_finished);
      if (unfinished_.size() < std::size_t(settings_.run_ahead_frames)) break;
      // A failed image counts as finished: its frame holds the error.
      const auto& [oldest, images] = *unfinished_.begin();
      for (const auto& image : images) {
        if (image.wait_until(deadline) != std::future_status::ready) {
          return Error(ErrorCode::kTimeout,
                       "the images of {} steps, the oldest being frame {}, are still being rendered; the "
                       "world waits for them",
                       unfinished_.size(), oldest);
        }
      }
    }
    if (auto stepped = host_->step(robot_.name, deadline); !stepped) return stepped;
    refresh();
    return {};
  }

  std::shared_future<ImageResult> image(ViewId number) override {
    const View& view = *views_.at(number);
    ImageOrder order{fmt::format("frame {}, view {}", state_.step, view.block.name),
                     {},
                     view.settings.effects,
                     settings_.body.seed,
                     view.settings.camera_name,
                     state_.step,
                     state_.now,
                     settings_.rendered,
                     settings_.truth};
    {
      const std::lock_guard lock(host_->mutex_);
      for (const auto before : shutter_samples_before(view.settings.effects)) {
        order.poses.push_back(host_->pose_text(robot_.name, before));
      }
    }
    auto image = take_image(*host_->renderer_, *view.view_template, std::move(order));
    unfinished_[state_.step].push_back(image);
    return image;
  }

  Status command(const WheelSpeeds& speeds) override {
    const std::lock_guard lock(host_->mutex_);
    host_->world_.command(id_, speeds);
    return {};
  }
  Status halt() noexcept override {
    const std::lock_guard lock(host_->mutex_);
    host_->world_.halt(id_);
    return {};
  }

  [[nodiscard]] bool is_waited_for() const override { return host_->waits_for(robot_.name); }

  /// Updates the state from the world.
  void refresh() {
    const std::lock_guard lock(host_->mutex_);
    const World& world = host_->world_;
    const World::Turned& turned = world.turned(id_);
    // The pose belongs to the images: it is the pose in the middle of the first camera's exposure.
    const auto before = views_.empty() ? std::chrono::nanoseconds(0) : capture_before(views_.front()->settings.effects);
    state_ = {world.step_number(), world.now(),      world.pose_before(id_, before),
              turned.left_rad,     turned.right_rad, world.contact(id_)};
  }

 private:
  struct View {
    ViewSettings settings;
    NamedBlock block;
    std::shared_ptr<FutureViewTemplate> view_template;  // set once the view is configured
  };

  const std::shared_ptr<LocalHost> host_;
  const NamedBlock robot_;
  const World::RobotId id_;
  const SessionSettings settings_;
  SessionState state_;
  std::vector<std::unique_ptr<View>> views_;
  OrderedImages unfinished_;
};

Result<std::unique_ptr<RobotSession>> LocalHost::join(const SessionSettings& settings) {
  check(settings);
  if (settings.truth && place_.render.renderer == RendererKind::kPovray) {
    return Error{ErrorCode::kRefused,
                 "only the native renderer knows what each pixel shows, and this world's renderer is povray"};
  }
  auto robot = choice_.scene.robot(settings.name);
  if (!robot) return robot.error();
  if (!settings.map_outline.empty()) {
    if (const std::string difference = first_difference(settings.map_outline, outline_of(place_));
        !difference.empty()) {
      return Error(ErrorCode::kRefused, "the robot's map is not that of this world: {}", difference);
    }
  }
  std::unique_ptr<LocalSession> session;
  {
    const std::lock_guard lock(mutex_);
    HostedRobot& hosted = robots_[robot->name];
    if (hosted.joined) {
      return Error(ErrorCode::kRefused, "{} is taken by another program", robot->name);
    }
    // A robot that joins again starts at its initial pose, whatever happened to its predecessor.
    if (hosted.id) world_.remove(*hosted.id);
    hosted = {};
    RobotBody body = settings.body;
    body.name = robot->name;
    body.command_timeout = settings.drive.command_timeout;
    const auto id = world_.add_robot(body);
    if (!id) {
      robots_.erase(robot->name);
      return id.error();
    }
    hosted = {.id = *id, .start = wrapped(body.start), .joined = true};
    session = std::make_unique<LocalSession>(shared_from_this(), *std::move(robot), *id, settings);
  }
  session->refresh();
  return std::unique_ptr<RobotSession>(std::move(session));
}

/// Returns all robots of the scene, and the moving things of the map. A robot that cannot be moved is skipped here; it
/// is reported when a session claims it.
Result<std::vector<NamedBlock>> find_movers(const Scene& scene, const std::vector<MovingThing>& moving) {
  std::vector<NamedBlock> movers;
  for (const std::string& name : scene.names()) {
    if (name != "robot" && !name.starts_with("robot.")) continue;
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
  auto movers = find_movers(choice->scene, place.moving);
  if (!movers) return movers.error();
  return Stage{*std::move(choice), *std::move(movers)};
}

}  // namespace

Result<std::shared_ptr<SimulationHost>> SimulationHost::open(const PlaceSettings& place, const Scene& scene,
                                                             std::unique_ptr<Renderer> renderer) {
  check(place);
  auto stage = set_stage(place, scene);
  if (!stage) return stage.error();
  return std::shared_ptr<SimulationHost>(
      std::make_shared<LocalHost>(place, *std::move(stage), std::nullopt, std::move(renderer)));
}

Result<std::shared_ptr<SimulationHost>> SimulationHost::open(const PlaceSettings& place) {
  check(place);
  auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  // The scene is checked before the search for POV-Ray, because a scene can be corrected without it.
  auto stage = set_stage(place, *scene);
  if (!stage) return stage.error();
  auto povray = confined_povray(place, stage->choice.calls);
  if (!povray && place.render.renderer != RendererKind::kNative) {
    const Error& error = povray.error();
    if (error.code != ErrorCode::kUnavailable || place.render.renderer == RendererKind::kPovray) return error;
    return Error(error.code, "{}; or use --renderer native, which renders many scenes without it, unchecked",
                 error.message);
  }
  std::unique_ptr<Renderer> renderer;
  if (place.render.renderer == RendererKind::kPovray) {
    if (place.render.chosen) place.render.chosen(RendererKind::kPovray, true);
    renderer = make_renderer(*povray, place.render);
  } else {
    std::optional<Reference> reference;
    if (place.render.renderer == RendererKind::kAuto) {
      reference.emplace(Reference{*povray, make_renderer(*povray, place.render)});
    }
    renderer = std::make_unique<NativeRenderer>(NativeSettings{place.scene, SceneAccess(place.scene, place.scene_paths),
                                                               user_cache(), place.render.notice, place.render.chosen},
                                                std::move(reference));
  }
  std::optional<Povray> mirror_finder;
  if (povray) mirror_finder = *std::move(povray);
  return std::shared_ptr<SimulationHost>(
      std::make_shared<LocalHost>(place, *std::move(stage), std::move(mirror_finder), std::move(renderer)));
}

}  // namespace twocone::sim_povray
