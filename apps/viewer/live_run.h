// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runs/remote_control.h"
#include "apps/runs/run.h"
#include "apps/telemetry/telemetry.h"
#include "apps/viewer/foxglove_stream.h"
#include "apps/viewer/serving.h"
#include "apps/web/server.h"
#include "hal/result.h"

namespace twocone::viewer {

/// Shows a run in browsers while it is driven, and takes requests of persons (docs/telemetry.md). The run does not wait
/// for a browser: a frame costs it a copy of its rows, and all else is done in the server's thread.
///
/// One browser drives at a time: the first that requests a motion. It drives until it releases the wheels, its
/// connection ends, or nothing has arrived from it for RemoteControl::kValid. Every browser may stop the wheels. A
/// program of foxglove_address() only watches.
class LiveRun final : private web::Site {
 public:
  /// @param manual whether the run's behaviour is manual; else a request to drive is refused
  LiveRun(const config::Robot& robot, const config::Map& map, bool maps, bool manual);
  ~LiveRun() override;

  /// Begins to serve, and returns the page's address with its token. Errors: those of web::Server::open
  Result<std::string> open(const PageAddress& at);
  /// Returns the address for programs that speak the Foxglove WebSocket protocol. Requires open().
  [[nodiscard]] std::string foxglove_address() const { return server_->program_address(); }

  /// Sets remote, opened and finished of the options. This object must outlive the run.
  void watch(runs::RunOptions& options);
  /// Shows an event of the run.
  void event(const std::string& text);
  /// Shows that the run has ended. @param why text if it was cut off; empty: it took all its frames
  void end(const std::string& why);

 private:
  std::vector<web::Message> opened(web::Client client) override;
  std::vector<web::Message> program_opened(web::Client client) override;
  void received(web::Client client, std::string_view text) override;
  void closed(web::Client client) override;

  void show(const runs::FinishedFrame& frame, const runs::LiveFigures& figures);
  void drive(web::Client client, double speed, double turn);
  void release();
  void refuse(web::Client client, std::string_view why);
  /// Sends the present state to all browsers if it has changed.
  void send_status();
  [[nodiscard]] bool is_driven() const;

  const bool manual_;
  const telemetry::Sensors sensors_;
  const telemetry::Lines lines_;
  runs::RemoteControl remote_;
  std::atomic<int> frames_{0};
  std::mutex mutex_;                                    // protects the next three
  std::string run_line_;                                // empty until the run has begun
  double t_s_ = 0;                                      // of the newest frame
  std::vector<std::pair<double, std::string>> events_;  // with their times; not yet given to foxglove_
  // Members of the server's thread.
  std::vector<web::Client> clients_;
  FoxgloveStream foxglove_;
  std::optional<web::Client> driver_;
  std::chrono::steady_clock::time_point driven_at_{};
  std::string sent_status_;
  std::unique_ptr<web::Server> server_;  // its thread uses all members above
};

}  // namespace twocone::viewer
