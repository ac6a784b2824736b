// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/link/client.h"
#include "drivers/sim_povray/link/protocol.h"
#include "drivers/sim_povray/link/socket.h"
#include "tests/sim_povray/link_support.h"
#include "tests/sim_povray/test_support.h"

/// Clients of a served world, and what they expect of it.
namespace twocone::sim_povray {

inline constexpr CameraSettings kSize{64, 48, 15};
/// What the brief moment in which all is well may take on a machine under load.
inline constexpr std::chrono::seconds kPatience{10};
/// Within which a survivor must have noticed.
inline constexpr std::chrono::seconds kNoticed{2};

using link::SteadyTime;
inline SteadyTime in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

inline std::unique_ptr<Seat> take(const std::string& robot, const std::string& name = "hall") {
  std::unique_ptr<Seat> seat;
  Error last{};
  // The server's thread may not listen yet.
  eventually([&] {
    auto taken = take_remote_seat(name, seat_named(robot), kPatience);
    if (taken) seat = std::move(*taken);
    if (!taken) last = taken.error();
    return taken.has_value() || last.code != ErrorCode::kNotFound;
  });
  EXPECT_TRUE(seat) << last.message;
  return seat;
}

inline void open_views(Seat& seat) {
  for (const char* camera : {"lower", "upper"}) {
    const auto view = seat.open_view({camera, 1, {}});
    ASSERT_TRUE(view) << view.error().message;
    const Status configured = seat.configure_view(*view, kSize);
    ASSERT_TRUE(configured) << configured.error().message;
  }
}

inline void expect_picture(const std::shared_future<ImageResult>& picture, const Image& expected) {
  ASSERT_EQ(picture.wait_for(kPatience), std::future_status::ready);
  ASSERT_TRUE(picture.get()) << picture.get().error().message;
  EXPECT_TRUE(**picture.get() == expected);
}

inline void expect_disconnected(const std::shared_future<ImageResult>& picture) {
  ASSERT_EQ(picture.wait_for(kNoticed), std::future_status::ready);
  ASSERT_FALSE(picture.get());
  EXPECT_EQ(picture.get().error().code, ErrorCode::kDisconnected);
}

/// A program that does not keep to the protocol.
class RawClient {
 public:
  explicit RawClient(const std::string& name = "hall") {
    const auto path = world_socket(name);
    eventually([&] {
      auto socket = link::connect_to(*path, in(kPatience));
      if (socket) socket_ = std::move(*socket);
      return socket_.valid();
    });
  }
  void say(const link::Message& message) {
    const Status sent = link::send_message(socket_.get(), message, in(kPatience));
    EXPECT_TRUE(sent) << sent.error().message;
  }
  void say_bytes(const std::vector<std::uint8_t>& bytes) {
    ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  std::optional<link::Message> hear() {
    auto received = link::receive_message(socket_.get(), in(kPatience));
    if (!received) return std::nullopt;
    return std::move(received->message);
  }
  /// The next Failed, whatever comes before it; then the link must be closed.
  std::string refusal() {
    while (const auto message = hear()) {
      if (const auto* failed = std::get_if<link::Failed>(&*message)) {
        EXPECT_FALSE(hear()) << "the link was not closed";
        return failed->message;
      }
    }
    return "(closed without a word)";
  }
  void greet() {
    say(link::Hello{});
    ASSERT_TRUE(hear());
  }
  void sit(const std::string& robot) {
    greet();
    say(link::Take{seat_named(robot)});
    const auto answer = hear();
    ASSERT_TRUE(answer && std::holds_alternative<link::Seated>(*answer));
  }
  void sit_with_view(const std::string& robot) {
    sit(robot);
    say(link::OpenView{{"lower", 1, {}}});
    ASSERT_TRUE(hear());
    say(link::ConfigureView{0, kSize});
    ASSERT_TRUE(hear());
  }
  [[nodiscard]] int fd() const { return socket_.get(); }

 private:
  UniqueFd socket_;
};

class Link : public testing::Test {
 protected:
  RuntimeFolder runtime_;
};

}  // namespace twocone::sim_povray
