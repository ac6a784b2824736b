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
#include "drivers/serial_diffdrive/listening_wire.h"
#include "drivers/serial_diffdrive/protocol.h"
#include "drivers/serial_diffdrive/serial_port.h"
#include "drivers/serial_diffdrive/wheel_counter.h"
#include "hal/clock.h"
#include "hal/text.h"

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
// The watchdog writes kStopsInARow stops: an exchange that meets each of them is tried once more.
constexpr int kCrossedTries = kStopsInARow + 1;

std::string milliseconds_of(std::chrono::nanoseconds time) {
  return fmt::format("{:g} ms", std::chrono::duration<double, std::milli>(time).count());
}

/// What came where the answers of a controller were expected.
std::string quote(const ListeningWire& heard) {
  const std::string& text = heard.beginning();
  const auto is_text = [](char c) { return (c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == '\t'; };
  if (2 * std::count_if(text.begin(), text.end(), is_text) < std::ssize(text)) {
    std::string bytes;
    for (const char c : text.substr(0, 16)) bytes += fmt::format(" {:02X}", std::uint8_t(c));
    return fmt::format("{} bytes that are no text, the first{}: another baud or another protocol?", heard.count(),
                       bytes);
  }
  std::string line = text;
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\r' || c == '\n' || c == '\t'; }, ' ');
  return fmt::format("{} bytes, beginning with '{}': another device or another protocol?", heard.count(),
                     printable(line));
}

/// A controller by itself must be able to stop the wheels in time.
void check_unguarded(const SerialDriveSettings& settings, const DriveLimits& limits) {
  if (settings.guard) return;
  const auto own =
      make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})->own_timeout();
  if (own && *own <= limits.command_timeout) return;
  throw std::invalid_argument(
      fmt::format("SerialDriveSettings: guard is switched off, but the controller's own time-out is {}, longer than "
                  "command_timeout, {}",
                  own ? fmt::format("{} ms", own->count()) : "infinite", milliseconds_of(limits.command_timeout)));
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
  if (settings.least_speed_radps && !(*settings.least_speed_radps >= 0 && std::isfinite(*settings.least_speed_radps))) {
    bad += fmt::format(" least_speed_radps is {}, must be >= 0 and finite;", *settings.least_speed_radps);
  }
  if (settings.address < 0x80 || settings.address > 0x87) {
    bad += fmt::format(" address is {}, must be 128 to 135;", settings.address);
  }
  if (!bad.empty()) throw std::invalid_argument("SerialDriveSettings:" + bad);
}

double least_speed_radps(const SerialDriveSettings& settings) {
  const auto protocol = make_protocol({.name = settings.protocol});
  const double counts_per_turn = settings.counts_per_turn.value_or(protocol->fixed_counts_per_turn().value_or(0));
  const double rad = 2 * std::numbers::pi / counts_per_turn;
  return std::max(settings.least_speed_radps.value_or(protocol->usual_least_rate() * rad),
                  protocol->least_command() * rad);
}

