// SPDX-License-Identifier: Apache-2.0
// The world around a robot whose devices are stood in for, in real time:
//   stand_in_world SIMULATED_ROBOT REAL_ROBOT FOLDER
// Wheels that a motor controller of REAL_ROBOT's protocol turns move SIMULATED_ROBOT through its simulated world, whose
// views are rendered at the cameras' rate, and sent in the format of REAL_ROBOT's cameras, YUYV or RGB3. In FOLDER it
// makes
//   motor       a link to the terminal at which the controller answers
//   pictures    a socket: who connects and sends a byte gets both views of each instant from then on, lower first
//   world.csv   of each instant: when it was exposed and sent (seconds of the steady clock), where the robot was, and
//               the pictures' fingerprints
// It ends when the other end of the socket is closed, or at SIGTERM.
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <iostream>
#include <mutex>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/files/to_layers.h"
#include "drivers/sim_povray/hall.h"
#include "tests/guest/pictures.h"
#include "tests/stand_in/fd_bench.h"

namespace twocone::guest {
namespace {

namespace fs = std::filesystem;
using SteadyTime = std::chrono::steady_clock::time_point;

// Between two pictures the wheels are looked at so often: the world's robot turns with them as they are told to, and
// not as they were at the last picture.
constexpr int kStepsPerFrame = 20;
// A picture is sent so long after its exposure, or when it is there: at a steady rate, though rendering is not steady.
constexpr double kDelayPeriods = 0.75;
// Exposures whose pictures are unfinished; more are not made, and told of.
constexpr std::size_t kMostUnfinished = 8;
constexpr std::chrono::seconds kPictureTimeout{120};
constexpr std::chrono::milliseconds kBetweenLooks{100};

volatile std::sig_atomic_t stop_asked = 0;
void ask_to_stop(int /*signal*/) { stop_asked = 1; }

template <typename T>
T value_or_throw(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

[[noreturn]] void throw_errno(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

double seconds(SteadyTime time) { return std::chrono::duration<double>(time.time_since_epoch()).count(); }

/// How far the wheels have turned.
struct Turned {
  double left_rad = 0;
  double right_rad = 0;
};

/// The motor controller, at a terminal of its own.
class Controller {
 public:
  Controller(const serial::SerialDriveSettings& settings, const fs::path& link) {
    if (!settings.counts_per_turn) throw std::runtime_error("the real robot's drive has no counts_per_turn");
    rad_per_count_ = 2 * std::numbers::pi / *settings.counts_per_turn;
    termios raw{};
    ::cfmakeraw(&raw);
    char name[256];
    if (::openpty(&board_, &line_, name, &raw, nullptr) != 0) throw_errno("openpty");
    if (::fcntl(board_, F_SETFL, O_NONBLOCK) != 0) throw_errno("fcntl");
    fs::remove(link);
    fs::create_symlink(name, link);
    server_.emplace(settings.protocol, board_);
  }
  ~Controller() {
    server_.reset();
    ::close(board_);
    ::close(line_);
  }
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// Since the last call.
  Turned turned() {
    return server_->with([this](const stand_in::Firmware& firmware) {
      const Turned turned{(firmware.wheels.left() - left_) * rad_per_count_,
                          (firmware.wheels.right() - right_) * rad_per_count_};
      left_ = firmware.wheels.left();
      right_ = firmware.wheels.right();
      return turned;
    });
  }

 private:
  int board_ = -1, line_ = -1;
  double rad_per_count_ = 0;
  double left_ = 0, right_ = 0;
  std::optional<stand_in::Server> server_;
};

/// One instant, whose pictures may be on their way.
struct Exposure {
  std::uint64_t number = 0;
  SteadyTime exposed;
  sim_povray::SeatState state;
  std::shared_future<ImageResult> lower, upper;
};

/// Whoever gets the pictures.
class Receiver {
 public:
  explicit Receiver(const fs::path& path) : listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    fs::remove(path);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.string().size() >= sizeof address.sun_path) throw std::runtime_error("too long a path: " + path.string());
    std::strcpy(address.sun_path, path.c_str());
    if (listener_ < 0 || ::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(listener_, 1) != 0) {
      throw_errno(path.string());
    }
  }
  ~Receiver() {
    if (peer_ >= 0) ::close(peer_);
    ::close(listener_);
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// Waits until somebody wants pictures. false: nobody will.
  bool wait() {
    if (!wait_for(listener_)) return false;
    peer_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (peer_ < 0) throw_errno("accept");
    char ready = 0;
    return wait_for(peer_) && ::read(peer_, &ready, 1) == 1;
  }
  /// false: nobody takes it.
  bool send(const Bytes& bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t took = ::send(peer_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (took < 0 && errno == EINTR) continue;
      if (took <= 0) return false;
      sent += std::size_t(took);
    }
    return true;
  }
  [[nodiscard]] bool is_gone() const {
    pollfd entry{peer_, POLLIN, 0};
    char byte = 0;
    return ::poll(&entry, 1, 0) > 0 && ::recv(peer_, &byte, 1, MSG_PEEK) == 0;
  }

 private:
  static bool wait_for(int descriptor) {
    pollfd entry{descriptor, POLLIN, 0};
    while (stop_asked == 0) {
      if (::poll(&entry, 1, int(kBetweenLooks.count())) > 0) return true;
    }
    return false;
  }
  int listener_;
  int peer_ = -1;
};

/// Sends pictures in the order of their exposures, from a thread of its own.
class Sender {
 public:
  Sender(Receiver& receiver, std::string format, std::chrono::nanoseconds delay, const fs::path& table)
      : receiver_(receiver), format_(std::move(format)), delay_(delay), table_(table), thread_([this] { work(); }) {}
  ~Sender() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  /// false: too many are unfinished, and this one is not taken.
  bool add(const std::function<Exposure()>& expose) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostUnfinished) return false;
    waiting_.push_back(expose());
    changed_.notify_all();
    return true;
  }
  /// Why it has ended by itself; empty: it has not.
  std::string trouble() {
    const std::lock_guard lock(mutex_);
    return trouble_;
  }
  /// Pictures that were not there when they were due.
  [[nodiscard]] int late() const { return late_; }

