// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/simulation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

// Far beyond any camera, and far from where a period of the rate or a picture's size would overflow its type.
constexpr double kMinRate_hz = 1e-3;
constexpr double kMaxRate_hz = 1e6;
constexpr int kMaxSide_px = 16384;

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

/// What the cameras, the drive and the truth of one world share; it lives as long as any of them.
class Shared {
 public:
  Shared(const WorldSettings& settings, Scene scene, NamedBlock robot, std::unique_ptr<Renderer> renderer)
      : settings_(settings),
        start_(World(settings).pose()),
        scene_(std::move(scene)),
        robot_(std::move(robot)),
        world_(settings),
        renderer_(std::move(renderer)) {}

  [[nodiscard]] const WorldSettings& settings() const { return settings_; }
  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] World& world() { return world_; }

  /// A camera's wish for a rate; it holds until dropped. Errors: kRefused if another camera holds a different one.
  Status claim_rate(const void* camera, const std::string& name, double rate_hz) {
    for (const auto& [other, claim] : claims_) {
      if (other != camera && claim.rate_hz != rate_hz) {
        return Error{ErrorCode::kRefused,
                     fmt::format("camera '{}' wants {} Hz, but this world's camera '{}' runs at {} Hz, and a world has "
                                 "one rate",
                                 name, rate_hz, claim.name, claim.rate_hz)};
      }
    }
    claims_[camera] = {name, rate_hz};
    world_.set_rate(rate_hz);
    return {};
  }
  void drop_rate(const void* camera) { claims_.erase(camera); }

  /// To the next instant, once few enough pictures are unfinished. Errors: kTimeout, and then nothing has moved.
  Status step(SteadyTime deadline) {
    while (true) {
      std::erase_if(unfinished_, is_finished);
      if (unfinished_.size() < std::size_t(settings_.render.run_ahead_frames)) break;
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
    world_.step();
    return {};
  }

  /// Orders a picture of the present instant.
  std::shared_future<ImageResult> picture(const NamedBlock& camera, const CameraSettings& size, int antialias) {
    const FloorMotion motion = motion_between(start_, world_.pose());
    auto picture = renderer_->submit({fmt::format("frame {}, view {}", world_.tick(), camera.name),
                                      scene_.seen({{robot_, motion}}, {camera, motion}, settings_.unit_m),
                                      size.width_px, size.height_px, antialias});
    if (unfinished_.empty() || unfinished_.back().tick != world_.tick()) unfinished_.push_back({world_.tick(), {}});
    unfinished_.back().pictures.push_back(picture);
    return picture;
  }

 private:
  struct Claim {
    std::string name;
    double rate_hz;
  };

  const WorldSettings settings_;
  const Pose2 start_;
  const Scene scene_;
  const NamedBlock robot_;
  World world_;
  std::map<const void*, Claim> claims_;
  std::deque<Instant> unfinished_;  // oldest first
  std::unique_ptr<Renderer> renderer_;
};

class SimCamera final : public Camera {
 public:
  SimCamera(std::shared_ptr<Shared> shared, NamedBlock block, int antialias)
      : shared_(std::move(shared)), block_(std::move(block)), antialias_(antialias) {}
  ~SimCamera() override { shared_->drop_rate(this); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    if (wanted.rate_hz < kMinRate_hz || wanted.rate_hz > kMaxRate_hz) {
      return Error{ErrorCode::kRefused, fmt::format("camera '{}': {} Hz is outside what can be simulated, {} to {} Hz",
                                                    block_.name, wanted.rate_hz, kMinRate_hz, kMaxRate_hz)};
    }
    if (wanted.width_px > kMaxSide_px || wanted.height_px > kMaxSide_px) {
      return Error{ErrorCode::kRefused,
                   fmt::format("camera '{}': {} x {} pixels are more than can be rendered, {} each way", block_.name,
                               wanted.width_px, wanted.height_px, kMaxSide_px)};
    }
    if (auto claimed = shared_->claim_rate(this, block_.name, wanted.rate_hz); !claimed) return claimed.error();
    settings_ = wanted;
    return wanted;
  }

  Status do_start() override {
    // Again, because stopping gave the claim up: the pair may have been set to another rate since.
    if (auto claimed = shared_->claim_rate(this, block_.name, settings_.rate_hz); !claimed) return claimed;
    // What the world did while this camera was off is not lost: it was not looking.
    next_ = std::max(next_, shared_->world().tick());
    return {};
  }

  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    World& world = shared_->world();
    if (next_ > world.tick()) {
      const auto deadline =
          std::chrono::steady_clock::now() + timeout;  // at most kLongestWait: Camera::grab sees to it
      if (auto stepped = shared_->step(deadline); !stepped) return stepped.error();
    }
    const Frame::Header header{world.tick(), world.now(), world.tick() - next_};
    next_ = world.tick() + 1;
    return Frame(header, shared_->picture(block_, settings_, antialias_));
  }

  void do_stop() noexcept override { shared_->drop_rate(this); }

  const std::shared_ptr<Shared> shared_;
  const NamedBlock block_;
  const int antialias_;
  CameraSettings settings_;
  std::uint64_t next_ = 0;  // the first instant not handed out
};

class SimDrive final : public DiffDrive {
 public:
  explicit SimDrive(std::shared_ptr<Shared> shared)
      : DiffDrive(shared->settings().drive), shared_(std::move(shared)), opened_at_(shared_->world().turned()) {}
  ~SimDrive() override { shared_->world().halt(); }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override {
    shared_->world().command(speeds);
    return {};
  }
  Result<WheelAngles> do_read_angles() override {
    const World::Turned& turned = shared_->world().turned();
    const int counts = shared_->settings().wheels.encoder_counts_per_turn;
    return WheelAngles{shared_->world().now(), encoder_reading_rad(turned.left_rad - opened_at_.left_rad, counts),
                       encoder_reading_rad(turned.right_rad - opened_at_.right_rad, counts)};
  }
  Status do_stop() noexcept override {
    shared_->world().halt();
    return {};
  }

