// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/doctor.h"
#include "apps/doctor/report.h"
#include "hal/camera.h"
#include "hal/clock.h"
#include "hal/diff_drive.h"

/// Devices with one fault each. Only they and the doctor's waiting advance the time.
namespace twocone::doctor {

inline std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::int64_t(std::llround(1e9 * seconds)));
}

/// The doctor's surroundings, with a user who gives the answers of the test.
struct FakeSurroundings {
  std::shared_ptr<ManualClock> clock = std::make_shared<ManualClock>(ClockKind::kSteady);
  std::atomic<bool> stop{false};
  std::vector<std::string> asked;
  std::function<std::optional<std::string>(const std::string&)> person;  ///< empty: there is no user
  std::function<void()> at_each_sleep = [] {};

  [[nodiscard]] Surroundings surroundings() {
    Surroundings s{.clock = *clock,
                   .sleep =
                       [this](std::chrono::nanoseconds time) {
                         clock->advance(time);
                         at_each_sleep();
                       },
                   .stop = stop};
    if (person) {
      s.ask = [this](const std::string& question) {
        asked.push_back(question);
        return person(question);
      };
    }
    return s;
  }
};

/// A bright disc before a darker wall, as a camera sees a mirror. The edge is the integral of a Gaussian.
struct Disc {
  double column = 79.5, row = 59.5, radius = 50;
  double sigma_px = 0.4;
  double inside = 150, outside = 60;
};
inline Image image_of(const Disc& disc, int width = 160, int height = 120) {
  Image image{width, height, PixelFormat::kRgb8, {}};
  std::vector<std::uint8_t> bytes;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const double out = std::hypot(column - disc.column, row - disc.row) - disc.radius;
      const double share = 0.5 * std::erfc(out / (disc.sigma_px * std::numbers::sqrt2));
      const auto grey = std::uint8_t(std::lround(disc.outside + (disc.inside - disc.outside) * share));
      bytes.insert(bytes.end(), 3, grey);
    }
  }
  image.bytes = std::move(bytes);
  return image;
}

/// The true behaviour of a camera.
struct CameraTruth {
  double rate_hz = 25;
  double reported_rate_hz = 0;                                     ///< 0: the requested rate
  int narrower_px = 0;                                             ///< than requested
  double phase_s = 0;                                              ///< of its exposures
  double age_s = 0.01;                                             ///< of a frame when it is delivered
  double jitter_s = 0;                                             ///< delay of every fourth exposure
  std::uint64_t lose_every = 0, skip_every = 0, damage_every = 0;  ///< 0: never
  std::uint64_t dies_after = std::numeric_limits<std::uint64_t>::max();
  Error death{ErrorCode::kDisconnected, "the cable is out"};
  bool stands_still = false;  ///< its capture times do not advance after a second
  std::vector<std::pair<std::string, double>> controls{};
  Image image = image_of({});
  Status started{};
};

class BenchCamera final : public Camera {
 public:
  BenchCamera(std::shared_ptr<ManualClock> clock, CameraTruth truth, std::shared_ptr<int> streams = nullptr)
      : clock_(std::move(clock)), truth_(std::move(truth)), streams_(std::move(streams)) {}
  ~BenchCamera() override { stop(); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    CameraSettings got = wanted;
    got.width_px -= truth_.narrower_px;
    if (truth_.reported_rate_hz > 0) got.rate_hz = truth_.reported_rate_hz;
    return got;
  }
  Status do_start() override {
    if (!truth_.started) return truth_.started;
    if (streams_) ++*streams_;
    next_ = std::uint64_t(clock_->now().seconds() * truth_.rate_hz) + 1;
    return {};
  }
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    if (grabs_++ >= truth_.dies_after) {
      if (truth_.death.code == ErrorCode::kTimeout) clock_->advance(timeout);
      return truth_.death;
    }
    const auto due = [this](std::uint64_t every) { return every > 0 && next_ % every == 0; };
    if (due(truth_.damage_every)) {
      ++next_;
      return Error{ErrorCode::kBadData, "half a frame"};
    }
    Frame::Header header;
    if (due(truth_.lose_every)) {
      ++next_;
      header.lost_before = 1;
    } else if (due(truth_.skip_every)) {
      ++next_;
      header.lost_before = header.skipped_before = 1;
    }
    header.sequence = next_;
    double at_s = double(next_) / truth_.rate_hz + truth_.phase_s + (next_ % 4 == 0 ? truth_.jitter_s : 0);
    ++next_;
    const double now_s = clock_->now().seconds();
    if (at_s + truth_.age_s > now_s) clock_->advance(to_nanoseconds(at_s + truth_.age_s - now_s));
    if (truth_.stands_still) at_s = std::min(at_s, 1.0);
    header.captured = {ClockKind::kSteady, to_nanoseconds(at_s)};
    return Frame(header, truth_.image);
  }
  void do_stop() noexcept override {
    if (streams_) --*streams_;
  }
  void do_facts(CameraFacts& facts) const override {
    facts.device = "bench (/dev/video9)";
    facts.format = "YUYV";
    facts.controls = truth_.controls;
  }

  std::shared_ptr<ManualClock> clock_;
  CameraTruth truth_;
  std::shared_ptr<int> streams_;
  std::uint64_t next_ = 0;
  std::uint64_t grabs_ = 0;
};

