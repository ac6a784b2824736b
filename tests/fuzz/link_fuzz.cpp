// SPDX-License-Identifier: Apache-2.0
// Feeds garbage to the link: to the decoder, and to the socket of a running server. The exit status is 1 if a
// well-behaved program is not served as before. A crash or a report of a sanitizer ends the program earlier.
//   link_fuzz TIMES SEED
#include <sys/socket.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "drivers/sim_povray/server/protocol.h"
#include "drivers/sim_povray/server/server.h"
#include "drivers/sim_povray/server/socket.h"
#include "tests/sim_povray/link_messages.h"
#include "tests/sim_povray/link_support.h"

using namespace twocone;              // NOLINT(google-build-using-namespace): this is a separate program
using namespace twocone::sim_povray;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

using Packet = std::vector<std::uint8_t>;
using server::SteadyTime;

SteadyTime in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

class Garbage {
 public:
  explicit Garbage(std::uint64_t seed) : random_(seed), samples_(server::sample_messages()) {
    // Valid messages, so that the exchange gets beyond the handshake.
    for (const std::uint32_t slot : {0u, 1u, 9u}) samples_.emplace_back(server::ImageOrder{slot + 1, 0, slot});
    samples_.emplace_back(server::OpenView{{"lower", 1, {}}});
    samples_.emplace_back(server::ConfigureView{0, {32, 24, 15}});
    samples_.emplace_back(server::Step{std::chrono::milliseconds(1)});
  }

  std::uint64_t below(std::uint64_t end) { return random_() % end; }

  /// Bytes between a valid message and noise.
  Packet packet() {
    if (below(8) == 0) return noise(below(2) == 0 ? 64 : server::kMaxMessage + 64);
    Packet bytes = server::encode(samples_[below(samples_.size())]);
    if (below(3) == 0) return bytes;
    for (auto changes = below(4); changes > 0; --changes) bytes[below(bytes.size())] = value();
    if (below(4) == 0) bytes.resize(below(bytes.size() + 1));
    if (below(8) == 0) bytes.insert(bytes.end(), below(32), value());
    return bytes;
  }

 private:
  std::uint8_t value() {
    constexpr std::uint8_t kEdges[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
    return below(2) == 0 ? kEdges[below(std::size(kEdges))] : std::uint8_t(random_());
  }
  Packet noise(std::uint64_t most) {
    Packet bytes(below(most) + 1);
    for (auto& byte : bytes) byte = std::uint8_t(random_());
    return bytes;
  }

  std::mt19937_64 random_;
  std::vector<server::Message> samples_;
};

/// A client that sends garbage from some point of the protocol on.
void talk(Garbage& garbage, const std::filesystem::path& path) {
  const auto socket = server::connect_to(path, in(std::chrono::seconds(5)));
  if (!socket) return;
  const auto send = [&](const Packet& bytes) {
    ::send(socket->get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  };
  const auto good_beginning = garbage.below(4);
  if (good_beginning > 0) send(server::encode(server::Hello{}));
  if (good_beginning > 1) send(server::encode(server::Take{session_named("2")}));
  if (good_beginning > 2) {
    send(server::encode(server::OpenView{{"lower", 1, {}}}));
    send(server::encode(server::ConfigureView{0, {32, 24, 15}}));
  }
  for (auto packets = garbage.below(12) + 1; packets > 0; --packets) send(garbage.packet());
  if (garbage.below(2) == 0) return;  // some clients leave without reading
  // Others read until the server closes, or sends nothing more.
  while (server::receive_message(socket->get(), in(std::chrono::milliseconds(3)))) {
  }
}

/// Returns whether a well-behaved program gets its image.
bool is_served(const std::string& name) {
  auto session = join_served_world(name, session_named("1"), std::chrono::seconds(10));
  if (!session) return std::fprintf(stderr, "no session: %s\n", session.error().message.c_str()), false;
  const auto view = (*session)->open_view({"lower", 1, {}});
  const CameraSettings size{32, 24, 15};
  if (!view || !(*session)->configure_view(*view, size)) return std::fputs("no view\n", stderr), false;
  const std::uint64_t step = (*session)->state().step;
  const auto image = (*session)->image(*view);
  if (image.wait_for(std::chrono::seconds(10)) != std::future_status::ready || !image.get()) {
    return std::fputs("no image\n", stderr), false;
  }
  if (**image.get() != fake_image("1", 0, step, size)) return std::fputs("a wrong image\n", stderr), false;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("link_fuzz TIMES SEED\n", stderr), 2;
  const auto times = std::strtoull(argv[1], nullptr, 10);
  Garbage garbage(std::strtoull(argv[2], nullptr, 10));

  std::uint64_t understood = 0;
  constexpr int kPacketsPerTalk = 20;
  for (std::uint64_t i = 0; i < times * kPacketsPerTalk; ++i) {
    const Packet bytes = garbage.packet();
    if (const auto message = server::decode(bytes)) {
      ++understood;
      if (server::encode(*message) != bytes) return std::fputs("a message changed on its way\n", stderr), 1;
    }
  }

  const RuntimeFolder runtime;
  TestServer server("fuzz");
  const auto path = world_socket("fuzz");
  if (!path) return std::fprintf(stderr, "%s\n", path.error().message.c_str()), 1;
  for (const auto deadline = in(std::chrono::seconds(10)); !server::connect_to(*path, deadline);) {
    if (std::chrono::steady_clock::now() > deadline) return std::fputs("the server does not start\n", stderr), 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  constexpr std::uint64_t kTalksBetweenChecks = 50;
  for (std::uint64_t i = 0; i < times; ++i) {
    talk(garbage, *path);
    if (i % kTalksBetweenChecks == 0 && !is_served("fuzz")) return 1;
  }
  if (!is_served("fuzz")) return 1;
  if (!server.stop()) return std::fputs("the server failed\n", stderr), 1;
  if (server.host().sessions() != 0 || !runtime.files().empty()) {
    return std::fputs("a session or a file remains\n", stderr), 1;
  }
  std::printf("%llu packets decoded, %llu of them messages; %llu exchanges with a server that still runs\n",
              static_cast<unsigned long long>(times * kPacketsPerTalk), static_cast<unsigned long long>(understood),
              static_cast<unsigned long long>(times));
  return 0;
}
