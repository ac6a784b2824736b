// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/serial_diffdrive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/errors.h"
#include "base/log.h"
#include "drivers/serial_diffdrive/protocol.h"
#include "drivers/serial_diffdrive/transport.h"
#include "drivers/serial_diffdrive/watchdog.h"
#include "hal/clock.h"
#include "hal/device_info.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr base::Logger kLog("serial");

// An Arduino whose port is opened boots for 1 to 2 s.
constexpr milliseconds kGreeting{4'000};
// The handshake with a controller that came back is split over several calls, so that no call takes long.
constexpr milliseconds kGreetingSlice{120};
constexpr milliseconds kBetweenTries{250};
// If the counts of two readings differ by more than the motors could have caused, with this margin, the counters were
// reset.
constexpr double kOverspeed = 1.5;
constexpr double kSlack_s = 0.2;
constexpr std::int64_t kSlackCounts = 16;
// After this many failures without a reading in between, the controller may have been switched off and on while its
// port remained.
constexpr int kFailuresToGreet = 3;
constexpr milliseconds kSending{20};
// The watchdog writes kStopsInARow stops in a row. Each may disturb one try of an exchange; one more try follows.
constexpr int kCrossedTries = kStopsInARow + 1;

/// Describes the bytes that arrived instead of a controller's answers.
std::string quote(const MonitoredTransport& monitor) {
  const std::string& text = monitor.beginning();
  const auto is_space = [](char c) { return c == '\r' || c == '\n' || c == '\t'; };
  const auto is_text = [&](char c) { return (c >= ' ' && c <= '~') || is_space(c); };
  if (2 * std::ranges::count_if(text, is_text) < std::ssize(text)) {
    std::string bytes;
    for (const char c : text.substr(0, 16)) bytes += fmt::format(" {:02X}", std::uint8_t(c));
    return fmt::format("{} bytes that are no text, the first{}: another baud or another protocol?", monitor.count(),
                       bytes);
  }
  std::string line = text;
  std::ranges::replace_if(line, is_space, ' ');
  return fmt::format("{} bytes, beginning with '{}': another device or another protocol?", monitor.count(),
                     printable(line));
}

/// Requires of a drive without a watchdog that the controller itself stops the wheels in time.
void check_without_watchdog(const SerialDriveSettings& settings, const DriveLimits& limits) {
  if (settings.watchdog) return;
  const auto own =
      make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})->own_timeout();
  if (own && *own <= limits.command_timeout) return;
  throw base::InvalidArgument(
      "SerialDriveSettings: watchdog is switched off, but the controller's own time-out is {}, longer than "
      "command_timeout, {:g} ms",
      own ? fmt::format("{} ms", own->count()) : "infinite",
      std::chrono::duration<double, std::milli>(limits.command_timeout).count());
}

class SerialDiffDrive final : public DiffDrive {
 public:
  SerialDiffDrive(const SerialDriveSettings& settings, const DriveLimits& limits, Machine machine)
      : DiffDrive(limits),
        settings_(settings),
        machine_(std::move(machine)),
        protocol_(make_protocol({settings.protocol, std::uint8_t(settings.address), limits.command_timeout})),
        counter_(protocol_->counter_bits()) {
    const int baud = settings.baud.value_or(protocol_->usual_baud());
    facts_.device = fmt::format("{} at {} baud", settings.port, baud);
    facts_.counts_per_turn = settings.counts_per_turn.value_or(protocol_->fixed_counts_per_turn().value_or(0));
    least_speed_radps_ = least_speed_radps(settings);
    if (!machine_.connect) machine_.connect = [path = settings.port, baud] { return open_port(path, baud); };
  }
  ~SerialDiffDrive() override {
    static_cast<void>(stop());
    watchdog_.reset();
  }

