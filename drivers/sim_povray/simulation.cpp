// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/simulation.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/camera_stage.h"
#include "drivers/sim_povray/hall.h"
#include "drivers/sim_povray/link/client.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

// Far beyond any camera, and far from where a period of the rate or a picture's size would overflow its type.
constexpr double kMinRate_hz = 1e-3;
constexpr double kMaxRate_hz = 1e6;
constexpr int kMaxSide_px = 16384;

/// A served world answers at once; its program may be busy on a loaded machine.
constexpr std::chrono::seconds kAttachTimeout{10};

/// What the cameras, the drive and the truth of one robot share; it lives as long as any of them.
struct Shared {
  std::unique_ptr<Seat> seat;
  SeatSettings settings;

  [[nodiscard]] Timestamp now() const { return {ClockKind::kSimulated, seat->state().now}; }
};

class SimCamera final : public Camera {
 public:
  SimCamera(std::shared_ptr<Shared> shared, Seat::ViewId view, ViewSettings settings)
      : shared_(std::move(shared)), view_(view), view_settings_(std::move(settings)) {}
  ~SimCamera() override { shared_->seat->release_view(view_); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    if (wanted.rate_hz < kMinRate_hz || wanted.rate_hz > kMaxRate_hz) {
      return Error{ErrorCode::kRefused, fmt::format("camera '{}': {} Hz is outside what can be simulated, {} to {} Hz",
                                                    name(), wanted.rate_hz, kMinRate_hz, kMaxRate_hz)};
    }
    if (wanted.width_px > kMaxSide_px || wanted.height_px > kMaxSide_px) {
      return Error{ErrorCode::kRefused,
                   fmt::format("camera '{}': {} x {} pixels are more than can be rendered, {} each way", name(),
                               wanted.width_px, wanted.height_px, kMaxSide_px)};
    }
    const double busy_s = view_settings_.effects.exposure_s + view_settings_.effects.readout_s;
    if (busy_s * wanted.rate_hz > 1) {
      return Error{ErrorCode::kRefused, fmt::format("camera '{}': exposure and readout take {} s, which is longer than "
                                                    "a frame at {} Hz",
                                                    name(), busy_s, wanted.rate_hz)};
    }
    if (auto configured = shared_->seat->configure_view(view_, wanted); !configured) return configured.error();
    settings_ = wanted;
    return wanted;
  }

  Status do_start() override {
    // Again, because stopping gave the rate up: the pair may have been set to another one since.
    if (auto configured = shared_->seat->configure_view(view_, settings_); !configured) return configured;
    // What the world did while this camera was off is not lost: it was not looking.
    next_ = unseen_ = std::max(next_, shared_->seat->state().tick);
    late_.reset();
    return {};
  }

  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    const auto deadline = std::chrono::steady_clock::now() + timeout;  // at most kLongestWait: Camera::grab sees to it
    Seat& seat = *shared_->seat;
    while (!late_) {
      if (next_ > seat.state().tick) {
        if (auto stepped = seat.step(deadline); !stepped) return stepped.error();
      }
      const std::uint64_t tick = seat.state().tick;
      next_ = tick + 1;
      if (drops(view_settings_.effects, seed(), name(), tick)) continue;
      const Timestamp captured{ClockKind::kSimulated, seat.state().now - capture_before(view_settings_.effects)};
      Frame frame({tick, captured, tick - unseen_}, picture_of(tick));
      if (!is_late(view_settings_.effects, seed(), name(), tick)) return handed_out(std::move(frame));
      late_ = std::move(frame);
    }
    // It comes with the next instant. If that does not come in time, the frame waits on.
    if (seat.state().tick == late_->header().sequence) {
      if (auto stepped = seat.step(deadline); !stepped) return stepped.error();
    }
    Frame frame = *std::move(late_);
    late_.reset();
    return handed_out(std::move(frame));
  }

  void do_stop() noexcept override { shared_->seat->release_view(view_); }

  std::shared_future<ImageResult> picture_of(std::uint64_t tick) {
    if (const auto& stored = shared_->settings.stored) {
      if (auto image = stored(name(), tick)) {
        std::promise<ImageResult> there;
        there.set_value(std::move(image));
        return there.get_future().share();
      }
    }
    return shared_->seat->picture(view_);
  }

  Frame handed_out(Frame frame) {
    unseen_ = frame.header().sequence + 1;
    return frame;
  }
  [[nodiscard]] const std::string& name() const { return view_settings_.camera_name; }
  [[nodiscard]] std::uint64_t seed() const { return shared_->settings.body.seed; }

  const std::shared_ptr<Shared> shared_;
  const Seat::ViewId view_;
  const ViewSettings view_settings_;
  CameraSettings settings_;
  std::uint64_t next_ = 0;     // the first instant that was not exposed
  std::uint64_t unseen_ = 0;   // the first instant that was not handed out
  std::optional<Frame> late_;  // exposed, and still on its way
};