class SerialDiffDrive::Impl {
 public:
  Impl(const SerialDriveSettings& settings, const DriveLimits& limits, Machine machine)
      : settings_(settings),
        limits_(limits),
        machine_(std::move(machine)),
        protocol_(make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})),
        counter_(protocol_->counter_bits()) {
    facts_.device = fmt::format("{} at {} baud", settings.port, settings.baud.value_or(protocol_->usual_baud()));
    facts_.counts_per_turn = settings.counts_per_turn.value_or(protocol_->fixed_counts_per_turn().value_or(0));
    least_speed_radps_ = least_speed_radps(settings);
    if (!machine_.post) machine_.post = Guard::post;
    if (!machine_.now) machine_.now = std::chrono::steady_clock::now;
  }

  ~Impl() {
    static_cast<void>(stop());
    watchdog_.reset();
  }

  Status open() {
    if (auto there = plug_in(); !there) return there;
    ListeningWire heard(*wire_);
    Status greeted = greet(heard, kGreeting);
    if (greeted || heard.count() == 0) return greeted;
    const Error& error = greeted.error();
    if (error.code != ErrorCode::kTimeout && error.code != ErrorCode::kBadData) return greeted;
    return Error{ErrorCode::kBadData, fmt::format("{}: no controller of protocol {} answers ({}), but {}",
                                                  settings_.port, settings_.protocol, error.message, quote(heard))};
  }

  Status set_speeds(const WheelSpeeds& speeds) {
    if (auto there = connected(); !there) return there;
    if (speeds.left_radps == 0 && speeds.right_radps == 0) return rest();
    const double faster = std::max(std::abs(speeds.left_radps), std::abs(speeds.right_radps));
    if (faster < least_speed_radps_) {
      if (auto rests = rest(); !rests) return rests;
      return Error{ErrorCode::kRefused, fmt::format("{:.3g} rad/s is too slow for the controller at {}, which turns no "
                                                    "wheel slower than {:.3g} rad/s; the wheels rest",
                                                    faster, settings_.port, least_speed_radps_)};
    }
    const SteadyTime told = now();
    // The watchdog first: were this program to hang in between, it would know.
    if (watchdog_) {
      if (auto told_it = watchdog_->expect_motion(); !told_it) return replace_watchdog(told_it.error());
    }
    const std::uint32_t stops = count_stops();
    moves_until_ = told + limits_.command_timeout;
    const double per_rad = facts_.counts_per_turn / (2 * std::numbers::pi);
    const Status driven =
        protocol_->drive(*wire_, to_controller({speeds.left_radps * per_rad, speeds.right_radps * per_rad}));
    if (!driven) return finish(with_stop(driven.error()));
    if (was_crossed_since(stops) && now() >= *moves_until_) return held_up(now() - told);
    if (watchdog_) {
      if (auto heard = watchdog_->is_heard(); !heard) return replace_watchdog(heard.error());
    }
    return {};
  }

  Result<WheelAngles> read_angles() {
    if (auto there = connected(); !there) return there.error();
    if (auto rests = keep_dead_man_rule(); !rests) return rests.error();
    SteadyTime asked;
    auto counts = read_counts(asked);
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
    facts.is_guarded = watchdog_ != nullptr;
    return facts;
  }

 private:
  [[nodiscard]] SteadyTime now() const { return machine_.now(); }

  /// Opens the port.
  Status plug_in() {
    auto connection = machine_.connect();
    if (!connection) return connection.error();
    wire_ = std::move(connection->wire);
    descriptor_ = connection->descriptor;
    greet_until_ = now() + kGreeting;
    return {};
  }

  Status greet(Wire& wire, milliseconds time) {
    count_stops();
    auto version = protocol_->greet(wire, now() + time);
    if (!version) return version.error();
    // Another program may have left them turning.
    if (auto rests = protocol_->drive(wire, {}); !rests) return rests;
    facts_.controller = *version;
    facts_.own_timeout = protocol_->own_timeout();
    if (settings_.guard) {
      if (!watchdog_) {
        if (auto posted = post_watchdog(); !posted) return posted;
      }
      if (protocol_->answers_commands()) {
        if (auto told = watchdog_->expect_rest(); !told) return replace_watchdog(told.error());
      }
    }
    counter_.rebase();
    read_at_.reset();
    moves_until_.reset();
    failures_ = 0;
    greeted_ = true;
    return {};
  }

  Status post_watchdog() {
    auto watchdog = machine_.post(descriptor_, protocol_->stop_bytes(), limits_.command_timeout);
    if (!watchdog) return watchdog.error();
    watchdog_ = *std::move(watchdog);
    stops_noted_ = 0;
    return {};
  }

  /// Whatever the watchdog writes is answered, too: the protocol is told. Returns how many stops it has written.
  std::uint32_t count_stops() {
    if (!watchdog_) return 0;
    const std::uint32_t written = watchdog_->stops_done();
    const std::uint32_t begun = watchdog_->stops_begun();
    protocol_->note_stops(begun - std::exchange(stops_noted_, begun));
    return written;
  }
  /// @param stops what count_stops() returned then
  bool was_crossed_since(std::uint32_t stops) {
    count_stops();
    return watchdog_ && watchdog_->stops_begun() != stops;
  }

  /// Ready for a command; if not, a step is made on the way back.
  Status connected() {
    if (greeted_) return {};
    if (!wire_) {
      if (now() < next_try_) return lost_;
      next_try_ = now() + kBetweenTries;
      if (auto there = plug_in(); !there) return lost_;
    }
    if (auto said = greet(*wire_, kGreetingSlice); !said) {
      if (said.error().code == ErrorCode::kDisconnected || now() >= greet_until_) lose();
      return lost_;
    }
    return {};
  }

  /// An answer that is the watchdog's, and not the program's, says the same: the wheels were stopped. A failure among
  /// its stops says nothing.
  Status rest() {
    Status rests;
    for (int i = 0; i < kCrossedTries; ++i) {
      const std::uint32_t stops = count_stops();
      rests = protocol_->drive(*wire_, {});
      if (rests || !was_crossed_since(stops)) break;
    }
    if (!rests) return finish(rests);
    moves_until_.reset();
    // Where nothing tells that the stop arrived, the watchdog says it again after each time-out.
    if (watchdog_ && protocol_->answers_commands()) {
      if (auto told = watchdog_->expect_rest(); !told) return replace_watchdog(told.error());
    }
    return {};
  }

  /// A command that moves failed, and may have been carried out all the same.
  Error with_stop(const Error& error) {
    if (error.code == ErrorCode::kDisconnected) return error;
    say_stop();
    return {error.code, error.message + "; a stop was sent after it"};
  }

  /// The program did not run for so long during a command that the watchdog stopped the wheels: before the command came
  /// to the controller or after it, nobody knows.
  Error held_up(SteadyTime::duration time) {
    const auto rests = rest();
    return {ErrorCode::kTimeout,
            fmt::format(
                "the command took {:.0f} ms, longer than command_timeout: the watchdog stopped the wheels meanwhile, "
                "and {}",
                std::chrono::duration<double, std::milli>(time).count(),
                rests ? "they rest now" : "a stop was sent again: " + rests.error().message)};
  }

  /// Without a watchdog the wheels must not turn.
  Error replace_watchdog(const Error& why) {
    say_stop();
    watchdog_->kill();
    count_stops();
    watchdog_.reset();
    if (auto rests = rest(); !rests) say_stop();
    auto posted = greeted_ ? post_watchdog() : Status{};
    if (!posted) lose();
    return {ErrorCode::kUnavailable,
            fmt::format(
                "{}; the wheels were stopped, and {}", why.message,
                posted ? "another watchdog is posted" : "no other watchdog can be posted: " + posted.error().message)};
  }

  /// The drive's two readings of one call must both be answers to their own questions.
  Result<RawCounts> read_counts(SteadyTime& asked) {
    for (int i = 0; i < kCrossedTries; ++i) {
      const std::uint32_t stops = count_stops();
      asked = now();
      auto counts = protocol_->read_counts(*wire_);
      if (!was_crossed_since(stops)) return counts;
    }
    if (auto awake = watchdog_->settle(); !awake) return replace_watchdog(awake.error());
    return Error{ErrorCode::kTimeout, "the watchdog's stops came between each question and its answer"};
  }

  /// Stops the wheels of whatever is at the port, without waiting for an answer.
  void say_stop() {
    if (!wire_) return;
    if (wire_->write(protocol_->stop_bytes(), now() + kSending)) protocol_->note_stops(1);
  }

  /// Gives the port up.
  void lose() {
    forget();
    watchdog_.reset();
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

  /// Stops the wheels if that still can be; until the controller is greeted, the watchdog says it after each time-out.
  void forget() {
    greeted_ = false;
    say_stop();
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
    SteadyTime asked = now();
    const SteadyTime begun = asked;
    auto second = read_counts(asked);
    if (!second || follows(*second)) return second;
    WheelCounter between(protocol_->counter_bits());
    between.advance(first);
    if (!is_possible(between.step_to(*second), now() - begun)) {
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
  Machine machine_;
  const std::unique_ptr<Protocol> protocol_;
  DriveFacts facts_;
  double least_speed_radps_ = 0;
  WheelCounter counter_;
  // Of a connection.
  std::unique_ptr<Wire> wire_;
  int descriptor_ = -1;
  std::unique_ptr<Watchdog> watchdog_;
  std::uint32_t stops_noted_ = 0;  // of this watchdog's, those that the protocol was told of
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
  const Connect connect = [path = settings.port, baud]() -> Result<Connection> {
    auto port = SerialPort::open(path, baud);
    if (!port) return port.error();
    const int descriptor = (*port)->descriptor();
    return Connection{*std::move(port), descriptor};
  };
  return open(settings, limits, connect);
}

Result<std::unique_ptr<SerialDiffDrive>> SerialDiffDrive::open(const SerialDriveSettings& settings,
                                                               const DriveLimits& limits, Connect connect) {
  return open(settings, limits, Machine{std::move(connect), {}, {}});
}

Result<std::unique_ptr<SerialDiffDrive>> SerialDiffDrive::open(const SerialDriveSettings& settings,
                                                               const DriveLimits& limits, Machine machine) {
  check(settings);
  twocone::check(limits);
  check_unguarded(settings, limits);
  auto impl = std::make_unique<Impl>(settings, limits, std::move(machine));
  if (auto opened = impl->open(); !opened) return opened.error();
  return std::unique_ptr<SerialDiffDrive>(new SerialDiffDrive(limits, std::move(impl)));
}

Status SerialDiffDrive::do_set_speeds(const WheelSpeeds& speeds) { return impl_->set_speeds(speeds); }
Result<WheelAngles> SerialDiffDrive::do_read_angles() { return impl_->read_angles(); }
Status SerialDiffDrive::do_stop() noexcept { return impl_->stop(); }
DriveFacts SerialDiffDrive::do_tell() const { return impl_->tell(); }

}  // namespace twocone::serial
