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
      lines_(robot, maps ? estimation::without_landmarks(map) : map),
      foxglove_(robot, maps ? estimation::without_landmarks(map) : map) {}

LiveRun::~LiveRun() = default;

Result<std::string> LiveRun::open(const PageAddress& at) {
  return serve("live", "twocone: a robot that drives", "This page shows a robot while it drives.", at, *this, server_,
               FoxgloveStream::programs());
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
  struct Shown {
    runlog::FrameRecord record;
    std::shared_ptr<const Image> lower, upper;
    runs::LiveFigures figures;
  };
  const auto shown = std::make_shared<const Shown>(Shown{frame.record, frame.lower, frame.upper, figures});
  {
    const std::lock_guard lock(mutex_);
    t_s_ = frame.record.frame.t_s;
  }
  const auto make = [this, shown] {
    send_status();  // a driver may have fallen silent
    std::vector<web::Message> messages;
    for (const auto& [side, image] :
         {std::pair{vision::Side::kLower, shown->lower}, {vision::Side::kUpper, shown->upper}}) {
      auto message = image_message(shown->record.frame.frame, int(side), *image);
      if (message) messages.push_back(*std::move(message));
    }
    Json line = lines_.frame(shown->record);
    line["age_s"] = shown->figures.age_s;
    if (shown->figures.late_frames) line["late_frames"] = *shown->figures.late_frames;
    messages.push_back({text_of(line)});
    return messages;
  };
  const auto make_for = [this, shown](web::Client client) {
    {
      const std::lock_guard lock(mutex_);
      if (!foxglove_.has_begun()) foxglove_.begin(run_line_);
      for (const auto& [t_s, text] : std::exchange(events_, {})) foxglove_.event(t_s, text);
    }
    const auto line = [&] { return text_of(lines_.frame(shown->record)); };
    return foxglove_.messages(client, {shown->record, *shown->lower, *shown->upper, line});
  };
  server_->offer(make, make_for);
}

void LiveRun::event(const std::string& text) {
  {
    const std::lock_guard lock(mutex_);
    events_.emplace_back(t_s_, text);
  }
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

std::vector<web::Message> LiveRun::program_opened(web::Client client) { return foxglove_.opened(client); }

void LiveRun::closed(web::Client client) {
  if (foxglove_.has(client)) return foxglove_.closed(client);
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
  if (foxglove_.has(client)) {
    if (std::string answer = foxglove_.received(client, text); !answer.empty())
      server_->send(client, std::move(answer));
    return;
  }
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
