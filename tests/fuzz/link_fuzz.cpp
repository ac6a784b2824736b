// SPDX-License-Identifier: Apache-2.0
// Garbage for the link: into the decoder, and into a living server's socket. Ends with 1 if a well-behaved program is
// not served as before; a crash or a report of a sanitizer ends it sooner.
//   link_fuzz TIMES SEED
#include <sys/socket.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "drivers/sim_povray/link/client.h"
#include "drivers/sim_povray/link/protocol.h"
#include "drivers/sim_povray/link/socket.h"
#include "tests/sim_povray/link_messages.h"
#include "tests/sim_povray/link_support.h"

using namespace twocone;              // NOLINT(google-build-using-namespace): a program of its own
using namespace twocone::sim_povray;  // NOLINT(google-build-using-namespace): a program of its own

namespace {

using Packet = std::vector<std::uint8_t>;
using link::SteadyTime;

SteadyTime in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

class Garbage {
 public:
  explicit Garbage(std::uint64_t seed) : random_(seed), samples_(link::sample_messages()) {
    // What a server takes at its word, so that the talk gets beyond the handshake.
    for (const std::uint32_t slot : {0u, 1u, 9u}) samples_.emplace_back(link::PictureOrder{slot + 1, 0, slot});
    samples_.emplace_back(link::OpenView{{"lower", 1, {}}});
    samples_.emplace_back(link::ConfigureView{0, {32, 24, 15}});
    samples_.emplace_back(link::Step{std::chrono::milliseconds(1)});
  }

  std::uint64_t below(std::uint64_t end) { return random_() % end; }

  /// Something between a whole message and noise.
  Packet packet() {
    if (below(8) == 0) return noise(below(2) == 0 ? 64 : link::kMaxMessage + 64);
    Packet bytes = link::encode(samples_[below(samples_.size())]);
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
  std::vector<link::Message> samples_;
};

/// One program that talks garbage, from some point of the protocol on.
void talk(Garbage& garbage, const std::filesystem::path& path) {
  const auto socket = link::connect_to(path, in(std::chrono::seconds(5)));
  if (!socket) return;
  const auto say = [&](const Packet& bytes) {
    ::send(socket->get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  };
  const auto good_beginning = garbage.below(4);
  if (good_beginning > 0) say(link::encode(link::Hello{}));
  if (good_beginning > 1) say(link::encode(link::Take{seat_named("2")}));
  if (good_beginning > 2) {
    say(link::encode(link::OpenView{{"lower", 1, {}}}));
    say(link::encode(link::ConfigureView{0, {32, 24, 15}}));
  }
  for (auto packets = garbage.below(12) + 1; packets > 0; --packets) say(garbage.packet());
  if (garbage.below(2) == 0) return;  // away without a word
  // Until the server closes, or has nothing more to say.
  while (link::receive_message(socket->get(), in(std::chrono::milliseconds(3)))) {
  }
}

/// A well-behaved program gets its picture.
bool is_served(const std::string& name) {
  auto seat = take_remote_seat(name, seat_named("1"), std::chrono::seconds(10));
  if (!seat) return std::fprintf(stderr, "no seat: %s\n", seat.error().message.c_str()), false;
  const auto view = (*seat)->open_view({"lower", 1, {}});
  const CameraSettings size{32, 24, 15};
  if (!view || !(*seat)->configure_view(*view, size)) return std::fputs("no view\n", stderr), false;
  const std::uint64_t tick = (*seat)->state().tick;
  const auto picture = (*seat)->picture(*view);
  if (picture.wait_for(std::chrono::seconds(10)) != std::future_status::ready || !picture.get()) {
    return std::fputs("no picture\n", stderr), false;
  }
  if (**picture.get() != fake_picture("1", 0, tick, size)) return std::fputs("a wrong picture\n", stderr), false;
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
    if (const auto message = link::decode(bytes)) {
      ++understood;
      if (link::encode(*message) != bytes) return std::fputs("a message changed on its way\n", stderr), 1;
    }
  }

  const RuntimeFolder runtime;
  TestServer server("fuzz");
  const auto path = world_socket("fuzz");
  if (!path) return std::fprintf(stderr, "%s\n", path.error().message.c_str()), 1;
  for (const auto deadline = in(std::chrono::seconds(10)); !link::connect_to(*path, deadline);) {
    if (std::chrono::steady_clock::now() > deadline) return std::fputs("the server does not begin\n", stderr), 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  constexpr std::uint64_t kTalksBetweenChecks = 50;
  for (std::uint64_t i = 0; i < times; ++i) {
    talk(garbage, *path);
    if (i % kTalksBetweenChecks == 0 && !is_served("fuzz")) return 1;
  }
  if (!is_served("fuzz")) return 1;
  if (!server.stop()) return std::fputs("the server failed\n", stderr), 1;
  if (server.hall().seats() != 0 || !runtime.files().empty()) return std::fputs("something is left\n", stderr), 1;
  std::printf("%llu packets decoded, %llu of them messages; %llu talks with a server that goes on\n",
              static_cast<unsigned long long>(times * kPacketsPerTalk), static_cast<unsigned long long>(understood),
              static_cast<unsigned long long>(times));
  return 0;
}
