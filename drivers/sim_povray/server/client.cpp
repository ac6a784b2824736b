// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/server.h"

#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "drivers/sim_povray/server/images.h"
#include "drivers/sim_povray/server/protocol.h"
#include "drivers/sim_povray/server/socket.h"
#include "hal/clock.h"

namespace twocone::sim_povray {
namespace {

using namespace server;  // NOLINT(google-build-using-namespace): its own side of the link

/// Extra time for a reply; a server that runs answers in far less.
constexpr std::chrono::seconds kReplyTime{5};
/// Time for the lock of a killed server to be released.
constexpr std::chrono::milliseconds kSweepTime{200};
/// Time for the server's answer to Leave; without the answer, the server still notices the closed link.
constexpr std::chrono::seconds kFarewellTime{2};
/// Time for a slot to become free: longer than the longest rendering.
constexpr std::chrono::minutes kSlotTime{3};

bool is_sound(const SessionState& state) {
  return state.now >= std::chrono::nanoseconds(0) && std::isfinite(state.pose.x_m) && std::isfinite(state.pose.y_m) &&
         std::isfinite(state.pose.heading_rad) && std::isfinite(state.left_rad) && std::isfinite(state.right_rad);
}

/// Refuses a text longer than kMaxText, which would be cut on its way.
void check_text(const char* field, const std::string& text) {
  if (text.size() <= kMaxText) return;
  throw base::InvalidArgument("{} is {} bytes long; {} are the most", field, text.size(), kMaxText);
}

class RemoteSession final : public RobotSession {
 public:
  RemoteSession(const std::string& name, std::filesystem::path path, base::UniqueFd socket, SessionState state)
      : server_(fmt::format("the program that serves '{}'", name)),
        path_(std::move(path)),
        socket_(std::move(socket)),
        state_(std::move(state)),
        reader_([this] { read(); }) {}

  ~RemoteSession() override {
    // The answer comes when the session is free, so that the next program finds it free.
    leaving_ = true;
    (void)ask(Leave{}, in(kFarewellTime));  // the link ends either way
    ::shutdown(socket_.get(), SHUT_RDWR);
    reader_.join();
  }

  [[nodiscard]] const SessionState& state() const override { return state_; }

  Result<ViewId> open_view(const ViewSettings& view) override {
    check(view);
    check_text("camera_name", view.camera_name);
    const auto opened = ask_for<ViewOpened>(OpenView{view}, in(kReplyTime));
    if (!opened) return opened.error();
    if (opened->view != views_.size()) return nonsense("a view's number");
    views_.emplace_back();
    return opened->view;
  }

  Status configure_view(ViewId view, const CameraSettings& settings) override {
    check(settings);
    base::UniqueFd file;
    const auto configured = ask_for<ViewConfigured>(ConfigureView{view, settings}, in(kReplyTime), &file);
    if (!configured) return configured.error();
    const std::uint64_t bytes = *image_bytes(PixelFormat::kRgb8, settings.width_px, settings.height_px);
    if (configured->slots == 0 || configured->slots > kMaxSlots || configured->slot_bytes != bytes ||
        view >= views_.size()) {
      return nonsense("shared memory");
    }
    auto frames = SharedFrames::adopt(std::move(file), configured->slots, bytes);
    if (!frames) return frames.error();
    views_[view] = std::make_shared<Slots>(Slots{std::move(*frames), settings, std::vector<bool>(configured->slots)});
    return {};
  }

  void release_view(ViewId view) noexcept override {
    try {
      (void)demand(ReleaseView{view});  // a link that is broken holds no rate
    } catch (const std::exception&) {
    }
  }

  Status step(SteadyTime deadline) override {
    const SteadyTime now = std::chrono::steady_clock::now();
    const auto remaining = std::min<std::chrono::nanoseconds>(std::max(deadline, now) - now, kLongestWait);
    auto stepped = ask_for<Stepped>(Step{remaining}, in(remaining + kReplyTime));
    if (!stepped) return stepped.error();
    if (!is_sound(stepped->state)) return nonsense("a robot's state");
    state_ = std::move(stepped->state);
    return {};
  }

  std::shared_future<ImageResult> image(ViewId view) override {
    std::unique_lock lock(mutex_);
    if (view >= views_.size() || views_[view] == nullptr) {
      return ready_image(Error(ErrorCode::kInvalidState, "view {} has not been configured", view));
    }
    const std::shared_ptr<Slots> slots = views_[view];
    const auto free = [&] { return std::find(slots->busy.begin(), slots->busy.end(), false); };
    changed_.wait_until(lock, in(kSlotTime), [&] { return broken_ || free() != slots->busy.end(); });
    if (broken_) return ready_image(*broken_);
    if (free() == slots->busy.end()) {
      return ready_image(Error(ErrorCode::kTimeout, "{} images are still on their way", slots->busy.size()));
    }
    const auto slot = std::uint32_t(free() - slots->busy.begin());
    slots->busy[slot] = true;
    const std::uint64_t order = ++last_order_;
    Order& entry = orders_[order];
    entry.slots = slots;
    entry.slot = slot;
    auto future = entry.promise.get_future().share();
    lock.unlock();
    if (auto sent = send_message(socket_.get(), ImageOrder{order, view, slot}, in(kReplyTime)); !sent) {
      give_up(no_answer());
    }
    return future;
  }

