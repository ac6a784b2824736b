// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/live_world.h"

#include <chrono>
#include <utility>

#include <nlohmann/json.hpp>

#include "apps/telemetry/telemetry.h"

namespace twocone::viewer {
namespace {

using Json = nlohmann::ordered_json;

/// More images than a robot may have unfinished at once; older ones are not waited for.
constexpr std::size_t kMostOrdered = 16;

/// Returns whether an image is there, or the reason why it will not come.
bool is_ready(const std::shared_future<ImageResult>& image) {
  return image.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

LiveWorld::LiveWorld(const config::Map& map, std::string name)
    : first_line_(text_of({{"type", "world"},
                           {"schema", telemetry::kSchema},
                           {"name", std::move(name)},
                           {"map", telemetry::map_of(map)}})) {}
LiveWorld::~LiveWorld() = default;

Result<std::string> LiveWorld::open(const PageAddress& at) {
  return serve("world", "twocone: a world with its robots", "This page shows a simulated world with its robots.", at,
               *this, server_);
}

sim_povray::WorldWatch LiveWorld::watch() {
  return {
      .stepped =
          [this](const std::string& robot, const sim_povray::SessionState& state) {
            {
              const std::lock_guard lock(mutex_);
              robots_[robot].state = state;
            }
            offer();
          },
      .ordered =
          [this](const std::string& robot, const std::string& camera, const std::shared_future<ImageResult>& image) {
            const std::lock_guard lock(mutex_);
            auto& ordered = robots_[robot].views[camera].ordered;
            ordered.push_back(image);
            if (ordered.size() > kMostOrdered) ordered.pop_front();
          },
      .left =
          [this](const std::string& robot) {
            {
              const std::lock_guard lock(mutex_);
              robots_.erase(robot);
            }
            offer();
          }};
}

std::vector<web::Message> LiveWorld::opened(web::Client /*client*/) { return {{first_line_}}; }

void LiveWorld::offer() {
  server_->offer([this] { return present(); });
}

std::vector<web::Message> LiveWorld::present() {
  Json robots = Json::array(), images = Json::array();
  std::vector<std::shared_ptr<const Image>> pixels;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [name, robot] : robots_) {
      const Pose2& pose = robot.state.pose;
      robots.push_back({{"name", name},
                        {"t_s", std::chrono::duration<double>(robot.state.now).count()},
                        {"x_m", pose.x_m},
                        {"y_m", pose.y_m},
                        {"heading_rad", pose.heading_rad}});
      if (!robot.state.contact.empty()) robots.back()["contact"] = robot.state.contact;
      for (auto& [camera, view] : robot.views) {
        for (; !view.ordered.empty() && is_ready(view.ordered.front()); view.ordered.pop_front()) {
          if (const ImageResult& image = view.ordered.front().get()) view.shown = *image;
        }
        if (!view.shown) continue;
        images.push_back({{"robot", name}, {"camera", camera}});
        pixels.push_back(view.shown);
      }
    }
  }
  std::vector<web::Message> messages{{text_of({{"type", "robots"}, {"robots", robots}, {"images", images}})}};
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (auto message = image_message(i, 0, *pixels[i])) messages.push_back(*std::move(message));
  }
  return messages;
}

}  // namespace twocone::viewer
