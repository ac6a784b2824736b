// SPDX-License-Identifier: Apache-2.0
#include "tests/web/server_fixture.h"

namespace twocone::web {
namespace {

TEST_F(WebServer, GreetsABrowserThenSendsWhatIsOffered) {
  site_.first = {{"run", false}, {std::string("\0\x01\xff", 3), true}};
  open();
  offer("frame 1");
  RawClient client = watcher();
  EXPECT_EQ(text_of(client.frame()), "run");
  const auto binary = client.frame();
  ASSERT_TRUE(binary);
  EXPECT_EQ(binary->opcode, kBinary);
  EXPECT_EQ(binary->payload, site_.first[1].bytes);
  EXPECT_EQ(text_of(client.frame()), "frame 1");
  offer("frame 2");
  EXPECT_EQ(text_of(client.frame()), "frame 2");
  EXPECT_EQ(server_->watchers(), 1U);
}

TEST_F(WebServer, AcceptsAWebSocketByItsKey) {
  open();
  RawClient client(address_);
  client.send(request(address_, with_token("/stream"), upgrade_headers()));
  EXPECT_THAT(client.reply().value_or(Reply{}).head,
              HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"));
  EXPECT_EQ(status_of(request(address_, with_token("/stream"), "Connection: Upgrade\r\nUpgrade: websocket\r\n")), 400);
  EXPECT_EQ(status_of(request(address_, with_token("/stream"), upgrade_headers()) + browser_text("x")), 426)
      << "a message before the answer";
  EXPECT_EQ(status_of(request(address_, with_token("/"), upgrade_headers())), 200) << "the stream is elsewhere";
}

TEST_F(WebServer, MakesAnOfferOnceAndOnlyForABrowser) {
  open();
  std::atomic<int> first{0};
  std::atomic<int> second{0};
  const auto counted = [](std::atomic<int>& count) {
    return [&count] { return ++count, std::vector<Message>{{"frame", false}}; };
  };
  server_->offer(counted(first));
  ASSERT_EQ(status_of(request(address_, with_token("/"))), 200);
  server_->offer(counted(second));
  ASSERT_EQ(status_of(request(address_, with_token("/"))), 200);
  EXPECT_EQ(second, 0) << "nobody watches";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(text_of(watcher().frame()), "frame");
  EXPECT_EQ(first, 0);
  EXPECT_EQ(second, 1);
}

TEST_F(WebServer, SendsTheNewestToABrowserThatIsSlow) {
  open();
  RawClient slow = stuck_watcher();
  RawClient fast = watcher();
  EXPECT_EQ(fast.frame().value_or(Frame{}).payload.size(), kMuch);
  std::atomic<int> made{0};
  for (int i = 1; i <= 20; ++i) {
    server_->offer([&made, i] { return ++made, std::vector<Message>{{"frame " + std::to_string(i), false}}; });
    EXPECT_EQ(text_of(fast.frame()), "frame " + std::to_string(i));
  }
  EXPECT_EQ(made, 20);
  EXPECT_EQ(slow.frame().value_or(Frame{}).payload.size(), kMuch);
  EXPECT_EQ(text_of(slow.frame()), "frame 20");
  EXPECT_EQ(made, 20) << "the browsers share what was made";
}

TEST_F(WebServer, SendsTextsInOrderBeforeOffers) {
  site_.act = [this](const std::string& event, Client client) {
    if (event != "closed") server_->send(client, "you " + event);
  };
  site_.first = {{"run", false}};
  open();
  RawClient client = stuck_watcher();
  EXPECT_EQ(text_of(client.frame()), "run");
  EXPECT_EQ(text_of(client.frame()), "you opened");
  offer("frame 2");
  constexpr int kTexts = 200;
  for (int i = 0; i < kTexts; ++i) server_->send(std::to_string(i));
  client.send(browser_text("hello"));
  EXPECT_TRUE(site_.saw("received hello"));
  offer("frame 3");
  EXPECT_EQ(client.frame().value_or(Frame{}).payload.size(), kMuch);
  for (int i = 0; i < kTexts; ++i) EXPECT_EQ(text_of(client.frame()), std::to_string(i));
  EXPECT_EQ(text_of(client.frame()), "you hello");
  EXPECT_EQ(text_of(client.frame()), "frame 3");
}

TEST_F(WebServer, EndsABrowserThatTakesNoTexts) {
  open();
  RawClient other = watcher();
  RawClient client = stuck_watcher();
  EXPECT_EQ(other.frame().value_or(Frame{}).payload.size(), kMuch);
  for (std::size_t i = 0; i <= Server::kMostWaiting; ++i) {
    EXPECT_EQ(server_->watchers(), 2U) << i;
    server_->send("text");
    EXPECT_EQ(text_of(other.frame()), "text");
  }
  EXPECT_TRUE(site_.saw("closed"));
  EXPECT_TRUE(client.is_ended());
  EXPECT_EQ(server_->watchers(), 1U);
}

TEST_F(WebServer, ForgetsABrowserThatAnswersNoPing) {
  settings_.timeouts.dead_after = 4 * kShort;
  open();
  const auto begin = Clock::now();
  RawClient dead = watcher();
  RawClient alive = watcher();
  int pings = 0;
  while (site_.count("closed") == 0 || pings < 3) {
    ASSERT_LT(Clock::now() - begin, kSoon);
    const auto frame = alive.frame(milliseconds(10));
    if (!frame) continue;
    ASSERT_EQ(frame->opcode, kPing);
    alive.send(browser_frame(0x80 | kPong, frame->payload));
    ++pings;
  }
  EXPECT_TRUE(dead.is_ended());
  EXPECT_EQ(site_.events().back().second, site_.events().front().second) << "the first to open";
  EXPECT_EQ(server_->watchers(), 1U);
}

// Catches a server that looks at what a browser sends, and not at what it takes.
TEST_F(WebServer, ForgetsABrowserThatSendsButTakesNothing) {
  settings_.timeouts.dead_after = kShort;
  open();
  const auto begin = Clock::now();
  RawClient client = stuck_watcher();
  while (site_.count("closed") == 0 && Clock::now() - begin < kPatience) {
    client.send(browser_text("alive"));
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_GE(Clock::now() - begin, kShort);
  EXPECT_LT(Clock::now() - begin, kSoon);
  server_.reset();
  EXPECT_EQ(site_.count("closed"), 1U) << "both its operations have failed";
}

TEST_F(WebServer, EndsABrowserThatSendsTooMuch) {
  open();
  constexpr std::size_t kMany = 3 * std::size_t(Server::kMostMessages_perS);
  RawClient pinging = watcher();
  for (std::size_t i = 0; i < kMany; ++i) pinging.send(browser_frame(0x80 | kPing, ""));
  EXPECT_TRUE(pinging.is_ended());
  RawClient sending = watcher();
  for (std::size_t i = 0; i < kMany; ++i) sending.send(browser_text("x"));
  EXPECT_TRUE(sending.is_ended());
  EXPECT_TRUE(site_.saw("closed", 2));
  EXPECT_GE(site_.count("received x"), std::size_t(Server::kMostMessages_perS));
  EXPECT_LT(site_.count("received x"), kMany);
}

TEST_F(WebServer, EndsABrowserThatSendsWhatItMayNot) {
  open();
  const std::string most(Server::kMostReceived, 'x');
  RawClient client = watcher();
  client.send(browser_text(most));
  EXPECT_TRUE(site_.saw("received " + most));
  client.send(browser_text(most + "x"));
  const auto last = client.frame();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->opcode, kClose);
  EXPECT_EQ(last->payload.substr(0, 2), "\x03\xf1") << "1009: the message is too big";
  client.send(browser_frame(0x80 | kClose, last->payload));
  EXPECT_TRUE(client.is_ended());
  const std::string unmasked = "\x81\x02hi";
  const std::vector<std::string> forged{
      browser_frame(kText, most) + browser_frame(0x80, "x"),  // too big in two fragments
      browser_frame(0x80 | kBinary, "x"),
      unmasked,
      browser_frame(0x80 | 3, "x"),  // reserved opcodes and bits
      browser_frame(0x80 | 11, "x"),
      browser_frame(0xC0 | kText, "x"),
      browser_frame(0x80, "x"),  // a continuation of nothing
      browser_frame(kText, "x") + browser_text("x"),
      browser_frame(kPing, "x"),  // a fragment of a ping
      browser_frame(0x80 | kPing, std::string(126, 'x')),
      browser_text("\xc0\xae"),           // not UTF-8
      browser_frame(0x80 | kClose, "x"),  // half a code
      "\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff" + most,
      "\x81\xfe\x00\x01"s + most};  // a length that is not in its shortest form
  for (std::size_t i = 0; i < forged.size(); ++i) {
    RawClient forger = watcher();
    forger.send(forged[i]);
    forger.end_sending();
    EXPECT_TRUE(forger.is_ended()) << i;
    EXPECT_TRUE(site_.saw("closed", i + 2)) << i;
  }
  EXPECT_EQ(site_.events().size(), 2 * (forged.size() + 1) + 1) << "opened and closed each, and one message received";
}

TEST_F(WebServer, SaysOnceThatABrowserHasGone) {
  open();
  {
    RawClient leaving = watcher();
    leaving.send(browser_frame(0x80 | kClose, "\x03\xe9"));
    EXPECT_EQ(leaving.frame().value_or(Frame{}).opcode, kClose);
  }
  EXPECT_TRUE(site_.saw("closed", 1));
  { RawClient vanishing = watcher(); }
  EXPECT_TRUE(site_.saw("closed", 2));
  RawClient killed = watcher();
  killed.reset();
  EXPECT_TRUE(site_.saw("closed", 3));
  RawClient staying = watcher();
  server_.reset();
  EXPECT_TRUE(staying.is_ended());
  EXPECT_EQ(site_.count("opened"), 4U);
  EXPECT_EQ(site_.count("closed"), 4U);
  auto clients = site_.events();
  std::erase_if(clients, [](const auto& event) { return event.first != "closed"; });
  std::sort(clients.begin(), clients.end());
  EXPECT_EQ(std::adjacent_find(clients.begin(), clients.end()), clients.end());
}

TEST_F(WebServer, CountsWatchersInItsCalls) {
  std::vector<std::size_t> counts;
  site_.act = [&](const std::string&, Client) { counts.push_back(server_->watchers()); };
  open();
  {
    RawClient one = watcher();
    { RawClient two = watcher(); }
    EXPECT_TRUE(site_.saw("closed", 1));
  }
  EXPECT_TRUE(site_.saw("closed", 2));
  server_.reset();
  EXPECT_THAT(counts, ElementsAre(1, 2, 1, 0));
}

// ---- the stream for programs

class ProgramStreams : public WebServer {
 protected:
  ProgramStreams() {
    settings_.programs = {"/programs", {"second", "first"}};
    open();
  }
  [[nodiscard]] std::string upgrade(const std::string& path, const std::string& more) const {
    return request(address_, with_token(path), upgrade_headers() + more);
  }
};

TEST_F(ProgramStreams, NeedTheTokenAndASubprotocolButNoOrigin) {
  const std::string protocol = "Sec-WebSocket-Protocol: other, first\r\n";
  EXPECT_EQ(server_->program_address(), "ws://" + address_.host + "/programs?token=" + address_.token);
  EXPECT_EQ(status_of(upgrade("/programs", "")), 400);
  EXPECT_EQ(status_of(upgrade("/programs", "Sec-WebSocket-Protocol: other\r\n")), 400);
  EXPECT_EQ(status_of(request(address_, "/programs?token=00", upgrade_headers() + protocol)), 403);
  EXPECT_EQ(status_of(request(address_, with_token("/programs"), protocol)), 426);
  const auto accepted = answer_to(upgrade("/programs", protocol + "Origin: https://its-maker.example\r\n"));
  ASSERT_TRUE(accepted);
  EXPECT_EQ(accepted->status, 101);
  EXPECT_THAT(accepted->head, HasSubstr("Sec-WebSocket-Protocol: first\r\n"));
  EXPECT_EQ(status_of(upgrade("/stream", "Origin: https://its-maker.example\r\n")), 403);
}

TEST_F(ProgramStreams, EachGetsWhatIsMadeForItAndNoBrowsersTexts) {
  RawClient browser = watcher();
  const std::string words = upgrade("/programs", "Sec-WebSocket-Protocol: first\r\n");
  RawClient one(address_), two(address_);
  for (RawClient* const program : {&one, &two}) {
    program->send(words);
    ASSERT_EQ(program->reply().value_or(Reply{}).status, 101);
    EXPECT_EQ(text_of(program->frame()), "for a program");
  }
  ASSERT_TRUE(site_.saw("program opened", 2));
  EXPECT_EQ(site_.count("opened"), 1U);
  server_->send("for browsers");
  server_->offer([] { return std::vector<Message>{{"offered to browsers"}}; },
                 [](Client client) { return std::vector<Message>{{std::to_string(client)}}; });
  EXPECT_EQ(text_of(browser.frame()), "for browsers");
  EXPECT_EQ(text_of(browser.frame()), "offered to browsers");
  const std::string first = text_of(one.frame()), second = text_of(two.frame());
  EXPECT_NE(first, second);
  EXPECT_THAT(first + second, testing::MatchesRegex("[0-9]+"));
  one.send(browser_text("a request"));
  EXPECT_TRUE(site_.saw("received a request"));
  one.reset();
  EXPECT_TRUE(site_.saw("closed"));
}

TEST_F(WebServer, HasNoStreamForProgramsUnlessTheSettingsDo) {
  open();
  EXPECT_EQ(status_of(request(address_, with_token("/programs"), upgrade_headers())), 404);
  EXPECT_EQ(status_of(request(address_, with_token(""), upgrade_headers())), 400);
}

}  // namespace
}  // namespace twocone::web
