// SPDX-License-Identifier: Apache-2.0
//
// Sends hostile requests and WebSocket frames to a server, and prints how many of its answers had which status.
//   web_attack ADDRESS [COUNT | SECONDSs] [SEED]
// ADDRESS is what the server prints, with the token. COUNT is 100000 unless given. Equal seeds send equal bytes, but
// for the token. After each thousand the server must answer a right request; if it does not, the exit status is 1.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "tests/web/client.h"

namespace twocone::web {
namespace {

using namespace std::string_view_literals;

constexpr std::array kMethods{"HEAD"sv,    "POST"sv, "PUT"sv, "OPTIONS"sv, "TRACE"sv,
                              "CONNECT"sv, "get"sv,  ""sv,    "G\0T"sv};
constexpr std::array kVersions{" HTTP/1.0\r\n"sv, " HTTP/2.0\r\n"sv, "\r\n"sv, " HTTP/1.1\n"sv};
constexpr std::array kPaths{""sv, "image"sv, "stream"sv, "runs"sv, "telemetry"sv};
constexpr std::array kTargetParts{"run=0"sv,
                                  "frame=-1"sv,
                                  "frame=99999999999999999999"sv,
                                  "view=../../etc/passwd"sv,
                                  "../"sv,
                                  "..%2f"sv,
                                  "%2e%2e/"sv,
                                  "..\\"sv,
                                  "%5c"sv,
                                  "%00"sv,
                                  "%"sv,
                                  "%zz"sv,
                                  "%c0%ae"sv,
                                  "%ff"sv,
                                  "/"sv,
                                  "//"sv,
                                  "?"sv,
                                  "&"sv,
                                  "="sv,
                                  "#"sv,
                                  "token=0"sv,
                                  "etc/passwd"sv,
                                  "\r\n"sv,
                                  "\0"sv,
                                  "<script>"sv,
                                  "'"sv,
                                  "+"sv,
                                  "%25"sv,
                                  "\xe2\x82\xac"sv};
constexpr std::array kHosts{"evil.example"sv, "localhost"sv,          ""sv,      "127.0.0.1"sv, "[::1]"sv,
                            "0.0.0.0:0"sv,    "127.0.0.1:99999999"sv, "a:b:c"sv, "@"sv};
constexpr std::array kHeaders{"Origin: http://evil.example\r\n"sv,
                              "Origin: null\r\n"sv,
                              "Connection: close\r\n"sv,
                              "Connection: Upgrade\r\n"sv,
                              "Upgrade: websocket\r\n"sv,
                              "Sec-WebSocket-Version: 13\r\n"sv,
                              "Sec-WebSocket-Version: 8\r\n"sv,
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"sv,
                              "Sec-WebSocket-Key: x\r\n"sv,
                              "Sec-WebSocket-Extensions: permessage-deflate; server_max_window_bits=99\r\n"sv,
                              "Content-Length: 10\r\n"sv,
                              "Content-Length: 18446744073709551615\r\n"sv,
                              "Content-Length: -1\r\n"sv,
                              "Transfer-Encoding: chunked\r\n"sv,
                              "Transfer-Encoding: gzip, chunked\r\n"sv,
                              "Expect: 100-continue\r\n"sv,
                              "Range: bytes=0-18446744073709551615\r\n"sv,
                              "Host: evil.example\r\n"sv,
                              "X: a\r\n folded\r\n"sv,
                              "X\0: a\r\n"sv,
                              ": a\r\n"sv,
                              "X:\r\n"sv,
                              "no colon\r\n"sv};
constexpr std::array kMessages{R"({"type":"drive","speed":0.5,"turn":-0.5})"sv,
                               R"({"type":"drive","speed":1e999,"turn":"x"})"sv,
                               R"({"type":"stop"})"sv,
                               R"({"type":"release"})"sv,
                               R"({"type":)"sv,
                               "null"sv,
                               ""sv,
                               "[[[[[[[[[[[[[[[["sv};
class Attack {
 public:
  Attack(Address address, std::uint64_t seed) : address_(std::move(address)), random_(seed) {}

  /// Sends one request, or a stream of them, on a connection of its own. @throws std::runtime_error if there is none
  void strike() {
    RawClient client(address_);
    const bool is_stream = one_in(4);
    if (is_stream) {
      client.send(stream_request());
      const auto reply = client.reply();
      ++answers_[reply ? std::to_string(reply->status) : "no stream"];
    }
    const std::string bytes = is_stream ? hostile_frames() : hostile_requests();
    std::string_view left = bytes;
    for (std::size_t piece = one_in(3) ? below(4) : 0; piece > 0; --piece) {
      const std::size_t size = below(left.size() + 1);
      client.send(left.substr(0, size));
      left.remove_prefix(size);
    }
    client.send(left);
    if (one_in(8)) {
      client.reset();
      ++answers_["not waited for"];
      return;
    }
    client.end_sending();
    const auto answer = client.rest();
    if (!answer) {
      ++answers_["not closed"];
    } else if (!is_stream) {
      count(*answer);
    }
  }

  /// Returns whether the server answers a right request.
  bool is_answered() {
    RawClient client(address_);
    client.send(request(address_, "/?token=" + address_.token));
    const auto reply = client.reply();
    return reply && reply->status == 200;
  }

  [[nodiscard]] const std::map<std::string, int>& answers() const { return answers_; }

