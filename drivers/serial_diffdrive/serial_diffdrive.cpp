// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/serial_diffdrive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/serial_diffdrive/guard.h"
#include "drivers/serial_diffdrive/protocol.h"
#include "drivers/serial_diffdrive/serial_port.h"
#include "drivers/serial_diffdrive/wheel_counter.h"
#include "hal/clock.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;
using SteadyTime = std::chrono::steady_clock::time_point;

// An Arduino whose port is opened boots for 1 to 2 s.
constexpr milliseconds kGreeting{4'000};
// A controller that came back is greeted a little in each call, so that none takes long.
constexpr milliseconds kGreetingSlice{120};
constexpr milliseconds kBetweenTries{250};
// Wheels that turn by more than this between two readings were not turned by the motors: the counters began anew.
constexpr double kOverspeed = 1.5;
constexpr double kSlack_s = 0.2;
constexpr std::int64_t kSlackCounts = 16;
// A controller that fails so often without a reading in between may have been switched off and on behind a port that
// stayed.
constexpr int kFailuresToGreet = 3;
constexpr milliseconds kSending{20};

SteadyTime now() { return std::chrono::steady_clock::now(); }

/// A controller by itself must be able to stop the wheels in time.
void check_unguarded(const SerialDriveSettings& settings, const DriveLimits& limits) {
  if (settings.guard) return;
  const auto own =
      make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})->own_timeout();
  if (own && *own <= limits.command_timeout) return;
  throw std::invalid_argument(
      fmt::format("SerialDriveSettings: guard is switched off, but the controller's own time-out is {}, longer than "
                  "command_timeout, {} ms",
                  own ? fmt::format("{} ms", own->count()) : "infinite",
                  std::chrono::duration<double, std::milli>(limits.command_timeout).count()));
}

}  // namespace

void check(const SerialDriveSettings& settings) {
  std::string bad;
  if (settings.port.empty()) bad += " port is missing;";
  const auto names = protocol_names();
  if (std::find(names.begin(), names.end(), settings.protocol) == names.end()) {
    bad += fmt::format(" protocol is '{}', must be one of {};", settings.protocol, fmt::join(names, ", "));
  } else {
    const auto fixed = make_protocol({.name = settings.protocol})->fixed_counts_per_turn();
    if (!fixed && !settings.counts_per_turn) {
      bad += fmt::format(" counts_per_turn is missing, protocol {} needs it;", settings.protocol);
    }
    if (!settings.guard && settings.protocol != "roboclaw") {
      bad += fmt::format(
          " guard is switched off, but a controller of protocol {} does not stop the wheels in time by "
          "itself;",
          settings.protocol);
    }
  }
  if (settings.baud && *settings.baud <= 0) bad += fmt::format(" baud is {}, must be > 0;", *settings.baud);
  if (settings.counts_per_turn && !(*settings.counts_per_turn > 0 && std::isfinite(*settings.counts_per_turn))) {
    bad += fmt::format(" counts_per_turn is {}, must be > 0 and finite;", *settings.counts_per_turn);
  }
  if (settings.address < 0x80 || settings.address > 0x87) {
    bad += fmt::format(" address is {}, must be 128 to 135;", settings.address);
  }
  if (!bad.empty()) throw std::invalid_argument("SerialDriveSettings:" + bad);
}

