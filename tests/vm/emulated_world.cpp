// SPDX-License-Identifier: Apache-2.0
// The world of a robot with emulated devices, in real time:
//   emulated_world SIMULATED_ROBOT REAL_ROBOT FOLDER
// An emulated motor controller of REAL_ROBOT's protocol turns the wheels, which move SIMULATED_ROBOT through its
// simulated world. The world's views are rendered at the cameras' rate and sent in the format of REAL_ROBOT's cameras,
// YUYV or RGB3. The program makes these files in FOLDER:
//   motor       a link to the terminal at which the controller answers
//   images      a socket: a program that connects and sends a byte gets both views of each step from then on, lower
//               first
//   world.csv   for each step: the times at which its images were taken and sent (seconds of the steady clock), the
//               robot's pose, and the images' fingerprints
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

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/simulation_host.h"
#include "tests/emulator/fd_bench.h"
#include "tests/vm/images.h"

namespace twocone::vm {
namespace {

namespace fs = std::filesystem;
using SteadyTime = std::chrono::steady_clock::time_point;

// The number of times that the wheels are read between two images, so that the robot follows them closely.
constexpr int kStepsPerFrame = 20;
// An image is sent this many periods after its exposure, or when it is rendered. The rate is then steady, although the
// rendering time is not.
constexpr double kDelayPeriods = 0.75;
// The largest number of exposures with unfinished images. Further ones are skipped and counted.
constexpr std::size_t kMostUnfinished = 8;
constexpr std::chrono::seconds kImageTimeout{120};
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

/// The angles by which the wheels have turned.
struct Turned {
  double left_rad = 0;
  double right_rad = 0;
};

/// The motor controller, at its own terminal.
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

  /// The angles since the last call.
  Turned turned() {
    return server_->with([this](const emulator::Firmware& firmware) {
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
  std::optional<emulator::Server> server_;
};

/// One step of the world, whose images may still be rendering.
struct Exposure {
  std::uint64_t number = 0;
  SteadyTime exposed;
  sim_povray::SessionState state;
  std::shared_future<ImageResult> lower, upper;
};

/// The connection to the program that gets the images.
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

  /// Waits until a program requests images. Returns false if this program is stopped before.
  bool wait() {
    if (!wait_for(listener_)) return false;
    peer_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (peer_ < 0) throw_errno("accept");
    char ready = 0;
    return wait_for(peer_) && ::read(peer_, &ready, 1) == 1;
  }
  /// Returns false if the receiver is gone.
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

/// Sends images in the order of their exposures, from its own thread.
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

  /// Adds an exposure. Returns false, without a new exposure, if too many are unfinished.
  bool add(const std::function<Exposure()>& expose) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostUnfinished) return false;
    waiting_.push_back(expose());
    changed_.notify_all();
    return true;
  }
  /// The reason why it has ended by itself; empty: it has not.
  std::string trouble() {
    const std::lock_guard lock(mutex_);
    return trouble_;
  }
  /// The number of images that were not rendered when they were due.
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
  [[nodiscard]] Image image(const std::shared_future<ImageResult>& coming) const {
    if (coming.wait_for(kImageTimeout) != std::future_status::ready) {
      throw std::runtime_error("an image was not rendered in time");
    }
    const auto rgb = value_or_throw(to_rgb8(*value_or_throw(coming.get())));
    return format_ == "YUYV" ? to_yuyv(rgb) : rgb;
  }
  void send(const Exposure& exposure) {
    const Image lower = image(exposure.lower);
    const Image upper = image(exposure.upper);
    const SteadyTime due = exposure.exposed + std::chrono::duration_cast<SteadyTime::duration>(delay_);
    if (std::chrono::steady_clock::now() > due) ++late_;
    std::this_thread::sleep_until(due);
    if (!receiver_.send(lower.bytes) || !receiver_.send(upper.bytes)) {
      throw std::runtime_error("the receiver of the images is gone");
    }
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

/// The simulated robot, which the controller's wheels move.
class World {
 public:
  explicit World(const fs::path& file) {
    const config::Robot robot = config::read_robot(file);
    auto settings = config::to_robot_settings(robot, config::read_map(robot.map), 1);
    sim_povray::SessionSettings session = settings.world->session;
    session.drive = settings.drive.limits;
    session.drive.command_timeout = std::chrono::hours(1);  // the controller has its own time-out
    session.body.command_timeout = session.drive.command_timeout;
    session.run_ahead_frames = 1'000;  // the sender limits the unfinished images
    const auto host = value_or_throw(sim_povray::SimulationHost::open(settings.world->place));
    session_ = value_or_throw(host->join(session));
    rate_hz_ = robot.lower.settings.rate_hz;
    const auto views = config::to_views(settings);
    for (std::size_t i = 0; i < 2; ++i) {
      CameraSettings camera = i == 0 ? settings.lower.settings : settings.upper.settings;
      camera.rate_hz *= kStepsPerFrame;
      views_[i] = value_or_throw(session_->open_view(views[i]));
      if (auto configured = session_->configure_view(views_[i], camera); !configured) {
        throw std::runtime_error(configured.error().message);
      }
    }
  }

  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// Makes one of kStepsPerFrame steps, in which the wheels turn by these angles.
  void step(const Turned& turned) {
    const double steps_hz = rate_hz_ * kStepsPerFrame;
    static_cast<void>(session_->command({turned.left_rad * steps_hz, turned.right_rad * steps_hz}));
    if (auto stepped = session_->step(std::chrono::steady_clock::now() + kImageTimeout); !stepped) {
      throw std::runtime_error(stepped.error().message);
    }
  }
  Exposure expose(std::uint64_t number) {
    return {number, std::chrono::steady_clock::now(), session_->state(), session_->image(views_[0]),
            session_->image(views_[1])};
  }

 private:
  std::unique_ptr<sim_povray::RobotSession> session_;
  std::array<sim_povray::RobotSession::ViewId, 2> views_{};
  double rate_hz_ = 0;
};

void run(const fs::path& simulated, const fs::path& real, const fs::path& folder) {
  const config::Robot robot = config::read_robot(real);
  if (!robot.drive.serial) throw std::runtime_error(real.string() + ": its drive has no serial port");
  const std::string format = robot.lower.device.format;
  if ((format != "YUYV" && format != "RGB3") || robot.upper.device.format != format) {
    throw std::runtime_error(real.string() + ": the format of its cameras is neither YUYV nor RGB3");
  }
  World world(simulated);
  Controller controller(*robot.drive.serial, folder / "motor");
  // The first images are rendered before a program waits for them, so that a failure ends this program at once.
  const Exposure first = world.expose(0);
  for (const auto& image : {first.lower, first.upper}) value_or_throw(image.get());
  Receiver receiver(folder / "images");
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
  std::cout << fmt::format("{} steps, {} skipped because rendering was late, {} sent late; {}\n", number, missed,
                           sender.late(), sender.trouble());
}

}  // namespace
}  // namespace twocone::vm

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: emulated_world SIMULATED_ROBOT REAL_ROBOT FOLDER\n";
    return 2;
  }
  std::signal(SIGTERM, twocone::vm::ask_to_stop);
  std::signal(SIGINT, twocone::vm::ask_to_stop);
  try {
    twocone::vm::run(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::cerr << "emulated_world: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