 private:
  void work() {
    table_ << "frame,exposed_s,sent_s,x_m,y_m,heading_rad,contact,lower,upper\n";
    try {
      while (auto exposure = next()) send(*exposure);
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      trouble_ = error.what();
    }
  }
  std::optional<Exposure> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (ended_) return std::nullopt;
    return waiting_.front();
  }
  [[nodiscard]] Image picture(const std::shared_future<ImageResult>& coming) const {
    if (coming.wait_for(kPictureTimeout) != std::future_status::ready) throw std::runtime_error("a picture never came");
    const auto rgb = value_or_throw(to_rgb8(*value_or_throw(coming.get())));
    return format_ == "YUYV" ? to_yuyv(rgb) : rgb;
  }
  void send(const Exposure& exposure) {
    const Image lower = picture(exposure.lower);
    const Image upper = picture(exposure.upper);
    const SteadyTime due = exposure.exposed + std::chrono::duration_cast<SteadyTime::duration>(delay_);
    if (std::chrono::steady_clock::now() > due) ++late_;
    std::this_thread::sleep_until(due);
    if (!receiver_.send(lower.bytes) || !receiver_.send(upper.bytes)) throw std::runtime_error("nobody takes pictures");
    const Pose2& pose = exposure.state.pose;
    table_ << fmt::format("{},{:.6f},{:.6f},{},{},{},{},{:016x},{:016x}\n", exposure.number, seconds(exposure.exposed),
                          seconds(std::chrono::steady_clock::now()), pose.x_m, pose.y_m, pose.heading_rad,
                          exposure.state.contact, value_or_throw(fingerprint(lower)),
                          value_or_throw(fingerprint(upper)))
           << std::flush;
    const std::lock_guard lock(mutex_);
    waiting_.pop_front();
  }

  Receiver& receiver_;
  const std::string format_;
  const std::chrono::nanoseconds delay_;
  std::ofstream table_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Exposure> waiting_;
  bool ended_ = false;
  std::string trouble_;
  std::atomic<int> late_{0};
  std::thread thread_;
};

