// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/stop_signals.h"

#include <csignal>

namespace twocone::cli {
namespace {

std::atomic<bool> stop_asked{false};
std::atomic<int> signal_received{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler may touch them");

void on_signal(int signal) {
  signal_received = signal;
  stop_asked = true;
}

}  // namespace

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESETHAND;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // A program that was started with nohup must outlive the terminal.
  struct sigaction before {};
  ::sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
  return stop_asked;
}

int stop_signal() { return signal_received; }

}  // namespace twocone::cli
