// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/foxglove_stream.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include "apps/viewer/serving.h"

namespace twocone::viewer {
namespace {

using nlohmann::json;

std::string base64(std::string bytes) {
  namespace iterators = boost::archive::iterators;
  using Encoded = iterators::base64_from_binary<iterators::transform_width<std::string::const_iterator, 6, 8>>;
  const std::size_t padding = (3 - bytes.size() % 3) % 3;
  bytes.append(padding, '\0');
  std::string text(Encoded(bytes.begin()), Encoded(bytes.end()));
  text.replace(text.size() - padding, padding, padding, '=');
  return text;
}

std::string problem(const std::string& what) {
  constexpr int kError = 2;
  return json{{"op", "status"}, {"level", kError}, {"message", what}}.dump();
}

/// Returns a whole number of 32 bits, or nothing.
std::optional<std::uint32_t> number_of(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto value = found->get<std::uint64_t>();
  return value <= UINT32_MAX ? std::optional(std::uint32_t(value)) : std::nullopt;
}

/// Returns a message with its data: the operation, the subscription, the time, the content.
web::Message data_message(std::uint32_t subscription, std::uint64_t time_ns, const std::string& content) {
  std::string bytes(1, '\1');
  for (unsigned shift = 0; shift < 32; shift += 8) bytes += char(subscription >> shift & 0xFFU);
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += char(time_ns >> shift & 0xFFU);
  return {bytes + content, true};
}

}  // namespace

web::ProgramStream FoxgloveStream::programs() { return {"/foxglove", {"foxglove.websocket.v1", "foxglove.sdk.v1"}}; }

FoxgloveStream::FoxgloveStream(const config::Robot& robot, const config::Map& map)
    : topics_(recording::topics_of_runs()), run_messages_(robot, map, [this](const recording::RunMessage& message) {
        sink_->push_back({message.topic, recording::to_ns(message.t_s), message.bytes});
      }) {}

std::vector<web::Message> FoxgloveStream::opened(web::Client client) {
  subscriptions_[client];
  const json server{{"op", "serverInfo"}, {"name", "twocone"}, {"capabilities", json::array()}};
  json channels = json::array();
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    const recording::RunTopic& topic = topics_[i];
    const bool is_binary = topic.encoding == "protobuf";
    channels.push_back({{"id", i},
                        {"topic", topic.name},
                        {"encoding", topic.encoding},
                        {"schemaName", topic.schema.name},
                        {"schemaEncoding", topic.schema.encoding},
                        {"schema", is_binary ? base64(topic.schema.data) : topic.schema.data}});
  }
  return {{server.dump()}, {json{{"op", "advertise"}, {"channels", channels}}.dump()}};
}

std::string FoxgloveStream::received(web::Client client, std::string_view text) {
  auto& own = subscriptions_.at(client);
  const json request = json::parse(text, nullptr, false);
  if (!request.is_object() || !request.contains("op")) return problem("a request must be an object with op");
  const auto list = [&request](const char* key) {
    const auto found = request.find(key);
    return found != request.end() && found->is_array() ? *found : json::array();
  };
  if (request["op"] == "subscribe") {
    for (const json& wanted : list("subscriptions")) {
      const auto id = wanted.is_object() ? number_of(wanted, "id") : std::nullopt;
      const auto channel = wanted.is_object() ? number_of(wanted, "channelId") : std::nullopt;
      if (!id || !channel || *channel >= topics_.size()) return problem("there is no such channel");
      // A second subscription of a channel takes the place of the first.
      own[*channel] = Subscription{*id};
    }
  } else if (request["op"] == "unsubscribe") {
    for (const json& gone : list("subscriptionIds")) {
      std::erase_if(own, [&gone](const auto& entry) { return gone == entry.second.id; });
    }
  } else {
    return problem("this server knows subscribe and unsubscribe");
  }
  return "";
}

void FoxgloveStream::begin(const std::string& run_line) {
  sink_ = &whole_run_;
  run_messages_.begin(run_line);
}

void FoxgloveStream::event(double t_s, const std::string& text) {
  sink_ = &whole_run_;
  run_messages_.event(t_s, text);
}

void FoxgloveStream::make(const Frame& frame) {
  const auto is_wanted = [this](const std::string& topic) {
    return std::ranges::any_of(subscriptions_, [&](const auto& client) {
      return std::ranges::any_of(client.second, [&](const auto& entry) { return topics_[entry.first].name == topic; });
    });
  };
  newest_.clear();
  newest_number_ = frame.record.frame.frame;
  sink_ = &newest_;
  for (const auto& [side, image] :
       {std::pair{vision::Side::kLower, &frame.lower}, {vision::Side::kUpper, &frame.upper}}) {
    if (!is_wanted(fmt::format("/{}/image", to_string(side)))) continue;
    std::optional<std::string> jpeg = jpeg_of(*image);
    const double t_s = side == vision::Side::kLower ? frame.record.frame.lower_t_s : frame.record.frame.upper_t_s;
    if (jpeg) run_messages_.image(side, t_s, "jpeg", *std::move(jpeg));
  }
  run_messages_.frame(frame.record, true, frame.line());
}

std::vector<web::Message> FoxgloveStream::messages(web::Client client, const Frame& frame) {
  std::vector<web::Message> result;
  const auto found = subscriptions_.find(client);
  if (found == subscriptions_.end() || found->second.empty()) return result;
  if (newest_number_ != frame.record.frame.frame) make(frame);
  for (auto& [channel, subscription] : found->second) {
    const auto add = [&, &topic = topics_[channel].name, id = subscription.id](std::span<const Sent> from) {
      for (const Sent& sent : from) {
        if (sent.topic == topic) result.push_back(data_message(id, sent.time_ns, sent.bytes));
      }
    };
    add(std::span(whole_run_).subspan(subscription.sent));
    subscription.sent = whole_run_.size();
    add(newest_);
  }
  return result;
}

}  // namespace twocone::viewer
