// SPDX-License-Identifier: Apache-2.0
#include "tests/emulator/simulated_line.h"

#include <algorithm>
#include <utility>

namespace twocone::emulator {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

// The time of ten bits at 57600 baud.
constexpr nanoseconds kByteTime = 173'611ns;
// The time from a CR to the first byte of its answer.
constexpr nanoseconds kThinks = 300us;
constexpr nanoseconds kStep = 1ms;
// An ordinary machine delays a watchdog that is ready to run, and also between its decision and its bytes.
constexpr nanoseconds kMostLate = 3ms;
constexpr nanoseconds kMostUndecided = 1ms;
constexpr nanoseconds kNap = 50us;

/// The program's end of the line.
class SimulatedTransport final : public serial::Transport {
 public:
  explicit SimulatedTransport(SimulatedLine& line) : line_(line) {}
  [[nodiscard]] serial::Deadline now() const override { return line_.steady_now(); }
  Status write(std::span<const std::uint8_t> bytes, serial::Deadline /*deadline*/) override {
    line_.maybe_hold_up();
    line_.send("program", bytes);
    line_.maybe_hold_up();
    return {};
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, serial::Deadline deadline) override {
    line_.maybe_hold_up();
    while (true) {
      if (const std::size_t got = line_.receive(room)) return got;
      const nanoseconds until = deadline.time_since_epoch();
      if (line_.now() >= until) return Error{ErrorCode::kTimeout, "no answer"};
      line_.advance_to(std::min({until, line_.next_arrival(), line_.now() + kStep}));
    }
  }
  Status discard_input() override {
    line_.forget_received();
    return {};
  }
  void pause(std::chrono::milliseconds time) override { line_.advance(time); }

 private:
  SimulatedLine& line_;
};

}  // namespace

SimulatedLine::SimulatedLine(std::uint64_t seed, nanoseconds latency) : latency_(latency), random_(seed) {
  board_.reset();
}

nanoseconds SimulatedLine::draw(nanoseconds from, nanoseconds to) {
  return nanoseconds(std::uniform_int_distribution<std::int64_t>(from.count(), to.count())(random_));
}

bool SimulatedLine::chance(double probability) {
  return probability > 0 && std::uniform_real_distribution<>(0, 1)(random_) < probability;
}

serial::Machine SimulatedLine::machine() {
  return {.connect = [this]() -> Result<serial::Connection> {
            return serial::Connection{std::make_unique<SimulatedTransport>(*this), 0};
          },
          .post = [this](int, std::vector<std::uint8_t> stop_bytes,
                         nanoseconds timeout) -> Result<std::unique_ptr<serial::Watchdog>> {
            return std::unique_ptr<serial::Watchdog>(
                std::make_unique<SimulatedWatchdog>(*this, std::move(stop_bytes), timeout));
          },
          .now = [this] { return steady_now(); }};
}

void SimulatedLine::push(std::deque<Byte>& queue, nanoseconds time, std::uint8_t byte) {
  if (is_troubled() && chance(troubles.lose)) return;
  if (is_troubled() && chance(troubles.garble)) byte ^= std::uint8_t(1 << (random_() % 8));
  queue.push_back({time, byte});
}

void SimulatedLine::send(const char* who, std::span<const std::uint8_t> bytes) {
  trace(who, bytes);
  for (const std::uint8_t byte : bytes) {
    board_free_ = std::max(board_free_, now_) + kByteTime;
    push(to_board_, board_free_, byte);
  }
}

void SimulatedLine::forget_unsent() {
  // The byte in transit still arrives.
  while (!to_board_.empty() && to_board_.back().time > now_ + kByteTime) to_board_.pop_back();
  board_free_ = std::min(board_free_, now_ + kByteTime);
}

void SimulatedLine::answer(const std::vector<std::uint8_t>& bytes) {
  trace("board", bytes);
  host_free_ = std::max(host_free_, now_ + kThinks);
  for (const std::uint8_t byte : bytes) {
    host_free_ += kByteTime;
    // The adapter delivers its bytes at the end of each latency interval.
    const nanoseconds late = latency_.count() > 0 ? latency_ - (host_free_ - begin_) % latency_ : 0ns;
    push(to_host_, host_free_ + late, byte);
  }
}

std::size_t SimulatedLine::receive(std::span<std::uint8_t> room) {
  std::size_t count = 0;
  while (count < room.size() && !to_host_.empty() && to_host_.front().time <= now_) {
    room[count++] = to_host_.front().value;
    to_host_.pop_front();
  }
  return count;
}

