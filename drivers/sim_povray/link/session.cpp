// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/link/session.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/sim_povray/link/picture_sender.h"
#include "drivers/sim_povray/link/protocol.h"
#include "drivers/sim_povray/link/shared_frames.h"
#include "drivers/sim_povray/link/socket.h"
#include "hal/clock.h"

namespace twocone::sim_povray::link {
namespace {

/// For all of it, from the connection to the client's wish for a seat.
constexpr std::chrono::seconds kHandshakeTime{5};
/// A client that has not read a reply for so long is stuck.
constexpr std::chrono::seconds kSendTime{5};
/// How often a session that waits for its client looks whether the server stops.
constexpr std::chrono::milliseconds kStopSlice{50};
/// How often a session that waits for its world looks whether its client still lives.
constexpr std::chrono::milliseconds kStepSlice{50};

SteadyTime in(std::chrono::nanoseconds time) { return std::chrono::steady_clock::now() + time; }

/// What the settings' own check() finds wrong, as a refusal.
template <typename Settings>
Status checked(const Settings& settings) {
  try {
    check(settings);
    return {};
  } catch (const std::invalid_argument& error) {
    return Error{ErrorCode::kRefused, error.what()};
  }
}

Error refusal(std::string why) { return {ErrorCode::kRefused, std::move(why)}; }

/// The talk with one client. Wherever a Status is returned here, an error is the talk's end, and the client is told of
/// it unless it is kDisconnected. What the world answers is no such error: it goes into a reply.
class Talk {
 public:
  Talk(int socket, Hall& hall, const std::function<void(const std::string&)>& tell, const std::atomic<bool>& stop,
       std::chrono::milliseconds patience)
      : socket_(socket), hall_(hall), tell_(tell), stop_(stop), patience_(patience) {}

  void run() {
    const std::optional<Peer> peer = peer_of(socket_);
    Status end = guarded([&] { return shake_hands(peer, in(kHandshakeTime)); });
    if (seat_) {
      tell_(fmt::format("{} attached (pid {})", robot_, peer ? peer->process : 0));
      end = guarded([this] { return converse(); });
      if (!left_) leave(": " + end.error().message);
    } else if (end.error().code != ErrorCode::kDisconnected) {
      tell_(fmt::format("a program (pid {}) was sent away: {}", peer ? peer->process : 0, end.error().message));
    }
    if (!left_ && end.error().code != ErrorCode::kDisconnected) {
      const Status told = send_message(socket_, Failed{end.error().code, end.error().message}, in(kSendTime));
      static_cast<void>(told);  // it is the end either way
    }
  }

 private:
  struct View {
    Seat::ViewId id = 0;
    std::shared_ptr<PictureSlots> slots;  ///< none before its first configuration
  };

  /// Whatever is thrown ends this talk and no other.
  template <typename Part>
  static Status guarded(Part part) {
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
    if (hello == nullptr || hello->magic != kMagic) return refusal("that is no program that knows this link");
    const Hello own;
    if (auto sent = send_message(socket_, own, deadline); !sent) return sent;
    if (hello->version != own.version) {
      return refusal(
          fmt::format("this world speaks version {} of the link ({}), the program that calls version {} ({})",
                      own.version, own.program, hello->version, hello->program));
    }
    Result<Message> wish = receive(deadline);
    if (!wish) return wish.error();
    const auto* take = std::get_if<Take>(&*wish);
    if (take == nullptr) return refusal("a seat must be taken before anything else");
    if (auto good = checked(take->settings); !good) return good;
    auto seat = hall_.take_seat(take->settings);
    if (!seat) return seat.error();
    if (auto sent = send_message(socket_, Seated{(*seat)->state()}, deadline); !sent) return sent;
    robot_ = take->settings.name.empty() ? "robot" : "robot." + take->settings.name;
    slots_ = std::uint32_t(std::clamp(take->settings.run_ahead_frames, 1, int(kMaxSlots) - 2)) + 2;
    sender_ = std::make_unique<PictureSender>(socket_);
    seat_ = std::move(*seat);
    return {};
  }

  /// Until the client leaves, or an error.
  Status converse() {
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
    if (views_.size() >= kMaxViews) return refusal(fmt::format("a seat has {} views at most", kMaxViews));
    if (auto good = checked(request.settings); !good) return good;
    const auto id = seat_->open_view(request.settings);
    if (!id) return reply(Failed{id.error().code, id.error().message});
    views_.push_back({*id, nullptr});
    return reply(ViewOpened{std::uint32_t(views_.size() - 1)});
  }