  Status open() {
    if (auto there = plug_in(); !there) return there;
    MonitoredTransport monitor(*transport_);
    Status greeted = greet(monitor, kGreeting);
    if (greeted || monitor.count() == 0) return greeted;
    const Error& error = greeted.error();
    if (error.code != ErrorCode::kTimeout && error.code != ErrorCode::kBadData) return greeted;
    return Error(ErrorCode::kBadData, "{}: no controller of protocol {} answers ({}), but {}", settings_.port,
                 settings_.protocol, error.message, quote(monitor));
  }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override {
    if (auto there = connected(); !there) return there;
    if (speeds.left_radps == 0 && speeds.right_radps == 0) return stop_wheels();
    const double faster = std::max(std::abs(speeds.left_radps), std::abs(speeds.right_radps));
    if (faster < least_speed_radps_) {
      if (auto stopped = stop_wheels(); !stopped) return stopped;
      return Error(ErrorCode::kRefused,
                   "{:.3g} rad/s is too slow for the controller at {}, which turns no "
                   "wheel slower than {:.3g} rad/s; the wheels are stopped",
                   faster, settings_.port, least_speed_radps_);
    }
    const SteadyTime begun = now();
    // The watchdog gets its deadline first, so that it stops the wheels if this program hangs after the command.
    if (watchdog_) {
      if (auto expected = watchdog_->expect_motion(); !expected) return replace_watchdog(expected.error());
    }
    const std::uint32_t stops = count_stops();
    moves_until_ = begun + limits().command_timeout;
    const double per_rad = facts_.counts_per_turn / (2 * std::numbers::pi);
    const Status driven =
        protocol_->drive(*transport_, to_controller({speeds.left_radps * per_rad, speeds.right_radps * per_rad}));
    if (!driven) return finish(with_stop(driven.error()));
    if (was_crossed_since(stops) && now() >= *moves_until_) return held_up(now() - begun);
    if (watchdog_) {
      if (auto seen = watchdog_->wait_until_seen(); !seen) return replace_watchdog(seen.error());
    }
    return {};
  }

