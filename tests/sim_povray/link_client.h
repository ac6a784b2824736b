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

#include "drivers/sim_povray/server/protocol.h"
#include "drivers/sim_povray/server/server.h"
#include "drivers/sim_povray/server/socket.h"
#include "tests/sim_povray/link_support.h"
#include "tests/sim_povray/test_support.h"

/// Clients of a served world, and checks of its answers.
namespace twocone::sim_povray {

inline constexpr CameraSettings kSize{64, 48, 15};
/// Time limit of an operation that succeeds, on a machine under load.
inline constexpr std::chrono::seconds kPatience{10};
/// Time limit within which a survivor must notice that its peer has ended.
inline constexpr std::chrono::seconds kNoticed{2};

using server::in;
using server::SteadyTime;

/// @throws std::runtime_error if the world refuses the robot
inline std::unique_ptr<RobotSession> join_world(const std::string& robot, const std::string& name = "lab") {
  const auto join = [&] { return join_served_world(name, session_named(robot), kPatience); };
  auto joined = join();
  // The server's thread may not listen yet.
  eventually([&] {
    if (!joined && joined.error().code == ErrorCode::kNotFound) joined = join();
    return joined.has_value() || joined.error().code != ErrorCode::kNotFound;
  });
  return value(std::move(joined));
}

inline void open_views(RobotSession& session) {
  for (const char* camera : {"lower", "upper"}) {
    value(session.configure_view(value(session.open_view({camera, 1, {}})), kSize));
  }
}

inline void expect_image(const std::shared_future<ImageResult>& image, const Image& expected) {
  ASSERT_EQ(image.wait_for(kPatience), std::future_status::ready);
  ASSERT_TRUE(image.get()) << image.get().error().message;
  EXPECT_TRUE(**image.get() == expected);
}

inline void expect_disconnected(const std::shared_future<ImageResult>& image) {
  ASSERT_EQ(image.wait_for(kNoticed), std::future_status::ready);
  ASSERT_FALSE(image.get());
  EXPECT_EQ(image.get().error().code, ErrorCode::kDisconnected);
}

/// A client that can break the protocol.
class RawClient {
 public:
  explicit RawClient(const std::string& name = "lab") {
    const auto path = world_socket(name);
    eventually([&] {
      auto socket = server::connect_to(*path, in(kPatience));
      if (socket) socket_ = std::move(*socket);
      return socket_.valid();
    });
  }
  void send(const server::Message& message) {
    const Status sent = server::send_message(socket_.get(), message, in(kPatience));
    EXPECT_TRUE(sent) << sent.error().message;
  }
  void send_bytes(const std::vector<std::uint8_t>& bytes) {
    ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  std::optional<server::Message> receive() {
    auto received = server::receive_message(socket_.get(), in(kPatience));
    if (!received) return std::nullopt;
    return std::move(received->message);
  }
  /// Returns the message of the next Failed, after any other messages. Then the link must be closed.
  std::string refusal() {
    while (const auto message = receive()) {
      if (const auto* failed = std::get_if<server::Failed>(&*message)) {
        EXPECT_FALSE(receive()) << "the link was not closed";
        return failed->message;
      }
    }
    return "(closed without a message)";
  }
  void greet() {
    send(server::Hello{});
    ASSERT_TRUE(receive());
  }
  void join(const std::string& robot) {
    greet();
    send(server::Take{session_named(robot)});
    const auto answer = receive();
    ASSERT_TRUE(answer && std::holds_alternative<server::Sessioned>(*answer));
  }
  void join_with_view(const std::string& robot) {
    join(robot);
    send(server::OpenView{{"lower", 1, {}}});
    ASSERT_TRUE(receive());
    send(server::ConfigureView{0, kSize});
    ASSERT_TRUE(receive());
  }
  [[nodiscard]] int fd() const { return socket_.get(); }

 private:
  base::UniqueFd socket_;
};

class Link : public testing::Test {
 protected:
  RuntimeFolder runtime_;
};

}  // namespace twocone::sim_povray
