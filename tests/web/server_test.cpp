// SPDX-License-Identifier: Apache-2.0
#include "tests/web/server_fixture.h"

namespace twocone::web {
namespace {

// Pages.

TEST_F(WebServer, ShowsThePageWithTheTokenOnly) {
  open();
  const auto page = answer_to(request(address_, with_token("/")));
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, settings_.page);
  for (const char* header :
       {"Content-Type: text/html; charset=utf-8\r\n", "X-Content-Type-Options: nosniff\r\n",
        "Referrer-Policy: no-referrer\r\n", "Cache-Control: no-store\r\n", "X-Frame-Options: DENY\r\n",
        "Cross-Origin-Resource-Policy: same-origin\r\n", "Content-Security-Policy: default-src 'none'; "}) {
    EXPECT_THAT(page->head, HasSubstr(header));
  }
  EXPECT_THAT(page->head, HasSubstr("connect-src 'self' ws://" + address_.host));
  const std::string wrong(32, '0');
  for (const std::string& target :
       {"/"s, "/?token="s, "/?token=" + wrong, "/?token=" + address_.token + "0", "/image?token=" + wrong,
        "/stream?token=" + wrong, "/nothing"s, "/?Token=" + address_.token}) {
    const auto reply = answer_to(request(address_, target));
    ASSERT_TRUE(reply) << target;
    EXPECT_EQ(reply->status, 403) << target;
    EXPECT_THAT(reply->head, HasSubstr("Content-Type: text/plain"));
    EXPECT_THAT(reply->body, HasSubstr("Use the address that the program printed"));
    EXPECT_THAT(reply->body, Not(HasSubstr(address_.token)));
  }
}

TEST_F(WebServer, AnswersWhatTheSiteHas) {
  open();
  const auto image = answer_to(request(address_, with_token("/image", "&run=0&frame=12")));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->status, 200);
  EXPECT_THAT(image->head, HasSubstr("Content-Type: image/png\r\n"));
  EXPECT_EQ(image->body, "frame=12;run=0;") << "and no token";
  EXPECT_EQ(status_of(request(address_, with_token("/images"))), 404);
  EXPECT_EQ(status_of(request(address_, with_token("/stream"))), 426);
}

TEST_F(WebServer, KeepsAConnectionForMoreRequests) {
  open();
  RawClient client(address_);
  for (int i = 0; i < 3; ++i) {
    client.send(request(address_, with_token(i == 1 ? "/nothing" : "/")));
    ASSERT_EQ(client.reply().value_or(Reply{}).status, i == 1 ? 404 : 200);
  }
  const std::string both =
      request(address_, with_token("/image", "&a=1")) + request(address_, with_token("/image", "&a=2"));
  client.send(both.substr(0, 100));
  client.send(both.substr(100));
  EXPECT_EQ(client.reply().value_or(Reply{}).body, "a=1;");
  EXPECT_EQ(client.reply().value_or(Reply{}).body, "a=2;");
  EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.0\r\nHost: " + address_.host + "\r\n\r\n"), 200);
  client.send(request(address_, with_token("/"), "Connection: close\r\n"));
  EXPECT_TRUE(client.reply());
  EXPECT_TRUE(client.is_ended());
}

TEST_F(WebServer, AnswersHeadWithoutABody) {
  open();
  RawClient client(address_);
  for (int i = 0; i < 2; ++i) {
    client.send(request(address_, with_token("/"), "", "HEAD"));
    const auto reply = client.reply(false);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->status, 200);
    EXPECT_THAT(reply->head, HasSubstr("Content-Length: " + std::to_string(settings_.page.size())));
  }
}

TEST_F(WebServer, RefusesOtherMethodsAndEndsTheConnection) {
  open();
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "NONSENSE"}) {
    RawClient client(address_);
    client.send(request(address_, with_token("/"), "Content-Length: 5\r\n", method) + "a=1&b");
    const auto reply = client.reply();
    ASSERT_TRUE(reply) << method;
    EXPECT_EQ(reply->status, 405) << method;
    EXPECT_THAT(reply->head, HasSubstr("Allow: GET, HEAD\r\n"));
    client.end_sending();
    EXPECT_TRUE(client.is_ended());
  }
}