  Status on(const ConfigureView& request) {
    const CameraSettings& size = request.settings;
    if (request.view >= views_.size()) return no_view(request.view);
    if (auto good = checked(size); !good) return good;
    if (size.width_px > kMaxSide_px || size.height_px > kMaxSide_px) {
      return refusal(fmt::format("pictures of {} x {} pixels: {} a side are the most", size.width_px, size.height_px,
                                 kMaxSide_px));
    }
    View& view = views_[request.view];
    const auto slot_bytes = std::uint64_t(size.width_px) * std::uint64_t(size.height_px) * 3;
    auto frames = SharedFrames::allocate(slots_, slot_bytes);
    if (!frames) return reply(Failed{frames.error().code, frames.error().message});
    if (auto configured = seat_->configure_view(view.id, size); !configured) {
      return reply(Failed{configured.error().code, configured.error().message});
    }
    const UniqueFd file = frames->take_file();
    view.slots = std::make_shared<PictureSlots>(std::move(*frames), size);
    return reply(ViewConfigured{slots_, slot_bytes}, file.get());
  }

  Status on(const ReleaseView& request) {
    if (request.view >= views_.size()) return no_view(request.view);
    seat_->release_view(views_[request.view].id);
    return reply(Done{});
  }

  Status on(const Step& request) {
    if (request.remaining < std::chrono::nanoseconds(0) || request.remaining > kLongestWait) {
      return refusal(fmt::format("a step with a time limit of {} ns", request.remaining.count()));
    }
    const SteadyTime deadline = in(request.remaining);
    while (true) {
      const Status stepped = seat_->step(std::min(deadline, in(kStepSlice)));
      if (stepped) return reply(Stepped{seat_->state()});
      if (stepped.error().code != ErrorCode::kTimeout || std::chrono::steady_clock::now() >= deadline) {
        return reply(Failed{stepped.error().code, stepped.error().message});
      }
      if (stop_) return stopping();
      if (hung_up(socket_)) return gone();
    }
  }

  Status on(const PictureOrder& request) {
    if (request.view >= views_.size()) return no_view(request.view);
    View& view = views_[request.view];
    if (view.slots == nullptr) return refusal("a picture of a view that has no size yet");
    if (request.order <= last_order_) return refusal("the numbers of picture orders must grow");
    if (request.slot >= view.slots->count() || !view.slots->occupy(request.slot)) {
      return refusal(fmt::format("a picture for slot {}, which is in use or not there", request.slot));
    }
    last_order_ = request.order;
    sender_->add({request.order, view.slots, request.slot, seat_->picture(view.id)});
    return {};
  }

  Status on(const Command& request) {
    const WheelSpeeds& speeds = request.speeds;
    if (!std::isfinite(speeds.left_radps) || !std::isfinite(speeds.right_radps)) {
      return refusal(fmt::format("wheel speeds of {} and {} rad/s", speeds.left_radps, speeds.right_radps));
    }
    return reply_with(seat_->command(speeds));
  }

  Status on(const Halt& /*request*/) { return reply_with(seat_->halt()); }

  Status on(const Leave& /*request*/) {
    left_ = true;
    leave("");
    // Not before: the next program may take the seat as soon as this one knows.
    return reply(Done{});
  }

  template <typename Other>
  Status on(const Other& /*message*/) {
    return refusal("that is nothing that a seat can be asked");
  }

  /// Frees the seat, then tells of it: "robot.1 left", and `ending` behind it.
  void leave(const std::string& ending) {
    sender_.reset();
    seat_.reset();
    tell_(fmt::format("{} left{}", robot_, ending));
  }

  Result<Message> receive(SteadyTime deadline) {
    SteadyTime idle_since = std::chrono::steady_clock::now();
    while (true) {
      if (stop_) return stopping();
      // While others do not wait, or its pictures are on their way, it may take its time.
      if (!seat_ || !seat_->is_waited_for() || awaits_pictures()) idle_since = std::chrono::steady_clock::now();
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

  [[nodiscard]] bool awaits_pictures() const {
    return std::any_of(views_.begin(), views_.end(),
                       [](const View& view) { return view.slots && view.slots->is_any_busy(); });
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
  Hall& hall_;
  const std::function<void(const std::string&)>& tell_;
  const std::atomic<bool>& stop_;
  const std::chrono::milliseconds patience_;

  std::string robot_;
  std::unique_ptr<Seat> seat_;
  std::unique_ptr<PictureSender> sender_;
  std::vector<View> views_;
  std::uint32_t slots_ = 0;
  std::uint64_t last_order_ = 0;
  bool left_ = false;
};

}  // namespace

Session::Session(UniqueFd socket, std::shared_ptr<Hall> hall, std::function<void(const std::string&)> tell,
                 const std::atomic<bool>& stop, std::chrono::milliseconds patience)
    : socket_(std::move(socket)),
      hall_(std::move(hall)),
      tell_(std::move(tell)),
      thread_([this, &stop, patience] { work(stop, patience); }) {}

void Session::work(const std::atomic<bool>& stop, std::chrono::milliseconds patience) {
  Talk(socket_.get(), *hall_, tell_, stop, patience).run();
  socket_.reset();
  finished_ = true;
}

}  // namespace twocone::sim_povray::link