  Status command(const WheelSpeeds& speeds) override {
    if (!std::isfinite(speeds.left_radps) || !std::isfinite(speeds.right_radps)) {
      throw base::InvalidArgument("wheel speeds are {} and {} rad/s; finite wanted", speeds.left_radps,
                                  speeds.right_radps);
    }
    return demand(Command{speeds});
  }

  Status halt() noexcept override {
    try {
      return demand(Halt{});
    } catch (const std::exception& error) {
      return Error{ErrorCode::kDisconnected, error.what()};
    }
  }

 private:
  /// A view's shared memory, and its slots that wait for an image.
  struct Slots {
    SharedFrames frames;
    CameraSettings size;
    std::vector<bool> busy;
  };
  struct Order {
    std::promise<ImageResult> promise;
    std::shared_ptr<Slots> slots;
    std::uint32_t slot = 0;
  };

  /// Requests something that has a result. Errors: the error that the server sends, or kDisconnected.
  template <typename Reply>
  Result<Reply> ask_for(const Message& request, SteadyTime deadline, base::UniqueFd* file = nullptr) {
    auto received = ask(request, deadline);
    if (!received) return received.error();
    if (auto* failed = std::get_if<Failed>(&*received->message)) return Error{failed->code, failed->message};
    auto* reply = std::get_if<Reply>(&*received->message);
    if (reply == nullptr) return nonsense("a reply");
    if (file != nullptr) *file = std::move(received->file);
    return std::move(*reply);
  }

  /// Requests something that has no result. Errors: as ask_for().
  Status demand(const Message& request) {
    if (auto done = ask_for<Done>(request, in(kReplyTime)); !done) return done.error();
    return {};
  }

  /// Returns the reply, whatever it is. A missing reply breaks the link, so that no reply can come late.
  Result<Received> ask(const Message& request, SteadyTime deadline) {
    {
      const std::lock_guard lock(mutex_);
      if (broken_) return *broken_;
      asking_ = true;
      reply_.reset();
    }
    const Status sent = send_message(socket_.get(), request, deadline);
    std::unique_lock lock(mutex_);
    // If a message cannot be sent, the reader finds the reason.
    changed_.wait_until(lock, sent ? deadline : in(kFarewellTime), [this] { return reply_ || broken_; });
    asking_ = false;
    if (reply_) return std::move(*reply_);
    if (broken_) return *broken_;
    lock.unlock();
    return give_up(no_answer());
  }

  [[nodiscard]] Error no_answer() const { return {ErrorCode::kDisconnected, server_ + " does not answer"}; }
  Error nonsense(const char* what) {
    return give_up(Error(ErrorCode::kDisconnected, "{} sent {} that makes no sense", server_, what));
  }

  /// Ends the link: all waits fail, and so do later calls. The first reason is kept.
  Error give_up(Error why) {
    std::map<std::uint64_t, Order> orders;
    {
      const std::lock_guard lock(mutex_);
      if (!broken_) broken_ = std::move(why);
      why = *broken_;
      orders.swap(orders_);
    }
    changed_.notify_all();
    ::shutdown(socket_.get(), SHUT_RDWR);
    for (auto& [number, order] : orders) order.promise.set_value(why);
    return why;
  }

  void read() noexcept {
    try {
      while (read_one()) {
      }
    } catch (const std::exception& error) {
      give_up(Error(ErrorCode::kDisconnected, "the link to {} broke: {}", server_, error.what()));
    }
  }

  /// Returns false when the link has ended.
  bool read_one() {
    auto received = receive_message(socket_.get(), in(std::chrono::seconds(1)), Files::kTake);
    if (!received) {
      if (received.error().code == ErrorCode::kTimeout) return true;
      give_up({ErrorCode::kDisconnected, server_ + " has ended or closed the link"});
      if (!left_) sweep(path_, kSweepTime);
      return false;
    }
    if (!received->message) return nonsense("something"), false;
    if (const auto* there = std::get_if<ImageDone>(&*received->message)) {
      return finish(there->order, [there](const Order& order) { return copy(order, there->format); });
    }
    if (const auto* failed = std::get_if<ImageFailed>(&*received->message)) {
      return finish(failed->order, [failed](const Order&) {
        return ImageResult(Error{failed->code, failed->message});
      });
    }
    {
      const std::lock_guard lock(mutex_);
      if (asking_ && !reply_) {
        reply_ = std::move(*received);
        left_ = leaving_;
        changed_.notify_all();
        return true;
      }
    }
    if (const auto* failed = std::get_if<Failed>(&*received->message)) {
      give_up(Error(ErrorCode::kDisconnected, "{} closed the link: {}", server_, failed->message));
    } else {
      nonsense("something unasked");
    }
    return false;
  }