TEST_F(WebServer, RefusesARequestOfAnotherHost) {
  open();
  const std::string port = ":" + std::to_string(address_.port);
  for (const std::string& host : {"evil.example" + port, "127.0.0.1"s, "127.0.0.1:1"s, "10.0.0.1" + port, ""s}) {
    EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n"), 403) << host;
    EXPECT_EQ(
        status_of("GET " + with_token("/stream") + " HTTP/1.1\r\nHost: " + host + "\r\n" + upgrade_headers() + "\r\n"),
        403);
  }
  EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.1\r\nHost: localhost" + port + "\r\n\r\n"), 200);
  EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.1\r\n\r\n"), 400) << "none";
  EXPECT_EQ(status_of(request(address_, with_token("/"), "Host: evil.example\r\n")), 400) << "two";
}

TEST_F(WebServer, RefusesTheOriginOfAnotherSite) {
  open();
  for (const std::string& origin :
       {"http://evil.example"s, "null"s, ""s, "https://" + address_.host, "http://" + address_.host + "0",
        "http://localhost:" + std::to_string(address_.port)}) {
    EXPECT_EQ(status_of(request(address_, with_token("/"), "Origin: " + origin + "\r\n")), 403) << origin;
    EXPECT_EQ(status_of(request(address_, with_token("/stream"), upgrade_headers() + "Origin: " + origin + "\r\n")),
              403)
        << origin;
  }
  const std::string own = "Origin: http://" + address_.host + "\r\n";
  EXPECT_EQ(status_of(request(address_, with_token("/"), own)), 200);
  EXPECT_EQ(status_of(request(address_, with_token("/stream"), upgrade_headers() + own)), 101);
  EXPECT_EQ(status_of(request(address_, with_token("/stream"), upgrade_headers() + own + own)), 400) << "two";
  EXPECT_EQ(status_of(request(address_, "/stream", upgrade_headers() + own)), 403) << "without the token";
  EXPECT_EQ(status_of(request(address_, "/stream", upgrade_headers())), 403) << "without both";
}

TEST_F(WebServer, RefusesWhatIsNoProperRequest) {
  open();
  for (const char* target : {"/../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..%5cx", "/a%00", "/%c0%af", "/%zz"}) {
    EXPECT_EQ(status_of(request(address_, with_token(target))), 400) << target;
  }
  EXPECT_EQ(status_of(request(address_, with_token("/", "&token=" + address_.token))), 400) << "two tokens";
  EXPECT_EQ(status_of(request(address_, "http://" + address_.host + with_token("/"))), 400);
  for (const std::string& bytes :
       {"\x16\x03\x01\x02\x00\x01\xfc\x03\x03"s, "GET\r\n\r\n"s, "GET / HTTP/9.9\r\n\r\n"s, "\r\n\r\n\r\n"s,
        "GET / HTTP/1.1\r\nNo colon\r\n\r\n"s, "GET / HTTP/1.1\r\nHost : x\r\n\r\n"s,
        "GET / HTTP/1.1\r\nA: \x01\r\n\r\n"s, "GET / HTTP/1.1\nHost: x\n\n"s,
        "GET / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n"s,
        "GET / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"s}) {
    RawClient client(address_);
    client.send(bytes);
    EXPECT_EQ(client.reply().value_or(Reply{}).status, 400) << bytes;
    client.end_sending();
    EXPECT_TRUE(client.is_ended());
  }
}