class SerialDiffDrive::Impl {
 public:
  Impl(const SerialDriveSettings& settings, const DriveLimits& limits, Connect connect)
      : settings_(settings),
        limits_(limits),
        connect_(std::move(connect)),
        protocol_(make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})),
        counter_(protocol_->counter_bits()) {
    facts_.device = fmt::format("{} at {} baud", settings.port, settings.baud.value_or(protocol_->usual_baud()));
    facts_.counts_per_turn = settings.counts_per_turn.value_or(protocol_->fixed_counts_per_turn().value_or(0));
  }

  ~Impl() {
    static_cast<void>(stop());
    guard_.reset();
  }

  Status open() {
    if (auto there = plug_in(); !there) return there;
    return greet(kGreeting);
  }

  Status set_speeds(const WheelSpeeds& speeds) {
    if (auto there = connected(); !there) return there;
    if (speeds.left_radps == 0 && speeds.right_radps == 0) return rest();
    // The guard first: were this program to hang in between, it would know.
    if (auto told = tell_guard(true); !told) return told;
    moves_until_ = now() + limits_.command_timeout;
    const double per_rad = facts_.counts_per_turn / (2 * std::numbers::pi);
    return finish(protocol_->drive(*wire_, to_controller({speeds.left_radps * per_rad, speeds.right_radps * per_rad})));
  }

  Result<WheelAngles> read_angles() {
    if (auto there = connected(); !there) return there.error();
    if (auto rests = keep_dead_man_rule(); !rests) return rests.error();
    const SteadyTime asked = now();
    auto counts = protocol_->read_counts(*wire_);
    if (counts && !follows(*counts)) counts = ask_again(*counts);
    if (!counts) return finish(counts.error()).error();
    failures_ = 0;
    counter_.advance(*counts);
    const SteadyTime answered = now();
    read_at_ = answered;
    const WheelCounts total = from_controller(counter_.total());
    const double rad = 2 * std::numbers::pi / facts_.counts_per_turn;
    return WheelAngles{Timestamp{ClockKind::kSteady, (asked + (answered - asked) / 2).time_since_epoch()},
                       double(total.left) * rad, double(total.right) * rad};
  }

  Status stop() noexcept {
    try {
      if (greeted_) return set_speeds({});
      say_stop();
      return lost_;
    } catch (const std::exception&) {  // no memory for a message: the guard and the dead-man rule are left
      return Error{ErrorCode::kUnavailable, {}};
    }
  }

  [[nodiscard]] DriveFacts tell() const {
    DriveFacts facts = facts_;
    facts.is_guarded = guard_ != nullptr;
    return facts;
  }

 private:
  /// Opens the port.
  Status plug_in() {
    auto connection = connect_();
    if (!connection) return connection.error();
    wire_ = std::move(connection->wire);
    descriptor_ = connection->descriptor;
    greet_until_ = now() + kGreeting;
    return {};
  }

  Status greet(milliseconds time) {
    auto version = protocol_->greet(*wire_, now() + time);
    if (!version) return version.error();
    // Another program may have left them turning.
    if (auto rests = protocol_->drive(*wire_, {}); !rests) return rests;
    facts_.controller = *version;
    facts_.own_timeout = protocol_->own_timeout();
    if (settings_.guard) {
      auto guard = Guard::post(descriptor_, protocol_->stop_bytes(), limits_.command_timeout);
      if (!guard) return guard.error();
      guard_ = *std::move(guard);
    }
    counter_.rebase();
    read_at_.reset();
    failures_ = 0;
    greeted_ = true;
    return {};
  }

  /// Ready for a command; if not, a step is made on the way back.
  Status connected() {
    if (greeted_) return {};
    if (!wire_) {
      if (now() < next_try_) return lost_;
      next_try_ = now() + kBetweenTries;
      if (auto there = plug_in(); !there) return lost_;
    }
    if (auto said = greet(kGreetingSlice); !said) {
      if (said.error().code == ErrorCode::kDisconnected || now() >= greet_until_) lose();
      return lost_;
    }
    return {};
  }

  Status rest() {
    auto rests = finish(protocol_->drive(*wire_, {}));
    if (!rests) return rests;
    moves_until_.reset();
    // Where nothing tells that the stop arrived, the guard says it again after each time-out.
    return protocol_->answers_commands() ? tell_guard(false) : Status{};
  }

  Status tell_guard(bool moves) {
    if (!guard_) return {};
    auto told = guard_->command(moves);
    if (!told) lose();
    return told;
  }

  /// Stops the wheels of whatever is at the port, without waiting for an answer.
  void say_stop() {
    if (wire_) static_cast<void>(wire_->write(protocol_->stop_bytes(), now() + kSending));
  }

  /// Gives the port up.
  void lose() {
    forget();
    wire_.reset();
    next_try_ = now() + kBetweenTries;
    lost_ = Error{ErrorCode::kDisconnected, fmt::format("{} went away; it is looked for", settings_.port)};
  }

  /// The port is there, but what is behind it must be set up again.
  void begin_anew(const std::string& why) {
    forget();
    greet_until_ = now() + kGreeting;
    lost_ = Error{ErrorCode::kDisconnected, fmt::format("the controller at {} {}", settings_.port, why)};
  }

  /// Stops the wheels if that still can be, as the guard does once more when it is sent away.
  void forget() {
    greeted_ = false;
    say_stop();
    guard_.reset();
    moves_until_.reset();
    failures_ = 0;
  }

  Status finish(Status status) {
    if (status || !greeted_) return status;
    if (status.error().code == ErrorCode::kDisconnected) {
      lose();
    } else if (status.error().code != ErrorCode::kRefused && ++failures_ >= kFailuresToGreet) {
      begin_anew("does not answer");
      return lost_;
    }
    return status;
  }

  /// Without a guard it is here that wheels stop whose program reads, but does not command: a controller may take any
  /// question for a sign of life.
  Status keep_dead_man_rule() {
    if (!moves_until_ || now() < *moves_until_) return {};
    return rest();
  }

  /// Whether motors can have turned the wheels so far in that time.
  [[nodiscard]] bool is_possible(const WheelCounts& step, SteadyTime::duration time) const {
    const double time_s = std::chrono::duration<double>(time).count() + kSlack_s;
    const double most = kOverspeed * limits_.max_speed_radps * time_s * facts_.counts_per_turn / (2 * std::numbers::pi);
    return double(std::max(std::abs(step.left), std::abs(step.right))) <= most + kSlackCounts;
  }
  [[nodiscard]] bool follows(const RawCounts& raw) const {
    return !read_at_ || is_possible(counter_.step_to(raw), now() - *read_at_);
  }

  /// A jump is a disturbed answer, unless it is told twice: then the board began anew.
  Result<RawCounts> ask_again(const RawCounts& first) {
    const SteadyTime asked = now();
    auto second = protocol_->read_counts(*wire_);
    if (!second || follows(*second)) return second;
    WheelCounter between(protocol_->counter_bits());
    between.advance(first);
    if (!is_possible(between.step_to(*second), now() - asked)) {
      return Error{ErrorCode::kBadData, "two readings of the counters that contradict each other"};
    }
    begin_anew("was reset: its counters began anew");
    return lost_.error();
  }

  [[nodiscard]] CountRates to_controller(CountRates rates) const {
    if (settings_.reverse_left) rates.left = -rates.left;
    if (settings_.reverse_right) rates.right = -rates.right;
    if (settings_.swap_wheels) std::swap(rates.left, rates.right);
    return rates;
  }
  [[nodiscard]] WheelCounts from_controller(WheelCounts counts) const {
    if (settings_.swap_wheels) std::swap(counts.left, counts.right);
    if (settings_.reverse_left) counts.left = -counts.left;
    if (settings_.reverse_right) counts.right = -counts.right;
    return counts;
  }

  const SerialDriveSettings settings_;
  const DriveLimits limits_;
  const Connect connect_;
  const std::unique_ptr<Protocol> protocol_;
  DriveFacts facts_;
  WheelCounter counter_;
  // Of a connection.
  std::unique_ptr<Wire> wire_;
  int descriptor_ = -1;
  std::unique_ptr<Guard> guard_;
  bool greeted_ = false;
  int failures_ = 0;  // since the last reading
  SteadyTime greet_until_;
  std::optional<SteadyTime> moves_until_;
  std::optional<SteadyTime> read_at_;
  // Of none.
  SteadyTime next_try_;
  Status lost_ = Error{ErrorCode::kDisconnected, "the controller was not found yet"};
};