  Result<WheelAngles> do_read_angles() override {
    if (auto there = connected(); !there) return there.error();
    if (auto kept = keep_dead_man_rule(); !kept) return kept.error();
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

  Status do_stop() noexcept override {
    try {
      if (greeted_) return do_set_speeds({});
      send_stop();
      return lost_;
    } catch (const std::exception&) {  // no memory for a message; the watchdog and the dead-man rule still work
      return Error{ErrorCode::kUnavailable, {}};
    }
  }

  [[nodiscard]] DriveFacts do_facts() const override {
    DriveFacts facts = facts_;
    facts.has_watchdog = watchdog_ != nullptr;
    return facts;
  }

  [[nodiscard]] SteadyTime now() const { return machine_.now(); }

  /// Opens the port.
  Status plug_in() {
    auto connection = machine_.connect();
    if (!connection) return connection.error();
    transport_ = std::move(connection->transport);
    descriptor_ = connection->descriptor;
    greet_until_ = now() + kGreeting;
    return {};
  }

  Status greet(Transport& transport, milliseconds time) {
    count_stops();
    auto version = protocol_->greet(transport, now() + time);
    if (!version) return version.error();
    // Another program may have left the wheels turning.
    if (auto stopped = protocol_->drive(transport, {}); !stopped) return stopped;
    facts_.controller = *version;
    facts_.own_timeout = protocol_->own_timeout();
    if (settings_.watchdog) {
      if (!watchdog_) {
        if (auto posted = post_watchdog(); !posted) return posted;
      }
      if (protocol_->answers_commands()) {
        if (auto expected = watchdog_->expect_stop(); !expected) return replace_watchdog(expected.error());
      }
    }
    counter_.rebase();
    read_at_.reset();
    moves_until_.reset();
    failures_ = 0;
    greeted_ = true;
    kLog.info(settings_.port + ": connected");
    return {};
  }

  Status post_watchdog() {
    auto watchdog = machine_.post(descriptor_, protocol_->stop_bytes(), limits().command_timeout);
    if (!watchdog) return watchdog.error();
    watchdog_ = *std::move(watchdog);
    stops_noted_ = 0;
    return {};
  }

  /// Reports the watchdog's new stops to the protocol, because the controller answers those too. Returns how many stops
  /// the watchdog has written.
  std::uint32_t count_stops() {
    if (!watchdog_) return 0;
    const std::uint32_t written = watchdog_->stops_done();
    const std::uint32_t begun = watchdog_->stops_begun();
    if (begun != stops_noted_) base::Logger("watchdog").warning("no command came in time; the wheels are stopped");
    protocol_->note_stops(begun - std::exchange(stops_noted_, begun));
    return written;
  }
  /// Returns whether the watchdog has written or begun a stop since count_stops() returned `stops`.
  bool was_crossed_since(std::uint32_t stops) {
    count_stops();
    return watchdog_ && watchdog_->stops_begun() != stops;
  }

  /// Returns success if the drive is ready for a command. If not, makes one attempt towards reconnection.
  Status connected() {
    if (greeted_) return {};
    if (!transport_) {
      if (now() < next_try_) return lost_;
      next_try_ = now() + kBetweenTries;
      if (auto there = plug_in(); !there) return lost_;
    }
    if (auto greeted = greet(*transport_, kGreetingSlice); !greeted) {
      kLog.warning(settings_.port + ": the controller does not answer the handshake yet");
      if (greeted.error().code == ErrorCode::kDisconnected || now() >= greet_until_) lose();
      return lost_;
    }
    return {};
  }

  /// Stops the wheels. An answer to a stop of the watchdog means the same as an answer to the program's stop: the
  /// wheels were stopped. A failure while the watchdog writes stops has no meaning.
  Status stop_wheels() {
    Status stopped;
    for (int i = 0; i < kCrossedTries; ++i) {
      const std::uint32_t stops = count_stops();
      stopped = protocol_->drive(*transport_, {});
      if (stopped || !was_crossed_since(stops)) break;
    }
    if (!stopped) return finish(stopped);
    moves_until_.reset();
    // If the controller does not confirm the stop, the watchdog keeps its deadline and repeats the stop after each
    // time-out.
    if (watchdog_ && protocol_->answers_commands()) {
      if (auto expected = watchdog_->expect_stop(); !expected) return replace_watchdog(expected.error());
    }
    return {};
  }

  /// Sends a stop after a failed command that moves, because the command may have been carried out.
  Error with_stop(const Error& error) {
    if (error.code == ErrorCode::kDisconnected) return error;
    send_stop();
    return {error.code, error.message + "; a stop was sent after it"};
  }

  /// Returns the error for a command during which the program did not run for so long that the watchdog stopped the
  /// wheels. It is not known whether the watchdog's stop or the command reached the controller first.
  Error held_up(SteadyTime::duration time) {
    const auto stopped = stop_wheels();
    return Error(ErrorCode::kTimeout,
                 "the command took {:.0f} ms, longer than command_timeout: the watchdog stopped the wheels meanwhile, "
                 "and {}",
                 std::chrono::duration<double, std::milli>(time).count(),
                 stopped ? "they are stopped now" : "a stop was sent again: " + stopped.error().message);
  }

  /// Stops the wheels, which must not turn without a watchdog, and starts another watchdog.
  Error replace_watchdog(const Error& why) {
    base::Logger("watchdog").warning(why.message + "; it is replaced");
    send_stop();
    watchdog_->kill();
    count_stops();
    watchdog_.reset();
    if (auto stopped = stop_wheels(); !stopped) send_stop();
    auto posted = greeted_ ? post_watchdog() : Status{};
    if (!posted) lose();
    return Error(
        ErrorCode::kUnavailable, "{}; the wheels were stopped, and {}", why.message,
        posted ? "another watchdog is started" : "no other watchdog can be started: " + posted.error().message);
  }

  /// Reads the counters again while stops of the watchdog come in between, so that the answer belongs to the question.
  Result<RawCounts> read_counts(SteadyTime& asked) {
    for (int i = 0; i < kCrossedTries; ++i) {
      const std::uint32_t stops = count_stops();
      asked = now();
      auto counts = protocol_->read_counts(*transport_);
      if (!was_crossed_since(stops)) return counts;
    }
    if (auto awake = watchdog_->settle(); !awake) return replace_watchdog(awake.error());
    return Error{ErrorCode::kTimeout, "the watchdog's stops came between each question and its answer"};
  }

  /// Sends a stop to the device at the port, without waiting for an answer.
  void send_stop() {
    if (!transport_) return;
    if (transport_->write(protocol_->stop_bytes(), now() + kSending)) protocol_->note_stops(1);
  }

  /// Closes a lost port.
  void lose() {
    kLog.warning(settings_.port + ": disconnected; it will be opened again");
    forget();
    watchdog_.reset();
    transport_.reset();
    next_try_ = now() + kBetweenTries;
    lost_ = Error(ErrorCode::kDisconnected, "{} is disconnected; waiting for it", settings_.port);
  }

  /// Requires a repeated handshake with the controller of a port that is still open.
  void greet_again(const std::string& why) {
    kLog.warning(fmt::format("{}: the controller {}; the handshake is repeated", settings_.port, why));
    forget();
    greet_until_ = now() + kGreeting;
    lost_ = Error(ErrorCode::kDisconnected, "the controller at {} {}", settings_.port, why);
  }

  /// Stops the wheels if that is still possible. Until the next handshake, the watchdog sends a stop after each
  /// time-out.
  void forget() {
    greeted_ = false;
    send_stop();
    failures_ = 0;
  }

  Status finish(Status status) {
    if (status || !greeted_) return status;
    if (status.error().code == ErrorCode::kDisconnected) {
      lose();
    } else if (status.error().code != ErrorCode::kRefused && ++failures_ >= kFailuresToGreet) {
      greet_again("does not answer");
      return lost_;
    }
    return status;
  }

  /// Stops the wheels if the program reads but does not command. Without a watchdog this is necessary, because a
  /// controller may take any question as a sign of life.
  Status keep_dead_man_rule() {
    if (!moves_until_ || now() < *moves_until_) return {};
    kLog.warning("no command within command_timeout; the wheels are stopped");
    return stop_wheels();
  }

  /// Returns whether the motors can have turned the wheels this far in that time.
  [[nodiscard]] bool is_possible(const WheelCounts& step, SteadyTime::duration time) const {
    const double time_s = std::chrono::duration<double>(time).count() + kSlack_s;
    const double most =
        kOverspeed * limits().max_speed_radps * time_s * facts_.counts_per_turn / (2 * std::numbers::pi);
    return double(std::max(std::abs(step.left), std::abs(step.right))) <= most + kSlackCounts;
  }
  [[nodiscard]] bool follows(const RawCounts& raw) const {
    return !read_at_ || is_possible(counter_.step_to(raw), now() - *read_at_);
  }

  /// Reads again after a jump of the counts. A jump is a disturbed answer, unless it is read twice: the board was then
  /// reset.
  Result<RawCounts> ask_again(const RawCounts& first) {
    kLog.warning("the wheel counters jumped; they are read again");
    SteadyTime asked = now();
    const SteadyTime begun = asked;
    auto second = read_counts(asked);
    if (!second || follows(*second)) return second;
    WheelCounter between(protocol_->counter_bits());
    between.advance(first);
    if (!is_possible(between.step_to(*second), now() - begun)) {
      return Error{ErrorCode::kBadData, "two readings of the counters that contradict each other"};
    }
    greet_again("was reset: its counters started again");
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
  Machine machine_;
  const std::unique_ptr<Protocol> protocol_;
  DriveFacts facts_;
  double least_speed_radps_ = 0;
  WheelCounter counter_;
  // The state of a connection:
  std::unique_ptr<Transport> transport_;
  int descriptor_ = -1;
  std::unique_ptr<Watchdog> watchdog_;
  std::uint32_t stops_noted_ = 0;  // stops of this watchdog that were reported to the protocol
  bool greeted_ = false;
  int failures_ = 0;  // since the last reading
  SteadyTime greet_until_;
  std::optional<SteadyTime> moves_until_;
  std::optional<SteadyTime> read_at_;
  // The state without a connection:
  SteadyTime next_try_;
  Status lost_ = Error{ErrorCode::kDisconnected, "the controller was not found yet"};
};

}  // namespace

void check(const SerialDriveSettings& settings) {
  base::Complaints bad;
  if (settings.port.empty()) bad.add("port is missing");
  if (std::ranges::find(kProtocolNames, settings.protocol) == kProtocolNames.end()) {
    bad.add("protocol is '{}', must be one of {}", settings.protocol, fmt::join(kProtocolNames, ", "));
  } else {
    const auto fixed = make_protocol({.name = settings.protocol})->fixed_counts_per_turn();
    if (!fixed && !settings.counts_per_turn) {
      bad.add("counts_per_turn is missing, protocol {} needs it", settings.protocol);
    }
    if (!settings.watchdog && settings.protocol != "roboclaw") {
      bad.add("watchdog is switched off, but a controller of protocol {} does not stop the wheels in time by itself",
              settings.protocol);
    }
  }
  if (settings.baud && *settings.baud <= 0) bad.add("baud is {}, must be > 0", *settings.baud);
  if (settings.counts_per_turn && !base::is_positive(*settings.counts_per_turn)) {
    bad.add("counts_per_turn is {}, must be > 0 and finite", *settings.counts_per_turn);
  }
  if (settings.least_speed_radps && !(*settings.least_speed_radps >= 0 && std::isfinite(*settings.least_speed_radps))) {
    bad.add("least_speed_radps is {}, must be >= 0 and finite", *settings.least_speed_radps);
  }
  bad.within("address", settings.address, 0x80, 0x87);
  bad.raise("SerialDriveSettings");
}

double least_speed_radps(const SerialDriveSettings& settings) {
  const auto protocol = make_protocol({.name = settings.protocol});
  const double counts_per_turn = settings.counts_per_turn.value_or(protocol->fixed_counts_per_turn().value_or(0));
  const double rad = 2 * std::numbers::pi / counts_per_turn;
  return std::max(settings.least_speed_radps.value_or(protocol->usual_least_rate() * rad),
                  protocol->least_command() * rad);
}

Result<std::unique_ptr<DiffDrive>> open_drive(const SerialDriveSettings& settings, const DriveLimits& limits,
                                              Machine machine) {
  check(settings);
  twocone::check(limits);
  check_without_watchdog(settings, limits);
  auto drive = std::make_unique<SerialDiffDrive>(settings, limits, std::move(machine));
  if (auto opened = drive->open(); !opened) return opened.error();
  return std::unique_ptr<DiffDrive>(std::move(drive));
}

}  // namespace twocone::serial
