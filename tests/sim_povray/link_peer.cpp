// SPDX-License-Identifier: Apache-2.0
// A program that link_deaths_test kills:
//   link_peer serve NAME           serves a fake world until it is killed
//   link_peer drive NAME ROBOT     drives a robot of that world until it is killed or the world ends
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "drivers/sim_povray/server/server.h"
#include "tests/sim_povray/fake_host.h"

using namespace twocone;
using namespace twocone::sim_povray;

namespace {

int serve_until_killed(const std::string& name) {
  const std::atomic<bool> never{false};
  const Status served = serve(
      std::make_shared<FakeHost>(), name, [](const std::string& line) { std::puts(line.c_str()); }, never);
  std::fprintf(stderr, "link_peer: %s\n", served.error().message.c_str());
  return 1;
}

int drive_until_killed(const std::string& name, const std::string& robot) {
  SessionSettings settings{.name = robot};
  auto session = join_served_world(name, settings, std::chrono::seconds(5));
  if (!session) return std::fprintf(stderr, "link_peer: %s\n", session.error().message.c_str()), 1;
  std::vector<RobotSession::ViewId> views;
  for (const char* camera : {"lower", "upper"}) {
    auto view = (*session)->open_view({camera, 1, {}});
    if (!view || !(*session)->configure_view(*view, {64, 48, 15})) return 1;
    views.push_back(*view);
  }
  while (true) {
    if (!(*session)->command({1, 2})) return 1;
    std::vector<std::shared_future<ImageResult>> images;
    for (const auto view : views) images.push_back((*session)->image(view));
    const Status stepped = (*session)->step(std::chrono::steady_clock::now() + std::chrono::seconds(1));
    if (!stepped && stepped.error().code != ErrorCode::kTimeout) return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 2 && arguments[0] == "serve") return serve_until_killed(arguments[1]);
  if (arguments.size() == 3 && arguments[0] == "drive") return drive_until_killed(arguments[1], arguments[2]);
  std::fputs("link_peer serve NAME | drive NAME ROBOT\n", stderr);
  return 2;
}
