// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/live_run.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/estimation/mapping.h"

namespace twocone::viewer {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

}  // namespace

LiveRun::LiveRun(const config::Robot& robot, const config::Map& map, bool maps, bool manual)
    : manual_(manual),
      sensors_(telemetry::sensors_of(robot, maps)),
      lines_(robot, maps ? estimation::without_landmarks(map) : map) {}

LiveRun::~LiveRun() = default;

Result<std::string> LiveRun::open(const PageAddress& at) {
  return serve("live", "twocone: a robot that drives", "This page shows a robot while it drives.", at, *this, server_);
}

void LiveRun::watch(runs::RunOptions& options) {
  options.remote = &remote_;
  options.opened = [this, name = options.out.filename().string()](const runlog::RunInfo& info) {
    Json line = lines_.run(name, info, sensors_);
    line["live"] = true;
    const std::string text = text_of(line);
    {
      const std::lock_guard lock(mutex_);
      run_line_ = text;
    }
    server_->send(text);
  };
  options.finished = [this](const runs::FinishedFrame& frame, const runs::LiveFigures& figures) {
    show(frame, figures);
  };
}

void LiveRun::show(const runs::FinishedFrame& frame, const runs::LiveFigures& figures) {
  ++frames_;
  server_->offer([this, record = frame.record, lower = frame.lower, upper = frame.upper, figures] {
    send_status();  // a driver may have fallen silent
    std::vector<web::Message> messages;
    for (const auto& [side, image] : {std::pair{vision::Side::kLower, lower}, {vision::Side::kUpper, upper}}) {
      if (auto message = image_message(record.frame.frame, int(side), *image)) messages.push_back(*std::move(message));
    }
    Json line = lines_.frame(record);
    line["age_s"] = figures.age_s;
    if (figures.late_frames) line["late_frames"] = *figures.late_frames;
    messages.push_back({text_of(line)});
    return messages;
  });
}

void LiveRun::event(const std::string& text) {
  server_->send(text_of({{"type", "event"}, {"frame", frames_.load()}, {"text", text}}));
}

void LiveRun::end(const std::string& why) {
  Json line{{"type", "end"}, {"finished", why.empty()}};
  if (!why.empty()) line["text"] = why;
  server_->send(text_of(line));
}

bool LiveRun::is_driven() const { return driver_ && Clock::now() - driven_at_ <= runs::RemoteControl::kValid; }

void LiveRun::send_status() {
  if (!is_driven()) driver_.reset();
  Json status{{"type", "status"}, {"watchers", clients_.size()}, {"manual", manual_}, {"stopped", remote_.is_held()}};
  if (driver_) status["driver"] = *driver_;
  std::string text = text_of(status);
  if (text == sent_status_) return;
  for (const web::Client client : clients_) {
    status["you"] = client;
    server_->send(client, text_of(status));
  }
  sent_status_ = std::move(text);
}

std::vector<web::Message> LiveRun::opened(web::Client client) {
  clients_.push_back(client);
  send_status();  // sent after what this function returns
  const std::lock_guard lock(mutex_);
  return run_line_.empty() ? std::vector<web::Message>() : std::vector<web::Message>{{run_line_}};
}

void LiveRun::closed(web::Client client) {
  std::erase(clients_, client);
  if (driver_ == client) release();
  send_status();
}

void LiveRun::release() {
  driver_.reset();
  remote_.release();
}

void LiveRun::refuse(web::Client client, std::string_view why) {
  server_->send(client, text_of({{"type", "refused"}, {"text", why}}));
}

void LiveRun::drive(web::Client client, double speed, double turn) {
  if (!manual_) return refuse(client, "the robot drives by itself: only behaviour manual takes requests to drive");
  if (is_driven() && driver_ != client) return refuse(client, "another browser drives");
  driver_ = client;
  driven_at_ = Clock::now();
  remote_.drive({speed, turn});
}

void LiveRun::received(web::Client client, std::string_view text) {
  constexpr std::string_view kWrong = "a request must be drive (with speed and turn from -1 to 1), release, stop or go";
  const auto request = nlohmann::json::parse(text, nullptr, false);
  if (!request.is_object() || !request.contains("type")) return refuse(client, kWrong);
  const nlohmann::json& type = request["type"];
  const auto share = [&](const char* key) -> std::optional<double> {
    const auto value = request.find(key);
    if (value == request.end() || !value->is_number()) return std::nullopt;
    const double number = value->get<double>();
    return number >= -1 && number <= 1 ? std::optional(number) : std::nullopt;
  };
  if (type == "drive") {
    const auto speed = share("speed"), turn = share("turn");
    if (!speed || !turn) return refuse(client, kWrong);
    drive(client, *speed, *turn);
  } else if (type == "release") {
    if (driver_ == client) release();
  } else if (type == "stop" || type == "go") {
    remote_.hold(type == "stop");
  } else {
    return refuse(client, kWrong);
  }
  send_status();
}

}  // namespace twocone::viewer