void SimulatedLine::forget_received() {
  while (!to_host_.empty() && to_host_.front().time <= now_) to_host_.pop_front();
}

void SimulatedLine::maybe_hold_up() {
  if (!is_troubled() || !chance(troubles.hold_up)) return;
  const nanoseconds time = draw(troubles.shortest_hold_up, troubles.longest_hold_up);
  held_up += time;
  advance(time);
}

void SimulatedLine::reset_board(nanoseconds silence) {
  board_.reset();
  to_board_.clear();
  board_free_ = now_;
  boots_until_ = now_ + silence;
}

void SimulatedLine::step_board() {
  std::vector<std::uint8_t> out;
  const double now_s = std::chrono::duration<double>(now_ - begin_).count();
  board_.pass_time(now_s, out);
  while (!to_board_.empty() && to_board_.front().time <= now_) {
    const std::uint8_t byte = to_board_.front().value;
    to_board_.pop_front();
    if (now_ >= boots_until_) board_.receive({&byte, 1}, now_s, out);
  }
  if (!out.empty()) answer(out);
}

void SimulatedLine::advance_to(nanoseconds time) {
  do {
    nanoseconds next = std::min(time, now_ + kStep);
    if (!to_board_.empty()) next = std::min(next, std::max(now_, to_board_.front().time));
    if (watchdog != nullptr) next = std::min(next, std::max(now_, watchdog->wake_time()));
    now_ = std::max(now_, next);
    step_board();
    if (watchdog != nullptr && watchdog->wake_time() <= now_) watchdog->run();
    watch();
  } while (now_ < time);
}

SimulatedWatchdog::SimulatedWatchdog(SimulatedLine& line, std::vector<std::uint8_t> stop_bytes, nanoseconds timeout)
    : SimulatedWatchdog(line, std::move(stop_bytes), timeout, std::make_unique<Shared>()) {}

SimulatedWatchdog::SimulatedWatchdog(SimulatedLine& line, std::vector<std::uint8_t> stop_bytes, nanoseconds timeout,
                                     std::unique_ptr<Shared> shared)
    : Watchdog(shared->state, timeout),
      line_(line),
      stop_bytes_(std::move(stop_bytes)),
      shared_(std::move(shared)),
      steps_(shared_->state, timeout.count()) {
  line_.watchdog = this;
}

SimulatedWatchdog::~SimulatedWatchdog() {
  do_end(500ms);
  line_.watchdog = nullptr;
}

void SimulatedWatchdog::run() {
  if (is_dead_) {
    wake_ = SimulatedLine::kNever;
    return;
  }
  if (is_halted()) {
    wake_ = halted_until_;
    return;
  }
  if (writes_) {
    if (is_first_) line_.forget_unsent();
    line_.send("watchdog", stop_bytes_);
    steps_.wrote_stop(line_.now().count());
    writes_ = false;
  }
  const serial::WatchdogSteps::Step step = steps_.next(line_.now().count());
  if (step.writes_stop) {
    writes_ = true;
    is_first_ = step.is_first;
    wake_ = line_.now() + line_.draw(0ns, kMostUndecided);
  } else if (step.wake_ns < 0) {
    wake_ = SimulatedLine::kNever;
  } else {
    wake_ = std::max(line_.now(), nanoseconds(step.wake_ns)) + line_.draw(0ns, kMostLate);
  }
}

Status SimulatedWatchdog::wake() {
  line_.maybe_hold_up();
  if (is_dead_) return Error{ErrorCode::kUnavailable, "the watchdog is gone"};
  // A stop that it has decided on is written after its own delay.
  if (!writes_) wake_ = std::min(wake_, line_.now() + line_.draw(10us, 500us));
  return {};
}

void SimulatedWatchdog::nap() { line_.advance(kNap); }

void SimulatedWatchdog::do_end(std::chrono::milliseconds patience) noexcept {
  if (is_dead_) return;
  if (patience > 0ms && is_halted()) line_.advance_to(std::min(halted_until_, line_.now() + patience));
  if (patience > 0ms && !is_halted()) {
    for (int i = 0; i < serial::kStopsInARow; ++i) {
      if (i > 0) line_.advance(serial::kBetweenStops);
      ++shared_->state.stops_begun;
      line_.send("watchdog", stop_bytes_);
      ++shared_->state.stops_done;
    }
  }
  is_dead_ = true;
}

}  // namespace twocone::emulator