/// The true behaviour of a drive.
struct DriveTruth {
  DriveLimits limits{10, std::chrono::milliseconds(500)};
  double counts_per_turn = 1000;
  bool motors_crossed = false, encoders_crossed = false;
  bool left_motor_backward = false, left_encoder_backward = false;
  bool left_encoder_dead = false, both_turn = false;
  double speed_factor = 1;
  double least_radps = 0;        ///< a slower command turns no wheel
  double creep_radps = 0;        ///< without any command
  double stop_takes_s = 0.02;    ///< after stop()
  double silence_takes_s = 0.5;  ///< after the last command
  double read_takes_s = 0.004;
  std::uint64_t silent_after = std::numeric_limits<std::uint64_t>::max();  ///< number of calls
  std::uint64_t lose_every = 0;                                            ///< of readings; 0: never
  std::optional<std::chrono::milliseconds> own_timeout{400};
  bool has_watchdog = true;
};

/// The commands to the wheels; outlives the drive.
struct WheelLog {
  int moves = 0;  ///< commands other than stop
  int stops = 0;
  bool turn = false;  ///< according to the last command
};

class BenchDrive final : public DiffDrive {
 public:
  BenchDrive(std::shared_ptr<ManualClock> clock, const DriveTruth& truth, std::shared_ptr<WheelLog> log)
      : DiffDrive(truth.limits), clock_(std::move(clock)), truth_(truth), log_(std::move(log)) {}

 private:
  [[nodiscard]] double now_s() const { return clock_->now().seconds(); }

  void turn_on() {
    const double now = now_s();
    const double turned_s = std::max(0.0, std::min(now, stops_at_s_) - at_s_);
    for (int i = 0; i < 2; ++i) angle_[i] += speed_[i] * turned_s + truth_.creep_radps * (now - at_s_);
    at_s_ = now;
  }
  bool is_silent() { return calls_++ >= truth_.silent_after; }
  static Error silence() { return {ErrorCode::kTimeout, "no answer"}; }

  Status do_set_speeds(const WheelSpeeds& speeds) override {
    if (is_silent()) return silence();
    turn_on();
    ++log_->moves;
    log_->turn = speeds.left_radps != 0 || speeds.right_radps != 0;
    const auto turned = [this](double speed) {
      return std::abs(speed) < truth_.least_radps ? 0 : speed * truth_.speed_factor;
    };
    double left = turned(speeds.left_radps);
    double right = turned(speeds.right_radps);
    if (truth_.both_turn) left = right = std::max(left, right);
    if (truth_.motors_crossed) std::swap(left, right);
    if (truth_.left_motor_backward) left = -left;
    speed_[0] = left;
    speed_[1] = right;
    stops_at_s_ = now_s() + truth_.silence_takes_s;
    return {};
  }
  Result<WheelAngles> do_read_angles() override {
    clock_->advance(to_nanoseconds(truth_.read_takes_s));
    if (is_silent()) return silence();
    if (truth_.lose_every > 0 && calls_ % truth_.lose_every == 0) return silence();
    turn_on();
    double left = truth_.left_encoder_dead ? 0 : angle_[0];
    double right = angle_[1];
    if (truth_.left_encoder_backward) left = -left;
    if (truth_.encoders_crossed) std::swap(left, right);
    const double count_rad = 2 * std::numbers::pi / truth_.counts_per_turn;
    const auto counted = [count_rad](double angle) { return std::floor(angle / count_rad) * count_rad; };
    return WheelAngles{clock_->now(), counted(left), counted(right)};
  }
  Status do_stop() noexcept override {
    ++log_->stops;
    if (is_silent()) return Error{ErrorCode::kTimeout, {}};
    turn_on();
    log_->turn = false;
    stops_at_s_ = std::min(stops_at_s_, now_s() + truth_.stop_takes_s);
    return {};
  }
  [[nodiscard]] DriveFacts do_facts() const override {
    return {"/dev/ttyBENCH at 57600 baud", "bench 1.2", truth_.counts_per_turn, truth_.own_timeout,
            truth_.has_watchdog};
  }

  std::shared_ptr<ManualClock> clock_;
  DriveTruth truth_;
  std::shared_ptr<WheelLog> log_;
  double at_s_ = 0, stops_at_s_ = 0;
  double speed_[2]{}, angle_[2]{};
  std::uint64_t calls_ = 0;
};

/// Returns the row of that check; a row "no such row" if there is none.
inline Row row_of(const Report& report, const std::string& part, const std::string& check) {
  for (const Row& row : report.rows()) {
    if (row.part == part && row.check == check) return row;
  }
  return {"", "no such row", table(report), kNotRun};
}

inline void PrintTo(const Verdict& verdict, std::ostream* out) { *out << to_string(verdict); }

}  // namespace twocone::doctor