 private:
  std::size_t below(std::size_t limit) { return std::size_t(random_() % limit); }
  bool one_in(std::size_t times) { return below(times) == 0; }
  char byte() { return char(below(256)); }
  std::string any(const auto& list) { return std::string(list[below(list.size())]); }
  std::string noise(std::size_t most) {
    std::string result(below(most + 1), ' ');
    for (char& c : result) c = byte();
    return result;
  }

  /// Counts the answers of HTTP in what was received.
  void count(std::string_view received) {
    if (received.empty()) ++answers_["closed without an answer"];
    constexpr std::string_view kStart = "HTTP/1.1 ";
    for (std::size_t at = received.find(kStart); at != std::string_view::npos; at = received.find(kStart, at)) {
      at += kStart.size();
      ++answers_[std::string(received.substr(at, 3))];
    }
  }

  std::string hostile_requests() {
    switch (below(6)) {
      case 0:
        return noise(600);
      case 1:
      case 2:
      case 3:
        return hostile_request() + (one_in(3) ? hostile_request() : "");
      case 4:
        return changed(request(address_, "/image?token=" + address_.token + "&run=0&frame=1&view=lower"));
      default:
        return changed(stream_request());
    }
  }

  std::string stream_request() { return request(address_, "/stream?token=" + address_.token, upgrade_headers()); }

  std::string hostile_request() {
    std::string target = one_in(20) ? "" : "/";
    if (one_in(2)) target += any(kPaths);
    for (std::size_t n = one_in(3) ? 1 + below(3) : 0; n > 0; --n) target += any(kTargetParts);
    if (!one_in(4)) target += "?token=" + (one_in(4) ? std::string(32, '0') : address_.token);
    if (one_in(4)) target += "&" + any(kTargetParts) + "=" + any(kTargetParts);
    if (one_in(40)) target += std::string(below(20'000), 'a');
    std::string headers;
    for (std::size_t n = one_in(3) ? 1 + below(3) : 0; n > 0; --n) headers += any(kHeaders);
    if (one_in(40)) headers += "A: " + std::string(below(20'000), 'a') + "\r\n";
    const std::string host = one_in(5) ? any(kHosts) : address_.host;
    return (one_in(4) ? any(kMethods) : "GET") + " " + target + (one_in(8) ? any(kVersions) : " HTTP/1.1\r\n") +
           "Host: " + host + "\r\n" + headers + "\r\n" + (one_in(5) ? noise(200) : "");
  }

  std::string hostile_frames() {
    std::string result;
    for (std::size_t n = 1 + below(6); n > 0; --n) {
      switch (below(5)) {
        case 0:
          result += browser_text(one_in(4) ? std::string(1'000 + below(50), '[') : any(kMessages));
          break;
        case 1:
          result += browser_frame(int(below(256)), noise(300));
          break;
        case 2:
          result += browser_frame(0x80 | int(below(16)), noise(125));
          break;
        case 3:
          result += changed(browser_text(any(kMessages)));
          break;
        default:  // a length of 64 bits, most of them set
          result += char(below(256));
          result += char(0x7F | (one_in(2) ? 0x80 : 0));
          for (int i = 0; i < 8; ++i) result += one_in(3) ? byte() : '\xff';
          result += noise(50);
      }
    }
    return result;
  }

  std::string changed(std::string text) {
    for (std::size_t n = 1 + below(6); n > 0; --n) {
      const std::size_t at = below(text.size() + 1);
      switch (below(6)) {
        case 0:
          if (at < text.size()) text[at] = byte();
          break;
        case 1:
          if (at < text.size()) text[at] = char(text[at] ^ char(1U << below(8)));
          break;
        case 2:
          text.insert(at, noise(8));
          break;
        case 3:
          text.erase(at, below(16));
          break;
        case 4:
          text.insert(at, text.substr(at, below(64)));
          break;
        default:
          text.insert(at, any(kTargetParts));
      }
    }
    return text;
  }

  const Address address_;
  std::mt19937_64 random_;
  std::map<std::string, int> answers_;
};

int run(int argc, char** argv) {
  constexpr int kBetweenChecks = 1'000;
  if (argc < 2 || argc > 4) throw std::invalid_argument("usage: web_attack ADDRESS [COUNT | SECONDSs] [SEED]");
  const std::string length = argc > 2 ? argv[2] : "100000";
  const bool is_time = length.ends_with('s');
  const int number = std::stoi(length);
  const std::uint64_t seed = argc > 3 ? std::stoull(argv[3]) : 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto end = begin + std::chrono::seconds(is_time ? number : 0);

  Attack attack(parse_served(argv[1]), seed);
  int count = 0;
  int checks = 0;
  while (is_time ? std::chrono::steady_clock::now() < end : count < number) {
    attack.strike();
    if (++count % kBetweenChecks != 0) continue;
    if (!attack.is_answered()) throw std::runtime_error(fmt::format("no answer to a right request after {}", count));
    ++checks;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print("{} attacks in {:.1f} s, seed {}; {} right requests between them were answered\n", count, took.count(),
             seed, checks);
  for (const auto& [answer, times] : attack.answers()) fmt::print("{:>8}  {}\n", times, answer);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace twocone::web

int main(int argc, char** argv) {
  try {
    return twocone::web::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "web_attack: %s\n", e.what());
    return EXIT_FAILURE;
  }
}