SerialDiffDrive::SerialDiffDrive(const DriveLimits& limits, std::unique_ptr<Impl> impl)
    : DiffDrive(limits), impl_(std::move(impl)) {}
SerialDiffDrive::~SerialDiffDrive() = default;

Result<std::unique_ptr<SerialDiffDrive>> SerialDiffDrive::open(const SerialDriveSettings& settings,
                                                               const DriveLimits& limits) {
  check(settings);
  const int baud = settings.baud.value_or(make_protocol({.name = settings.protocol})->usual_baud());
  return open(settings, limits, [path = settings.port, baud]() -> Result<Connection> {
    auto port = SerialPort::open(path, baud);
    if (!port) return port.error();
    const int descriptor = (*port)->descriptor();
    return Connection{*std::move(port), descriptor};
  });
}

Result<std::unique_ptr<SerialDiffDrive>> SerialDiffDrive::open(const SerialDriveSettings& settings,
                                                               const DriveLimits& limits, Connect connect) {
  check(settings);
  twocone::check(limits);
  check_unguarded(settings, limits);
  auto impl = std::make_unique<Impl>(settings, limits, std::move(connect));
  if (auto opened = impl->open(); !opened) return opened.error();
  return std::unique_ptr<SerialDiffDrive>(new SerialDiffDrive(limits, std::move(impl)));
}

Status SerialDiffDrive::do_set_speeds(const WheelSpeeds& speeds) { return impl_->set_speeds(speeds); }
Result<WheelAngles> SerialDiffDrive::do_read_angles() { return impl_->read_angles(); }
Status SerialDiffDrive::do_stop() noexcept { return impl_->stop(); }
DriveFacts SerialDiffDrive::do_tell() const { return impl_->tell(); }

}  // namespace twocone::serial