  const std::shared_ptr<Shared> shared_;
  const World::Turned opened_at_;
};

class SimTruth final : public GroundTruth {
 public:
  explicit SimTruth(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  [[nodiscard]] Pose2 true_pose() const override { return shared_->world().pose(); }

 private:
  const std::shared_ptr<Shared> shared_;
};

class PovraySimulation final : public Simulation {
 public:
  explicit PovraySimulation(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  Result<std::unique_ptr<Camera>> open_camera(const ViewSettings& view) override {
    std::string bad;
    if (view.camera_name.empty()) bad += " camera_name is empty;";
    // POV-Ray takes +R up to 9.
    if (view.antialias < 1 || view.antialias > 9)
      bad += fmt::format(" antialias is {}, must be 1 to 9;", view.antialias);
    if (!bad.empty()) throw std::invalid_argument("ViewSettings:" + bad);
    auto block = shared_->scene().camera(view.camera_name);
    if (!block) return block.error();
    return std::unique_ptr<Camera>(std::make_unique<SimCamera>(shared_, std::move(*block), view.antialias));
  }
  std::unique_ptr<DiffDrive> open_drive() override { return std::make_unique<SimDrive>(shared_); }
  std::unique_ptr<GroundTruth> open_truth() override { return std::make_unique<SimTruth>(shared_); }

 private:
  std::shared_ptr<Shared> shared_;
};

/// Collects complaints about the fields of one struct.
class Complaints {
 public:
  void positive(const char* name, double value, const char* unit) {
    if (!(value > 0) || !std::isfinite(value)) add("{} is {} {}, must be > 0 and finite", name, value, unit);
  }
  void finite(const char* name, double value, const char* unit) {
    if (!std::isfinite(value)) add("{} is {} {}, must be finite", name, value, unit);
  }
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    text_ += ' ' + fmt::format(format, std::forward<Args>(args)...) + ';';
  }
  void raise(const char* what) const {
    if (!text_.empty()) throw std::invalid_argument(fmt::format("{}:{}", what, text_));
  }
  void take(const RenderSettings& render) {
    if (render.povray.empty()) add("render.povray is empty");
    if (render.processes < 1) add("render.processes is {}, must be >= 1", render.processes);
    if (render.run_ahead_frames < 1) add("render.run_ahead_frames is {}, must be >= 1", render.run_ahead_frames);
    if (render.timeout.count() <= 0) add("render.timeout is {} ms, must be > 0", render.timeout.count());
  }

 private:
  std::string text_;
};

}  // namespace

void check(const RenderSettings& settings) {
  Complaints complaints;
  complaints.take(settings);
  complaints.raise("RenderSettings");
}

void check(const WorldSettings& settings) {
  const WheelSettings& wheels = settings.wheels;
  Complaints complaints;
  if (settings.scene.empty()) complaints.add("scene is empty");
  complaints.positive("unit_m", settings.unit_m, "m");
  if (settings.robot_name.empty()) complaints.add("robot_name is empty");
  complaints.finite("start.x_m", settings.start.x_m, "m");
  complaints.finite("start.y_m", settings.start.y_m, "m");
  complaints.finite("start.heading_rad", settings.start.heading_rad, "rad");
  complaints.positive("wheels.separation_m", wheels.separation_m, "m");
  complaints.positive("wheels.radius_m", wheels.radius_m, "m");
  if (!(wheels.slip >= 0) || !std::isfinite(wheels.slip)) {
    complaints.add("wheels.slip is {}, must be >= 0 and finite", wheels.slip);
  }
  complaints.positive("wheels.slip_correlation_s", wheels.slip_correlation_s, "s");
  if (wheels.encoder_counts_per_turn < 0) {
    complaints.add("wheels.encoder_counts_per_turn is {}, must be >= 0", wheels.encoder_counts_per_turn);
  }
  complaints.take(settings.render);
  try {
    twocone::check(settings.drive);
  } catch (const std::invalid_argument& e) {
    complaints.add("drive: {}", e.what());
  }
  complaints.raise("WorldSettings");
}

Result<std::unique_ptr<Simulation>> make_simulation(const WorldSettings& settings, Scene scene,
                                                    std::unique_ptr<Renderer> renderer) {
  check(settings);
  auto robot = scene.object(settings.robot_name);
  if (!robot) return robot.error();
  auto shared = std::make_shared<Shared>(settings, std::move(scene), std::move(*robot), std::move(renderer));
  return std::unique_ptr<Simulation>(std::make_unique<PovraySimulation>(std::move(shared)));
}

Result<std::unique_ptr<Simulation>> Simulation::open(const WorldSettings& settings) {
  check(settings);
  auto scene = Scene::read(settings.scene);
  if (!scene) return scene.error();
  // Before the workers are started, and before POV-Ray is missed: a scene can be put right without it.
  if (auto robot = scene->object(settings.robot_name); !robot) return robot.error();
  auto program = find_povray(settings.render.povray);
  if (!program) return program.error();
  try {
    auto renderer = std::make_unique<ProcessRenderer>(Povray(*program, settings.scene, settings.render.timeout),
                                                      settings.render.processes);
    return make_simulation(settings, std::move(*scene), std::move(renderer));
  } catch (const std::system_error& e) {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("{} threads for rendering are not to be had: {}", settings.render.processes, e.what())};
  }
}

}  // namespace twocone::sim_povray