TEST_F(WebServer, RefusesWhatIsTooLarge) {
  open();
  const std::string huge(3 * Server::kMostRequest, 'x');
  EXPECT_EQ(status_of(request(address_, with_token("/", "&a=" + huge))), 431);
  EXPECT_EQ(status_of(request(address_, with_token("/"), "A: " + huge + "\r\n")), 431);
  EXPECT_EQ(status_of(huge), 431);
  EXPECT_EQ(status_of(request(address_, with_token("/"), "Content-Length: 3\r\n") + "abc"), 413);
  EXPECT_EQ(status_of(request(address_, with_token("/"), "Content-Length: 99999999999\r\n")), 413);
  EXPECT_EQ(status_of(request(address_, with_token("/"), "Transfer-Encoding: chunked\r\n") + "3\r\nabc\r\n0\r\n\r\n"),
            413);
  EXPECT_EQ(
      status_of(request(address_, with_token("/"), "A: " + huge.substr(0, Server::kMostRequest - 1'000) + "\r\n")),
      200);
}

// Catches a timeout that begins anew with every byte.
TEST_F(WebServer, EndsARequestThatTakesTooLong) {
  settings_.timeouts.request = kShort;
  open();
  RawClient client(address_);
  const auto begin = Clock::now();
  const std::string bytes = request(address_, with_token("/"), "A: " + std::string(8'000, 'x'));
  std::size_t sent = 0;
  while (!client.is_ended(milliseconds(10)) && sent < bytes.size()) client.send(bytes.substr(sent++, 1));
  EXPECT_GE(Clock::now() - begin, kShort);
  EXPECT_LT(Clock::now() - begin, kSoon);
}

TEST_F(WebServer, EndsConnectionsThatAreIdle) {
  settings_.timeouts.idle = kShort;
  open();
  RawClient client(address_);
  const auto begin = Clock::now();
  client.send(request(address_, with_token("/")));
  ASSERT_TRUE(client.reply());
  EXPECT_TRUE(client.is_ended());
  EXPECT_GE(Clock::now() - begin, kShort);
  EXPECT_LT(Clock::now() - begin, kSoon);
}

TEST_F(WebServer, EndsAnAnswerThatIsNotRead) {
  settings_.timeouts.answer = kShort;
  settings_.page = std::string(kMuch, 'x');
  open();
  RawClient client(address_, kSmallBuffer);
  client.send(request(address_, with_token("/")));
  ASSERT_EQ(status_of(request(address_, with_token("/nothing"))), 404) << "so the answer above has begun";
  std::this_thread::sleep_for(2 * kShort);
  ASSERT_EQ(status_of(request(address_, with_token("/nothing"))), 404) << "and the server has looked at its clock";
  const auto reply = client.reply();
  EXPECT_FALSE(reply) << reply->body.size() << " bytes";
  EXPECT_TRUE(client.is_ended());
}
// What may fail around it.

TEST_F(WebServer, SurvivesExceptionsOfTheSite) {
  site_.act = [](const std::string& event, Client) {
    if (event == "throw" || event == "/throw") throw std::runtime_error("of the site");
    if (event == "throw a number") throw 1;
  };
  open();
  RawClient bystander = watcher();
  EXPECT_EQ(status_of(request(address_, with_token("/throw"))), 500);
  for (const char* text : {"throw", "throw a number"}) {
    RawClient client = watcher();
    client.send(browser_text(text));
    EXPECT_TRUE(client.is_ended());
  }
  EXPECT_TRUE(site_.saw("closed", 2));
  server_->offer([]() -> std::vector<Message> { throw std::runtime_error("of an offer"); });
  server_->send("text");
  EXPECT_EQ(text_of(bystander.frame()), "text");
  offer("frame");
  EXPECT_EQ(text_of(bystander.frame()), "frame");
}

TEST_F(WebServer, ReportsTheEndOfABrowserWhoseStartFailed) {
  site_.act = [](const std::string& event, Client) {
    if (event == "opened") throw std::runtime_error(event);
  };
  open();
  RawClient client(address_);
  client.send(request(address_, with_token("/stream"), upgrade_headers()));
  EXPECT_TRUE(client.is_ended());
  EXPECT_TRUE(site_.saw("closed"));
  EXPECT_EQ(server_->watchers(), 0U);
  EXPECT_EQ(status_of(request(address_, with_token("/image"))), 200);
}

TEST_F(WebServer, RefusesConnectionsBeyondTheLimit) {
  open();
  std::vector<RawClient> clients;
  for (std::size_t i = 0; i < Server::kMostConnections; ++i) {
    clients.emplace_back(address_);
    clients.back().send(request(address_, with_token("/")));
    ASSERT_EQ(clients.back().reply().value_or(Reply{}).status, 200) << i;
  }
  for (int i = 0; i < 3; ++i) {
    RawClient further(address_);
    further.send(request(address_, with_token("/")));
    EXPECT_TRUE(further.is_ended());
  }
  clients.front().send(request(address_, with_token("/")));
  EXPECT_TRUE(clients.front().reply()) << "an old connection suffers";
  clients.front().reset();
  bool is_answered = false;
  for (int i = 0; i < 1'000 && !is_answered; ++i) is_answered = status_of(request(address_, with_token("/"))) == 200;
  EXPECT_TRUE(is_answered);
}

TEST_F(WebServer, IsNotBlockedByConnectionsWithoutToken) {
  open();
  RawClient watching = watcher();
  std::vector<RawClient> strangers;
  for (int i = 0; i < 300; ++i) {
    strangers.emplace_back(address_);
    if (i % 3 == 1) strangers.back().send("GET / HTTP/1.1\r\n");
    if (i % 50 == 0) {
      ASSERT_EQ(status_of(request(address_, with_token("/"))), 200) << i;
    }
  }
  ASSERT_EQ(status_of(request(address_, with_token("/"))), 200) << "so all before it were accepted";
  const auto open_ones = std::count_if(strangers.begin(), strangers.end(),
                                       [](RawClient& client) { return !client.is_ended(milliseconds(0)); });
  EXPECT_EQ(std::size_t(open_ones), Server::kMostConnections / 2 - 1) << "it took one's place";
  EXPECT_FALSE(strangers.back().is_ended(milliseconds(0))) << "the newest stays";
  server_->send("text");
  EXPECT_EQ(text_of(watching.frame()), "text");
}

TEST_F(WebServer, GoesOnAfterAllDescriptorsWereInUse) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP()
      << "The sanitizers look at an object's memory through a pipe, for which no descriptor is left here, so that they "
         "report valid objects. The builds without sanitizers hold this test.";
#endif
  open();
  RawClient client = RawClient::unconnected(address_);
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const rlimit few{std::min<rlim_t>(before.rlim_cur, 256), before.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &few);
  std::vector<base::UniqueFd> all;
  for (int fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC); fd >= 0; fd = ::open("/dev/null", O_RDONLY | O_CLOEXEC)) {
    all.emplace_back(fd);
  }
  const auto used_time = [] {
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    return std::chrono::microseconds(1'000'000 * (used.ru_utime.tv_sec + used.ru_stime.tv_sec) + used.ru_utime.tv_usec +
                                     used.ru_stime.tv_usec);
  };
  client.connect(address_);
  client.send(request(address_, with_token("/")));
  const auto begin = used_time();
  EXPECT_FALSE(client.reply(true, milliseconds(300)));
  EXPECT_LT(used_time() - begin, milliseconds(100)) << "it tries again and again";
  all.clear();
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(client.reply().value_or(Reply{}).status, 200);
}

TEST_F(WebServer, EndsPromptlyWithClientsThatAreStuck) {
  settings_.page = std::string(kMuch, 'x');
  open();
  RawClient watching = stuck_watcher();
  RawClient loading(address_, kSmallBuffer);
  loading.send(request(address_, with_token("/")));
  RawClient silent(address_);
  RawClient slow(address_);
  slow.send("GET / HT");
  RawClient refused(address_);
  refused.send("POST / HTTP/1.1\r\n\r\n");
  EXPECT_TRUE(refused.reply());
  const auto begin = Clock::now();
  server_.reset();
  EXPECT_LT(Clock::now() - begin, milliseconds(1'000));
  EXPECT_EQ(site_.count("closed"), 1U);
  for (RawClient* client : {&watching, &loading, &silent, &slow, &refused}) EXPECT_TRUE(client->is_ended());
}

// Catches an end that waits for, or calls, what is still to be delivered.
TEST_F(WebServer, EndsBeforeAllIsDelivered) {
  for (std::size_t round = 1; round <= 20; ++round) {
    open();
    RawClient client = watcher();
    std::thread sender([this] {
      for (int i = 0; i < 50; ++i) {
        offer(std::to_string(i));
        server_->send(std::to_string(i));
      }
    });
    sender.join();
    server_.reset();
    EXPECT_EQ(site_.count("opened"), round);
    EXPECT_EQ(site_.count("closed"), round);
  }
}

// Addresses.

TEST_F(WebServer, HasATokenOfItsOwn) {
  open();
  RecordingSite other_site;
  const auto other = value(Server::open(settings_, other_site));
  const Address other_address = parse_served(other->address());
  EXPECT_EQ(address_.token.size(), 32U);
  EXPECT_EQ(address_.token.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(address_.token, other_address.token);
  EXPECT_NE(address_.port, other_address.port);
  EXPECT_EQ(status_of(request(address_, "/?token=" + other_address.token)), 403);
}

TEST_F(WebServer, NamesAPortThatIsInUse) {
  open();
  ServerSettings same = settings_;
  same.port = address_.port;
  EXPECT_THAT(Server::open(same, site_),
              FailsWith(ErrorCode::kUnavailable, address_.host + ": Address already in use"));
  server_.reset();
  EXPECT_TRUE(Server::open(same, site_)) << "at once after another server";
}

TEST_F(WebServer, RefusesAnAddressThatIsNotNumeric) {
  for (const char* text : {"localhost", "", "127.0.0.1/8", "fe80::1%lo"}) {
    settings_.address = text;
    EXPECT_THAT(Server::open(settings_, site_), FailsWith(ErrorCode::kRefused, HasSubstr("such as 127.0.0.1"))) << text;
  }
  settings_.address = "192.0.2.1";  // of nobody: RFC 5737
  EXPECT_THAT(Server::open(settings_, site_), FailsWith(ErrorCode::kUnavailable, StartsWith("192.0.2.1:0: ")));
}

TEST_F(WebServer, ListensOnAllInterfaces) {
  settings_.address = "0.0.0.0";
  open();
  EXPECT_THAT(server_->address(), StartsWith("http://127.0.0.1:"));
  EXPECT_EQ(status_of(request(address_, with_token("/"))), 200);
  const std::string port = ":" + std::to_string(address_.port);
  EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.1\r\nHost: 192.0.2.1" + port + "\r\n\r\n"), 200);
  EXPECT_EQ(status_of("GET " + with_token("/") + " HTTP/1.1\r\nHost: robot.local" + port + "\r\n\r\n"), 403);
}

TEST_F(WebServer, ListensOnIpv6) {
  settings_.address = "::1";
  auto server = Server::open(settings_, site_);
  if (!server) GTEST_SKIP() << "this machine has no IPv6: " << server.error().message;
  server_ = *std::move(server);
  address_ = parse_served(server_->address());
  EXPECT_THAT(server_->address(), StartsWith("http://[::1]:"));
  EXPECT_EQ(status_of(request(address_, with_token("/"), "Origin: http://" + address_.host + "\r\n")), 200);
}

// Catches a thread that takes the signal that is to stop the robot, or the processor from the robot's loop.
TEST_F(WebServer, LeavesSignalsAndPrecedenceToOthers) {
  std::atomic<bool> is_blocked{false};
  std::atomic<int> niceness{0};
  site_.act = [&](const std::string&, Client) {
    sigset_t mask;
    ::pthread_sigmask(SIG_SETMASK, nullptr, &mask);
    is_blocked = ::sigismember(&mask, SIGINT) == 1 && ::sigismember(&mask, SIGTERM) == 1;
    niceness = ::getpriority(PRIO_PROCESS, 0);
  };
  const int own = ::getpriority(PRIO_PROCESS, 0);
  open();
  ASSERT_EQ(status_of(request(address_, with_token("/image"))), 200);
  EXPECT_TRUE(is_blocked);
  EXPECT_EQ(niceness, std::min(own + 5, 19));
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), own);
  sigset_t mask;
  ::pthread_sigmask(SIG_SETMASK, nullptr, &mask);
  EXPECT_EQ(::sigismember(&mask, SIGINT), 0);
}

}  // namespace
}  // namespace twocone::web
