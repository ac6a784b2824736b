// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/log.h"
#include "base/unique_fd.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/server/images.h"
#include "drivers/sim_povray/server/protocol.h"
#include "drivers/sim_povray/server/socket.h"
#include "drivers/sim_povray/simulation_host.h"
#include "hal/clock.h"

namespace twocone::sim_povray {
namespace server {
namespace {

/// Time from the connection to the client's request for a session.
constexpr std::chrono::seconds kHandshakeTime{5};
/// Period in which a session that waits for its client checks whether the server stops.
constexpr std::chrono::milliseconds kStopSlice{50};
/// Period in which a session that waits for its world checks whether its client is alive.
constexpr std::chrono::milliseconds kStepSlice{50};

Error refusal(std::string why) { return {ErrorCode::kRefused, std::move(why)}; }

/// The conversation with one client. An error in a Status that a function here returns ends the conversation, and the
/// client is notified of it unless it is kDisconnected. An error of the world does not end it, but becomes a reply.
class Conversation {
 public:
  /// @param report called from the thread of run()
  /// @param stop checked twenty times a second
  /// @param patience time for which others wait for a client that requests nothing, before it is sent away
  Conversation(int socket, SimulationHost& host, const std::function<void(const std::string&)>& report,
               const std::atomic<bool>& stop, std::chrono::milliseconds patience, const WorldWatch& watch)
      : socket_(socket), host_(host), report_(report), stop_(stop), patience_(patience), watch_(watch) {}

  /// Serves the client from its handshake to its end: when it leaves or is sent away, or `stop` is set.
  void run() {
    const std::optional<Peer> peer = peer_of(socket_);
    Status end = caught([&] { return shake_hands(peer, in(kHandshakeTime)); });
    if (session_) {
      report_(fmt::format("{} attached (pid {})", robot_, peer ? peer->process : 0));
      end = caught([this] { return serve_requests(); });
      if (!left_) leave(": " + end.error().message);
    } else if (end.error().code != ErrorCode::kDisconnected) {
      report_(fmt::format("a program (pid {}) was sent away: {}", peer ? peer->process : 0, end.error().message));
    }
    if (!left_ && end.error().code != ErrorCode::kDisconnected) {
      (void)send_message(socket_, Failed{end.error().code, end.error().message}, in(kSendTime));  // it ends either way
    }
  }

 private:
  /// Converts an exception into an error, which ends only this conversation. Settings that are out of their domain
  /// (check()) become a refusal.
  template <typename Part>
  static Status caught(Part part) {
    try {
      return part();
    } catch (const std::invalid_argument& error) {
      return refusal(error.what());
    } catch (const std::exception& error) {
      return Error{ErrorCode::kUnavailable, error.what()};
    }
  }

  Status shake_hands(const std::optional<Peer>& peer, SteadyTime deadline) {
    if (auto same_user = check_peer(peer, ::geteuid()); !same_user) return same_user;
    Result<Message> first = receive(deadline);
    if (!first) return first.error();
    const auto* hello = std::get_if<Hello>(&*first);
    if (hello == nullptr || hello->magic != kMagic) return refusal("the program does not know this link");
    const Hello own;
    if (auto sent = send_message(socket_, own, deadline); !sent) return sent;
    if (hello->version != own.version) {
      return refusal(fmt::format("this world speaks version {} of the link ({}), the calling program version {} ({})",
                                 own.version, own.program, hello->version, hello->program));
    }
    Result<Message> request = receive(deadline);
    if (!request) return request.error();
    const auto* take = std::get_if<Take>(&*request);
    if (take == nullptr) return refusal("a session must be taken before anything else");
    check(take->settings);
    auto session = host_.join(take->settings);
    if (!session) return session.error();
    if (auto sent = send_message(socket_, Sessioned{(*session)->state()}, deadline); !sent) return sent;
    robot_ = take->settings.name.empty() ? "robot" : "robot." + take->settings.name;
    slots_ = std::uint32_t(std::clamp(take->settings.run_ahead_frames, 1, int(kMaxSlots) - 2)) + 2;
    sender_ = std::make_unique<ImageSender>(socket_);
    session_ = std::move(*session);
    return {};
  }

  /// Serves requests until the client leaves or an error occurs.
  Status serve_requests() {
    while (!left_) {
      const Result<Message> message = receive(SteadyTime::max());
      if (!message) return message.error();
      if (hung_up(socket_)) return gone();
      Status handled = std::visit([this](const auto& request) { return on(request); }, *message);
      if (!handled) return handled;
    }
    return {};
  }