class SimDrive final : public DiffDrive {
 public:
  explicit SimDrive(std::shared_ptr<Shared> shared)
      : DiffDrive(shared->settings.drive),
        shared_(std::move(shared)),
        left_rad_(shared_->seat->state().left_rad),
        right_rad_(shared_->seat->state().right_rad) {}
  ~SimDrive() override { (void)shared_->seat->halt(); }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override { return shared_->seat->command(speeds); }
  Result<WheelAngles> do_read_angles() override {
    const SeatState& state = shared_->seat->state();
    const int counts = shared_->settings.body.wheels.encoder_counts_per_turn;
    return WheelAngles{shared_->now(), encoder_reading_rad(state.left_rad - left_rad_, counts),
                       encoder_reading_rad(state.right_rad - right_rad_, counts)};
  }
  Status do_stop() noexcept override { return shared_->seat->halt(); }

  const std::shared_ptr<Shared> shared_;
  const double left_rad_, right_rad_;  // when it was opened
};

class SimTruth final : public GroundTruth {
 public:
  explicit SimTruth(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  [[nodiscard]] Pose2 true_pose() const override { return shared_->seat->state().pose; }
  [[nodiscard]] std::string contact() const override { return shared_->seat->state().contact; }

 private:
  const std::shared_ptr<Shared> shared_;
};

class SeatSimulation final : public Simulation {
 public:
  explicit SeatSimulation(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  Result<std::unique_ptr<Camera>> open_camera(const ViewSettings& view) override {
    check(view);
    const auto id = shared_->seat->open_view(view);
    if (!id) return id.error();
    return std::unique_ptr<Camera>(std::make_unique<SimCamera>(shared_, *id, view));
  }
  std::unique_ptr<DiffDrive> open_drive() override { return std::make_unique<SimDrive>(shared_); }
  std::unique_ptr<GroundTruth> open_truth() override { return std::make_unique<SimTruth>(shared_); }

 private:
  std::shared_ptr<Shared> shared_;
};

std::shared_ptr<Shared> shared_of(std::unique_ptr<Seat> seat, const SeatSettings& settings) {
  return std::make_shared<Shared>(Shared{std::move(seat), settings});
}

}  // namespace

std::unique_ptr<Simulation> make_simulation(std::unique_ptr<Seat> seat, const SeatSettings& settings) {
  return std::make_unique<SeatSimulation>(shared_of(std::move(seat), settings));
}

class Venue::Impl {
 public:
  explicit Impl(std::shared_ptr<Hall> hall) : hall_(std::move(hall)) {}

  Result<std::unique_ptr<Simulation>> enter(const SeatSettings& settings) {
    check(settings);
    // The hall would let another robot of the scene in, and the two would wait for each other.
    if (!last_.expired()) {
      return Error{ErrorCode::kRefused,
                   "the venue is not empty: the last robot's simulation, cameras, drive or truth are still there"};
    }
    auto seat = hall_->take_seat(settings);
    if (!seat) return seat.error();
    auto shared = shared_of(*std::move(seat), settings);
    last_ = shared;
    return std::unique_ptr<Simulation>(std::make_unique<SeatSimulation>(std::move(shared)));
  }

 private:
  const std::shared_ptr<Hall> hall_;
  std::weak_ptr<Shared> last_;
};

Venue::Venue(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Venue::~Venue() = default;
Venue::Venue(Venue&&) noexcept = default;
Venue& Venue::operator=(Venue&&) noexcept = default;

Result<Venue> Venue::open(const PlaceSettings& place) {
  auto hall = Hall::open(place);
  if (!hall) return hall.error();
  return Venue(std::make_unique<Impl>(*std::move(hall)));
}

Result<std::unique_ptr<Simulation>> Venue::enter(const SeatSettings& seat) const { return impl_->enter(seat); }

Result<std::unique_ptr<Simulation>> Simulation::open(const PlaceSettings& place, const SeatSettings& seat) {
  check(seat);
  const auto venue = Venue::open(place);
  if (!venue) return venue.error();
  return venue->enter(seat);
}

Result<std::unique_ptr<Simulation>> Simulation::attach(const std::string& name, const SeatSettings& seat) {
  check(seat);
  auto taken = take_remote_seat(name, seat, kAttachTimeout);
  if (!taken) return taken.error();
  return make_simulation(*std::move(taken), seat);
}

}  // namespace twocone::sim_povray
