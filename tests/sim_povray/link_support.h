// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdlib.h>
#include <sys/stat.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/server/server.h"
#include "tests/sim_povray/fake_host.h"
#include "tests/support/temporary_folder.h"

namespace twocone::sim_povray {

/// A separate runtime folder for the programs of one test, which find it in their environment.
class RuntimeFolder {
 public:
  RuntimeFolder() { ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1); }
  ~RuntimeFolder() { ::unsetenv("XDG_RUNTIME_DIR"); }
  RuntimeFolder(const RuntimeFolder&) = delete;
  RuntimeFolder& operator=(const RuntimeFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }
  /// Returns the names of the files that servers left in it.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(path() / "twocone", none)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

 private:
  testing_support::TemporaryFolder folder_;
};

/// A fake world that a thread of this program serves.
class TestServer {
 public:
  explicit TestServer(std::string name, std::chrono::milliseconds patience = kIdlePatience)
      : host_(std::make_shared<FakeHost>()) {
    thread_ = std::thread([this, patience, name = std::move(name)] {
      status_ = serve(
          host_, name,
          [this](const std::string& line) {
            const std::lock_guard lock(mutex_);
            lines_.push_back(line);
          },
          stop_, patience);
      ended_ = true;
    });
  }
  ~TestServer() { static_cast<void>(stop()); }
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  Status stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return status_;
  }
  [[nodiscard]] FakeHost& host() { return *host_; }
  [[nodiscard]] bool ended() const { return ended_; }
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  std::shared_ptr<FakeHost> host_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  std::mutex mutex_;
  std::vector<std::string> lines_;
  Status status_;
  std::thread thread_;
};

inline SessionSettings session_named(const std::string& name) { return {.name = name, .body = {.radius_m = 0.2}}; }

}  // namespace twocone::sim_povray
