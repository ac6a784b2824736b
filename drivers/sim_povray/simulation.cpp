// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/simulation.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>
#include <utility>

#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/server/server.h"
#include "drivers/sim_povray/simulation_host.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {

/// State that the cameras, the drive and the truth of one robot share. It lives as long as any of them.
struct SharedSession {
  std::unique_ptr<RobotSession> session;
  SessionSettings settings;
};

namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

// Limits far beyond any camera. Within them, no period of the rate overflows its type.
constexpr double kMinRate_hz = 1e-3;
constexpr double kMaxRate_hz = 1e6;

/// A served world answers immediately, but its program may be slow on a loaded machine.
constexpr std::chrono::seconds kAttachTimeout{10};

class SimCamera final : public Camera {
 public:
  SimCamera(std::shared_ptr<SharedSession> shared, RobotSession::ViewId view, ViewSettings settings)
      : shared_(std::move(shared)), view_(view), view_settings_(std::move(settings)) {}
  ~SimCamera() override { shared_->session->release_view(view_); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    if (wanted.rate_hz < kMinRate_hz || wanted.rate_hz > kMaxRate_hz) {
      return Error(ErrorCode::kRefused, "camera '{}': {} Hz is outside what can be simulated, {} to {} Hz", name(),
                   wanted.rate_hz, kMinRate_hz, kMaxRate_hz);
    }
    if (wanted.width_px > kMaxSide_px || wanted.height_px > kMaxSide_px) {
      return Error(ErrorCode::kRefused, "camera '{}': {} x {} pixels are more than can be rendered, {} each way",
                   name(), wanted.width_px, wanted.height_px, kMaxSide_px);
    }
    const double busy_s = view_settings_.effects.exposure_time_s + view_settings_.effects.readout_s;
    if (busy_s * wanted.rate_hz > 1) {
      return Error(ErrorCode::kRefused,
                   "camera '{}': exposure and readout take {} s, which is longer than a frame at {} Hz", name(), busy_s,
                   wanted.rate_hz);
    }
    if (auto configured = shared_->session->configure_view(view_, wanted); !configured) return configured.error();
    settings_ = wanted;
    return wanted;
  }

  Status do_start() override {
    // The view is configured again, because stopping released the rate, and the pair may have another rate since.
    if (auto configured = shared_->session->configure_view(view_, settings_); !configured) return configured;
    // Steps that passed while this camera was off do not count as lost: it was not capturing.
    next_ = unseen_ = std::max(next_, shared_->session->state().step);
    late_.reset();
    return {};
  }

  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    const auto deadline = std::chrono::steady_clock::now() + timeout;  // Camera::grab limits it to kLongestWait
    RobotSession& session = *shared_->session;
    while (!late_) {
      if (next_ > session.state().step) {
        if (auto stepped = session.step(deadline); !stepped) return stepped.error();
      }
      const std::uint64_t step = session.state().step;
      next_ = step + 1;
      if (drops(view_settings_.effects, seed(), name(), step)) continue;
      const Timestamp captured{ClockKind::kSimulated, session.state().now - capture_before(view_settings_.effects)};
      Frame frame({step, captured, step - unseen_}, image_of(step));
      if (!is_late(view_settings_.effects, seed(), name(), step)) return handed_out(std::move(frame));
      late_ = std::move(frame);
    }
    // The late frame arrives with the next step. If that step does not come in time, the frame stays stored.
    if (session.state().step == late_->header().sequence) {
      if (auto stepped = session.step(deadline); !stepped) return stepped.error();
    }
    Frame frame = *std::move(late_);
    late_.reset();
    return handed_out(std::move(frame));
  }

  void do_stop() noexcept override { shared_->session->release_view(view_); }

  std::shared_future<ImageResult> image_of(std::uint64_t step) {
    if (const auto& stored = shared_->settings.stored) {
      if (auto image = stored(name(), step)) return ready_image(std::move(image));
    }
    return shared_->session->image(view_);
  }

  Frame handed_out(Frame frame) {
    unseen_ = frame.header().sequence + 1;
    return frame;
  }
  [[nodiscard]] const std::string& name() const { return view_settings_.camera_name; }
  [[nodiscard]] std::uint64_t seed() const { return shared_->settings.body.seed; }

  const std::shared_ptr<SharedSession> shared_;
  const RobotSession::ViewId view_;
  const ViewSettings view_settings_;
  CameraSettings settings_;
  std::uint64_t next_ = 0;     // the first step that was not captured
  std::uint64_t unseen_ = 0;   // the first step that was not handed out
  std::optional<Frame> late_;  // captured, but not yet handed out
};

class SimDrive final : public DiffDrive {
 public:
  explicit SimDrive(std::shared_ptr<SharedSession> shared)
      : DiffDrive(shared->settings.drive),
        shared_(std::move(shared)),
        left_rad_(shared_->session->state().left_rad),
        right_rad_(shared_->session->state().right_rad) {}
  ~SimDrive() override { (void)shared_->session->halt(); }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override { return shared_->session->command(speeds); }
  Result<WheelAngles> do_read_angles() override {
    const SessionState& state = shared_->session->state();
    const int counts = shared_->settings.body.wheels.encoder_counts_per_turn;
    return WheelAngles{{ClockKind::kSimulated, state.now},
                       encoder_reading_rad(state.left_rad - left_rad_, counts),
                       encoder_reading_rad(state.right_rad - right_rad_, counts)};
  }
  Status do_stop() noexcept override { return shared_->session->halt(); }

  const std::shared_ptr<SharedSession> shared_;
  const double left_rad_, right_rad_;  // angles at which the drive was opened
};

class SimTruth final : public GroundTruth {
 public:
  explicit SimTruth(std::shared_ptr<SharedSession> shared) : shared_(std::move(shared)) {}
  [[nodiscard]] Pose2 true_pose() const override { return shared_->session->state().pose; }
  [[nodiscard]] std::string contact() const override { return shared_->session->state().contact; }

 private:
  const std::shared_ptr<SharedSession> shared_;
};

}  // namespace

Simulation::Simulation(std::unique_ptr<RobotSession> session, const SessionSettings& settings)
    : shared_(std::make_shared<SharedSession>(SharedSession{std::move(session), settings})) {}

Result<std::unique_ptr<Camera>> Simulation::open_camera(const ViewSettings& view) {
  check(view);
  const auto id = shared_->session->open_view(view);
  if (!id) return id.error();
  return std::unique_ptr<Camera>(std::make_unique<SimCamera>(shared_, *id, view));
}

std::unique_ptr<DiffDrive> Simulation::open_drive() { return std::make_unique<SimDrive>(shared_); }

std::unique_ptr<GroundTruth> Simulation::open_truth() { return std::make_unique<SimTruth>(shared_); }

Result<std::unique_ptr<Simulation>> Simulation::open(const PlaceSettings& place, const SessionSettings& session) {
  check(session);
  const auto host = SimulationHost::open(place);
  if (!host) return host.error();
  return join(**host, session);
}

Result<std::unique_ptr<Simulation>> Simulation::join(SimulationHost& host, const SessionSettings& session) {
  auto joined = host.join(session);
  if (!joined) return joined.error();
  return std::unique_ptr<Simulation>(new Simulation(*std::move(joined), session));
}

Result<std::unique_ptr<Simulation>> Simulation::attach(const std::string& name, const SessionSettings& session) {
  check(session);
  auto joined = join_served_world(name, session, kAttachTimeout);
  if (!joined) return joined.error();
  return std::unique_ptr<Simulation>(new Simulation(*std::move(joined), session));
}

}  // namespace twocone::sim_povray