  Status on(const OpenView& request) {
    if (views_.size() >= kMaxViews) return refusal(fmt::format("a session has {} views at most", kMaxViews));
    check(request.settings);
    const auto id = session_->open_view(request.settings);
    if (!id) return reply_with(id.error());
    views_.emplace_back();
    cameras_.push_back(request.settings.camera_name);
    return reply(ViewOpened{*id});
  }

  Status on(const ConfigureView& request) {
    const CameraSettings& size = request.settings;
    if (request.view >= views_.size()) return no_view(request.view);
    check(size);
    if (size.width_px > kMaxSide_px || size.height_px > kMaxSide_px) {
      return refusal(
          fmt::format("images of {} x {} pixels: {} a side are the most", size.width_px, size.height_px, kMaxSide_px));
    }
    const std::uint64_t slot_bytes = *image_bytes(PixelFormat::kRgb8, size.width_px, size.height_px);
    auto frames = SharedFrames::allocate(slots_, slot_bytes);
    if (!frames) return reply_with(frames.error());
    if (auto configured = session_->configure_view(request.view, size); !configured) return reply_with(configured);
    const base::UniqueFd file = frames->take_file();
    views_[request.view] = std::make_shared<ImageSlots>(std::move(*frames), size);
    return reply(ViewConfigured{slots_, slot_bytes}, file.get());
  }

  Status on(const ReleaseView& request) {
    if (request.view >= views_.size()) return no_view(request.view);
    session_->release_view(request.view);
    return reply(Done{});
  }

  Status on(const Step& request) {
    if (request.remaining < std::chrono::nanoseconds(0) || request.remaining > kLongestWait) {
      return refusal(fmt::format("a step with a time limit of {} ns", request.remaining.count()));
    }
    const SteadyTime deadline = in(request.remaining);
    while (true) {
      const Status stepped = session_->step(std::min(deadline, in(kStepSlice)));
      if (stepped) {
        if (watch_.stepped) watch_.stepped(robot_, session_->state());
        return reply(Stepped{session_->state()});
      }
      if (stepped.error().code != ErrorCode::kTimeout || std::chrono::steady_clock::now() >= deadline) {
        return reply_with(stepped.error());
      }
      if (stop_) return stopping();
      if (hung_up(socket_)) return gone();
    }
  }

  Status on(const ImageOrder& request) {
    if (request.view >= views_.size()) return no_view(request.view);
    const std::shared_ptr<ImageSlots>& slots = views_[request.view];
    if (slots == nullptr) return refusal("an image of a view that has no size yet");
    if (request.order <= last_order_) return refusal("the numbers of image orders must grow");
    if (request.slot >= slots->count() || !slots->occupy(request.slot)) {
      return refusal(fmt::format("an image for slot {}, which is in use or not there", request.slot));
    }
    last_order_ = request.order;
    const std::shared_future<ImageResult> image = session_->image(request.view);
    if (watch_.ordered) watch_.ordered(robot_, cameras_[request.view], image);
    sender_->add({request.order, slots, request.slot, image});
    return {};
  }

  Status on(const Command& request) {
    const WheelSpeeds& speeds = request.speeds;
    if (!std::isfinite(speeds.left_radps) || !std::isfinite(speeds.right_radps)) {
      return refusal(fmt::format("wheel speeds of {} and {} rad/s", speeds.left_radps, speeds.right_radps));
    }
    return reply_with(session_->command(speeds));
  }

  Status on(const Halt& /*request*/) { return reply_with(session_->halt()); }

  Status on(const Leave& /*request*/) {
    left_ = true;
    leave("");
    // The reply comes last, because the next program may join as soon as this one receives it.
    return reply(Done{});
  }

  template <typename Other>
  Status on(const Other& /*message*/) {
    return refusal("a session does not accept this message");
  }

  /// Frees the session, then reports it: "robot.1 left", and `ending` behind it.
  void leave(const std::string& ending) {
    sender_.reset();
    session_.reset();
    if (watch_.left) watch_.left(robot_);
    report_(fmt::format("{} left{}", robot_, ending));
  }

  Result<Message> receive(SteadyTime deadline) {
    SteadyTime idle_since = std::chrono::steady_clock::now();
    while (true) {
      if (stop_) return stopping();
      // The client may take its time while no other robot waits, or while its images are unfinished.
      if (!session_ || !session_->is_waited_for() || awaits_images()) idle_since = std::chrono::steady_clock::now();
      if (std::chrono::steady_clock::now() - idle_since >= patience_) {
        return refusal(fmt::format("others have waited for it for {:.3g} s, and it asks for nothing",
                                   std::chrono::duration<double>(patience_).count()));
      }
      auto received = receive_message(socket_, std::min(deadline, in(kStopSlice)));
      if (received) {
        if (!received->message) return refusal(fmt::format("what came is no message of link version {}", kVersion));
        return std::move(*received->message);
      }
      if (received.error().code == ErrorCode::kDisconnected) return gone();
      if (std::chrono::steady_clock::now() >= deadline) return received.error();
    }
  }