  template <typename Outcome>
  bool finish(std::uint64_t number, Outcome outcome) {
    std::optional<Order> order;
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = orders_.find(number); found != orders_.end()) {
        order = std::move(found->second);
        orders_.erase(found);
      }
    }
    if (!order) return nonsense("an image"), false;
    ImageResult result = outcome(*order);
    {
      const std::lock_guard lock(mutex_);
      order->slots->busy[order->slot] = false;
    }
    changed_.notify_all();
    order->promise.set_value(std::move(result));
    return true;
  }

  static ImageResult copy(const Order& order, PixelFormat format) {
    const CameraSettings& size = order.slots->size;
    const std::size_t count = image_bytes(format, size.width_px, size.height_px).value_or(0);
    const auto bytes = order.slots->frames.read(order.slot).first(count);
    return std::make_shared<const Image>(Image{size.width_px, size.height_px, format, {bytes.begin(), bytes.end()}});
  }

  const std::string server_;  ///< name in messages
  const std::filesystem::path path_;
  const base::UniqueFd socket_;
  SessionState state_;
  std::vector<std::shared_ptr<Slots>> views_;  ///< none before a view's first configuration

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Error> broken_;
  bool asking_ = false;
  std::optional<Received> reply_;
  std::map<std::uint64_t, Order> orders_;
  std::uint64_t last_order_ = 0;
  std::atomic<bool> leaving_{false};
  bool left_ = false;  ///< left by a completed Leave; used by the reader alone

  std::thread reader_;  // last: it uses all of the above
};

Error not_twocone(const std::string& name) {
  return Error(ErrorCode::kBadData, "the program that serves '{}' is not twocone", name);
}

/// Receives a message of a server before there is a session.
Result<Message> hear(int socket, const std::string& name, SteadyTime deadline) {
  auto received = receive_message(socket, deadline);
  if (!received) {
    return Error(received.error().code, "the program that serves '{}': {}", name,
                 received.error().code == ErrorCode::kTimeout ? "no answer" : received.error().message);
  }
  if (!received->message) return not_twocone(name);
  if (const auto* failed = std::get_if<Failed>(&*received->message)) return Error{failed->code, failed->message};
  return std::move(*received->message);
}

Status compare(const Result<Message>& heard, const std::string& name) {
  const auto* theirs = std::get_if<Hello>(&*heard);
  if (theirs == nullptr || theirs->magic != kMagic) return not_twocone(name);
  const Hello own;
  if (theirs->version == own.version) return {};
  return Error(ErrorCode::kRefused,
               "'{}' is served with version {} of the link ({}), this program speaks version {} ({})", name,
               theirs->version, theirs->program, own.version, own.program);
}

}  // namespace

Result<std::unique_ptr<RobotSession>> join_served_world(const std::string& name, const SessionSettings& settings,
                                                        std::chrono::milliseconds timeout) {
  check(settings);
  check_text("name", settings.name);
  check_text("body.name", settings.body.name);
  const SteadyTime deadline =
      in(std::clamp<std::chrono::milliseconds>(timeout, std::chrono::milliseconds(0), kLongestWait));
  const auto path = world_socket(name);
  if (!path) return path.error();
  auto socket = connect_to(*path, deadline);
  if (!socket) {
    if (socket.error().code != ErrorCode::kNotFound) return socket.error();
    sweep(*path, std::chrono::milliseconds(0));
    return Error(ErrorCode::kNotFound, "no program serves a world '{}' here; `twocone serve` does", name);
  }
  // A server that refuses this program does so whether or not it has read this; its reason is received below.
  (void)send_message(socket->get(), Hello{}, deadline);
  const auto hello = hear(socket->get(), name, deadline);
  if (!hello) return hello.error();
  if (auto same = compare(hello, name); !same) return same.error();
  (void)send_message(socket->get(), Take{settings}, deadline);
  auto answer = hear(socket->get(), name, deadline);
  if (!answer) return answer.error();
  auto* joined = std::get_if<Sessioned>(&*answer);
  if (joined == nullptr || !is_sound(joined->state)) {
    return Error(ErrorCode::kBadData, "the program that serves '{}' answers with nonsense", name);
  }
  return std::unique_ptr<RobotSession>(
      std::make_unique<RemoteSession>(name, *path, std::move(*socket), std::move(joined->state)));
}

}  // namespace twocone::sim_povray