/// The simulated robot, moved by wheels that are not simulated.
class World {
 public:
  explicit World(const fs::path& file) {
    const files::Robot robot = files::read_robot(file);
    auto settings = files::to_robot_settings(robot, files::read_map(robot.map), 1);
    sim_povray::SeatSettings seat = settings.world->seat;
    seat.drive = settings.drive.limits;
    seat.drive.command_timeout = std::chrono::hours(1);  // the controller has a time-out of its own
    seat.body.command_timeout = seat.drive.command_timeout;
    seat.run_ahead_frames = 1'000;  // the sender sees to it
    const auto hall = value_or_throw(sim_povray::Hall::open(settings.world->place));
    seat_ = value_or_throw(hall->take_seat(seat));
    rate_hz_ = robot.lower.rate_hz;
    const auto views = files::to_views(settings);
    for (std::size_t i = 0; i < 2; ++i) {
      CameraSettings camera = i == 0 ? settings.lower.settings : settings.upper.settings;
      camera.rate_hz *= kStepsPerFrame;
      views_[i] = value_or_throw(seat_->open_view(views[i]));
      if (auto configured = seat_->configure_view(views_[i], camera); !configured) {
        throw std::runtime_error(configured.error().message);
      }
    }
  }

  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// One of kStepsPerFrame steps, on which the wheels turn by so much.
  void step(const Turned& turned) {
    const double steps_hz = rate_hz_ * kStepsPerFrame;
    static_cast<void>(seat_->command({turned.left_rad * steps_hz, turned.right_rad * steps_hz}));
    if (auto stepped = seat_->step(std::chrono::steady_clock::now() + kPictureTimeout); !stepped) {
      throw std::runtime_error(stepped.error().message);
    }
  }
  Exposure expose(std::uint64_t number) {
    return {number, std::chrono::steady_clock::now(), seat_->state(), seat_->picture(views_[0]),
            seat_->picture(views_[1])};
  }

 private:
  std::unique_ptr<sim_povray::Seat> seat_;
  std::array<sim_povray::Seat::ViewId, 2> views_{};
  double rate_hz_ = 0;
};

void run(const fs::path& simulated, const fs::path& real, const fs::path& folder) {
  const files::Robot robot = files::read_robot(real);
  if (!robot.drive.serial) throw std::runtime_error(real.string() + ": its drive is on no serial port");
  const std::string format = robot.lower.device.format;
  if ((format != "YUYV" && format != "RGB3") || robot.upper.device.format != format) {
    throw std::runtime_error(real.string() + ": the format of its cameras is neither YUYV nor RGB3");
  }
  World world(simulated);
  Controller controller(*robot.drive.serial, folder / "motor");
  // Rendering has begun, and works, before anybody waits for it.
  const Exposure first = world.expose(0);
  for (const auto& picture : {first.lower, first.upper}) value_or_throw(picture.get());
  Receiver receiver(folder / "pictures");
  std::cout << "ready" << std::endl;
  if (!receiver.wait()) return;

  const auto step = std::chrono::duration_cast<SteadyTime::duration>(
      std::chrono::duration<double>(1 / (world.rate_hz() * kStepsPerFrame)));
  Sender sender(receiver, format, step * int(kStepsPerFrame * kDelayPeriods), folder / "world.csv");
  const SteadyTime begin = std::chrono::steady_clock::now();
  static_cast<void>(controller.turned());
  int missed = 0;
  std::uint64_t number = 0;
  for (std::int64_t i = 0; stop_asked == 0 && sender.trouble().empty() && !receiver.is_gone(); ++i) {
    std::this_thread::sleep_until(begin + i * step);
    world.step(controller.turned());
    if (i % kStepsPerFrame != 0) continue;
    if (sender.add([&] { return world.expose(number); })) {
      ++number;
    } else {
      ++missed;
    }
  }
  std::cout << fmt::format("{} instants, {} not exposed as rendering was behind, {} sent late; {}\n", number, missed,
                           sender.late(), sender.trouble());
}

}  // namespace
}  // namespace twocone::guest

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: stand_in_world SIMULATED_ROBOT REAL_ROBOT FOLDER\n";
    return 2;
  }
  std::signal(SIGTERM, twocone::guest::ask_to_stop);
  std::signal(SIGINT, twocone::guest::ask_to_stop);
  try {
    twocone::guest::run(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::cerr << "stand_in_world: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
