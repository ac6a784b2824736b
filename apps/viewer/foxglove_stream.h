// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/recording/run_messages.h"
#include "apps/runlog/run_folder.h"
#include "apps/web/server.h"
#include "hal/image.h"

namespace twocone::viewer {

/// A run's topics for programs that speak the Foxglove WebSocket protocol, foxglove.websocket.v1: the topics, schemas
/// and times of an exported run (docs/recordings.md). A program receives what it has subscribed to, of the newest frame
/// only when it is too slow for all. All calls come from the server's thread.
class FoxgloveStream {
 public:
  /// The path of the stream, and the names of the protocol.
  static web::ProgramStream programs();

  FoxgloveStream(const config::Robot& robot, const config::Map& map);

  /// Returns the messages that a program receives first: who serves, and the topics.
  std::vector<web::Message> opened(web::Client client);
  /// Answers a request: an empty text, or one that says what is wrong with it.
  std::string received(web::Client client, std::string_view text);
  void closed(web::Client client) { subscriptions_.erase(client); }
  [[nodiscard]] bool has(web::Client client) const { return subscriptions_.contains(client); }

  /// Takes what the whole run has, which is sent once to each subscription. @param run_line of docs/telemetry.md
  void begin(const std::string& run_line);
  [[nodiscard]] bool has_begun() const { return !whole_run_.empty(); }
  /// Takes an event of the run, which each subscription receives before its next frame.
  void event(double t_s, const std::string& text);

  /// A frame that is to be sent.
  struct Frame {
    const runlog::FrameRecord& record;
    const Image &lower, &upper;
    std::function<std::string()> line;  ///< of docs/telemetry.md; made if a program has subscribed to anything
  };
  /// Returns what a program has subscribed to of a frame.
  std::vector<web::Message> messages(web::Client client, const Frame& frame);

 private:
  struct Subscription {
    std::uint32_t id;
    std::size_t sent = 0;  ///< number of messages of whole_run_ that it has received
  };
  struct Sent {
    std::string topic;
    std::uint64_t time_ns;
    std::string bytes;
  };
  void make(const Frame& frame);

  std::vector<recording::RunTopic> topics_;                                   ///< their channels are their places here
  std::map<web::Client, std::map<std::size_t, Subscription>> subscriptions_;  ///< by channel
  std::vector<Sent>* sink_ = nullptr;
  recording::RunMessages run_messages_;
  std::vector<Sent> whole_run_, newest_;  ///< what every subscription receives, and the frame with the number below
  std::uint64_t newest_number_ = ~std::uint64_t{0};
};

}  // namespace twocone::viewer