  [[nodiscard]] bool awaits_images() const {
    return std::ranges::any_of(views_, [](const auto& slots) { return slots && slots->is_any_busy(); });
  }

  Status reply(const Message& message, int file = -1) {
    if (auto sent = send_message(socket_, message, in(kSendTime), file); !sent) return gone();
    return {};
  }
  Status reply_with(const Status& status) {
    if (!status) return reply(Failed{status.error().code, status.error().message});
    return reply(Done{});
  }

  static Error gone() { return {ErrorCode::kDisconnected, "the program ended"}; }
  static Error stopping() { return {ErrorCode::kDisconnected, "the server stops"}; }
  [[nodiscard]] Error no_view(std::uint32_t view) const {
    return refusal(fmt::format("view {}, where there are {}", view, views_.size()));
  }

  const int socket_;
  SimulationHost& host_;
  const std::function<void(const std::string&)>& report_;
  const std::atomic<bool>& stop_;
  const std::chrono::milliseconds patience_;
  const WorldWatch& watch_;

  std::string robot_;
  std::unique_ptr<RobotSession> session_;
  std::unique_ptr<ImageSender> sender_;
  std::vector<std::shared_ptr<ImageSlots>> views_;  ///< by the session's ViewId; none before the first configuration
  std::vector<std::string> cameras_;                ///< likewise
  std::uint32_t slots_ = 0;
  std::uint64_t last_order_ = 0;
  bool left_ = false;
};

}  // namespace
}  // namespace server

namespace {

constexpr std::size_t kMaxConnections = 64;
/// Period in which `stop` is checked.
constexpr std::chrono::milliseconds kAcceptSlice{50};

/// A connection to one client, in a thread of its own.
struct Connection {
  std::atomic<bool> finished{false};
  std::jthread thread{};
};

/// Sends a refusal without waiting: a client that does not read it immediately misses it.
void send_away(int socket, const std::string& why) {
  (void)send_message(socket, server::Failed{ErrorCode::kUnavailable, why}, std::chrono::steady_clock::now());
}

}  // namespace

Status serve(const std::shared_ptr<SimulationHost>& host, const std::string& name,
             const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop,
             std::chrono::milliseconds patience, const WorldWatch& watch) {
  const auto path = world_socket(name);
  if (!path) return path.error();
  const auto claim = server::ServedName::claim(*path);
  if (!claim) return claim.error();
  auto listening = server::listen_at(*path);
  if (!listening) return listening.error();

  std::mutex report_mutex;
  const auto report_in_turn = [&](const std::string& line) {
    base::Logger("server").info(line);
    const std::lock_guard lock(report_mutex);
    report(line);
  };
  report_in_turn(fmt::format("serving '{}' at {}", name, path->string()));
  std::list<Connection> connections;
  while (!stop) {
    pollfd entry{listening->get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(kAcceptSlice.count()));
    connections.remove_if([](const Connection& connection) { return connection.finished.load(); });
    if (ready <= 0) continue;
    base::UniqueFd socket(::accept4(listening->get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket.valid()) {
      // Usually no descriptor is left. The caller stays in the queue, so this loop would spin without a pause.
      if (errno == EINTR || errno == ECONNABORTED) continue;
      base::Logger("server").warning("a program cannot be accepted; tried again");
      std::this_thread::sleep_for(kAcceptSlice);
      continue;
    }
    if (connections.size() >= kMaxConnections) {
      send_away(socket.get(),
                fmt::format("'{}' serves {} programs already, and no more at one time", name, kMaxConnections));
      continue;
    }
    Connection& connection = connections.emplace_back();
    try {
      connection.thread = std::jthread([&, socket = std::move(socket)]() mutable {
        server::Conversation(socket.get(), *host, report_in_turn, stop, patience, watch).run();
        socket.reset();
        connection.finished = true;
      });
    } catch (const std::system_error& error) {  // no thread is available
      connections.pop_back();
      report_in_turn(fmt::format("a program was sent away: {}", error.what()));
    }
  }
  // From now on no new client finds the socket. `connections` are joined before the claim ends.
  ::unlink(path->c_str());
  listening->reset();
  return {};
}

Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop,
                   const WorldWatch& watch) {
  auto host = SimulationHost::open(place);
  if (!host) return host.error();
  report((*host)->rendering());
  return serve(*host, name, report, stop, kIdlePatience, watch);
}

}  // namespace twocone::sim_povray
