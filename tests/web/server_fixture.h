// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/web/server.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/unique_fd.h"
#include "tests/support/fails_with.h"
#include "tests/support/value.h"
#include "tests/web/client.h"

/// A server with a site that records, for its tests.
namespace twocone::web {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing_support::FailsWith;
using testing_support::value;
using namespace std::string_literals;
using Clock = std::chrono::steady_clock;

/// Long enough for everything that a server does at once.
inline constexpr milliseconds kPatience{10'000};
/// A timeout that a test waits for.
inline constexpr milliseconds kShort{200};
/// Less than the timeouts of ServerSettings.
inline constexpr milliseconds kSoon{5'000};
/// More than the kernel takes for a client that does not read, with kSmallBuffer.
inline constexpr std::size_t kMuch = 16'000'000;
inline constexpr int kSmallBuffer = 16'384;

/// A site that records what the server calls, after `act`, which may answer from within a call.
class RecordingSite : public Site {
 public:
  std::vector<Message> opened(Client client) override {
    if (act) act("opened", client);
    record("opened", client);
    return first;
  }
  std::vector<Message> program_opened(Client client) override {
    record("program opened", client);
    return {{"for a program"}};
  }
  void received(Client client, std::string_view text) override {
    if (act) act(std::string(text), client);
    record("received " + std::string(text), client);
  }
  void closed(Client client) override {
    if (act) act("closed", client);
    record("closed", client);
  }
  std::optional<Answer> get(std::string_view path, const Query& query) override {
    if (act) act(std::string(path), 0);
    if (path != "/image") return std::nullopt;
    std::string text;
    for (const auto& [key, content] : query) text.append(key).append("=").append(content).append(";");
    return Answer{"image/png", text};
  }

  /// Waits until `event` was recorded `times` times, of whichever client. Returns false if that takes too long.
  bool saw(const std::string& event, std::size_t times = 1) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return count_locked(event) >= times; });
  }
  std::size_t count(const std::string& event) {
    const std::lock_guard lock(mutex_);
    return count_locked(event);
  }
  std::vector<std::pair<std::string, Client>> events() {
    const std::lock_guard lock(mutex_);
    return events_;
  }

  // To be set before the server starts.
  std::vector<Message> first;
  std::function<void(const std::string&, Client)> act;

 private:
  void record(std::string event, Client client) {
    const std::lock_guard lock(mutex_);
    events_.emplace_back(std::move(event), client);
    changed_.notify_all();
  }
  [[nodiscard]] std::size_t count_locked(const std::string& event) const {
    return std::size_t(std::count_if(events_.begin(), events_.end(), [&](const auto& e) { return e.first == event; }));
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::string, Client>> events_;
};

class WebServer : public testing::Test {
 protected:
  WebServer() { settings_.page = "<!doctype html><title>page</title>"; }
  void open() {
    server_ = value(Server::open(settings_, site_));
    address_ = parse_served(server_->address());
  }
  [[nodiscard]] std::string with_token(const std::string& path, const std::string& query = "") const {
    return path + "?token=" + address_.token + query;
  }
  /// Sends a request on a connection of its own.
  [[nodiscard]] std::optional<Reply> answer_to(const std::string& bytes) const {
    RawClient client(address_);
    client.send(bytes);
    return client.reply();
  }
  [[nodiscard]] int status_of(const std::string& bytes) const {
    const auto reply = answer_to(bytes);
    return reply ? reply->status : 0;
  }
  /// Returns a browser that has opened the stream, and received no message yet.
  [[nodiscard]] RawClient watcher(int receive_buffer = 0) {
    const std::size_t before = site_.count("opened");
    RawClient client(address_, receive_buffer);
    client.send(request(address_, with_token("/stream"), upgrade_headers()));
    const auto reply = client.reply();
    if (!reply || reply->status != 101 || !site_.saw("opened", before + 1)) throw std::runtime_error("no stream");
    return client;
  }
  /// Returns a browser that has opened the stream, and a message that it does not read has begun.
  RawClient stuck_watcher() {
    RawClient client = watcher(kSmallBuffer);
    std::atomic<bool> is_made{false};
    server_->offer([&] {
      is_made = true;
      return std::vector<Message>{{std::string(kMuch, 'x'), true}};
    });
    for (int i = 0; i < 2'000 && !is_made; ++i) std::this_thread::sleep_for(milliseconds(1));
    EXPECT_TRUE(is_made);
    return client;
  }
  void offer(const std::string& text) {
    server_->offer([text] { return std::vector<Message>{{text, false}}; });
  }

  RecordingSite site_;
  ServerSettings settings_;
  std::unique_ptr<Server> server_;
  Address address_;
};

inline std::string text_of(const std::optional<Frame>& frame) {
  if (!frame) return "no frame";
  return frame->opcode == kText ? frame->payload : "opcode " + std::to_string(frame->opcode);
}

}  // namespace twocone::web
