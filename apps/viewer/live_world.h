// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/viewer/serving.h"
#include "apps/web/server.h"
#include "drivers/sim_povray/simulation_host.h"
#include "hal/result.h"

namespace twocone::viewer {

/// Shows a world that this program serves for others: where its robots really are, and what their cameras see
/// (docs/telemetry.md). Browsers can only watch.
class LiveWorld final : private web::Site {
 public:
  LiveWorld(const config::Map& map, std::string name);
  ~LiveWorld() override;

  /// Begins to serve, and returns the page's address with its token. Errors: those of web::Server::open
  Result<std::string> open(const PageAddress& at);

  /// Returns the functions that show the world. They use this object, which must outlive their last call.
  sim_povray::WorldWatch watch();

 private:
  struct View {
    std::deque<std::shared_future<ImageResult>> ordered;  ///< images that may not be there yet, the newest last
    std::shared_ptr<const Image> shown;                   ///< the newest that is there; null: none yet
  };
  struct RobotInWorld {
    sim_povray::SessionState state;
    std::map<std::string, View> views;  ///< by camera
  };

  std::vector<web::Message> opened(web::Client client) override;
  void offer();
  [[nodiscard]] std::vector<web::Message> present();

  const std::string first_line_;
  std::mutex mutex_;  // protects robots_
  std::map<std::string, RobotInWorld> robots_;
  std::unique_ptr<web::Server> server_;  // its thread uses all members above
};

}  // namespace twocone::viewer
