// SPDX-License-Identifier: Apache-2.0
#include "apps/web/request.h"

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::web {
namespace {

using testing::HasSubstr;
using testing::Not;
using namespace std::string_literals;

TEST(Target, IsDecoded) {
  const auto target = parse_target("/im%61ge?run=0&token=00ff&frame=1%32&name=a+b%2Bc%26d");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/image");
  EXPECT_EQ(target->token, "00ff");
  EXPECT_EQ(target->query, (Query{{"run", "0"}, {"frame", "12"}, {"name", "a b+c&d"}}));
}

TEST(Target, NeedsNoQueryAndNoToken) {
  for (const char* text : {"/", "/?", "/?token="}) {
    const auto target = parse_target(text);
    ASSERT_TRUE(target) << text;
    EXPECT_EQ(target->path, "/");
    EXPECT_TRUE(target->query.empty() && target->token.empty()) << text;
  }
}

TEST(Target, IsDecodedOnce) { EXPECT_EQ(parse_target("/%252e%252e/x")->path, "/%2e%2e/x"); }

TEST(Target, WithDotsThatAreNoPartOfTheirOwnIsAllowed) {
  for (const std::string text : {"/a.b", "/..a", "/a..", "/...", "/.a/b."}) EXPECT_EQ(parse_target(text)->path, text);
}

TEST(Target, ThatIsHostileIsRefused) {
  const std::string huge(1'000'000, 'x');
  const std::vector<std::string> targets{"",
                                         "*",
                                         "image",
                                         "http://127.0.0.1/",
                                         "?token=1",  // no path
                                         "/..",
                                         "/../etc/passwd",
                                         "/a/../b",
                                         "/a/..",
                                         "/.",
                                         "/a/./b",
                                         "/%2e%2e/x",
                                         "/.%2e/x",
                                         "/%2E./x",
                                         "/..%2fetc",
                                         "/a%2f..%2f..%2fb",
                                         "/..\\x",
                                         "/%5c..%5cx",
                                         "/a\\b",  // traversal
                                         "/%c0%ae%c0%ae/x",
                                         "/%e0%80%ae/x",
                                         "/%ff",
                                         "/\xc3\xa4",
                                         "/%c3%a4",  // overlong forms, bytes beyond ASCII
                                         "/%00",
                                         "/a%00.png",
                                         "/a\0b"s,
                                         "/?a=%00",
                                         "/%0d%0aSet-Cookie:x",
                                         "/\x7f",
                                         "/%7F",
                                         "/?a=\n",
                                         "/%",
                                         "/%2",
                                         "/%g0",
                                         "/%0g",
                                         "/%-1",
                                         "/%+1",
                                         "/% 1",
                                         "/?a=%",
                                         "/?a=%+1",
                                         "/?%zz=1",  // percent-signs
                                         "/?a",
                                         "/?=1",
                                         "/?&a=1",
                                         "/?a=1&&b=2",
                                         "/?a=1&a=2",
                                         "/?token=1&token=1",
                                         "/?token=1&%74oken=2",
                                         "/?" + huge,
                                         "/" + huge + "/..",
                                         "/?a=1&" + huge};
  for (const std::string& text : targets) EXPECT_FALSE(parse_target(text)) << text.substr(0, 80);
}

TEST(Target, ThatIsHugeIsDecoded) {
  const std::string huge(1'000'000, 'x');
  EXPECT_EQ(parse_target("/" + huge + "?a=" + huge)->query.at("a"), huge);
}

TEST(Token, IsEqualAsAWholeOnly) {
  EXPECT_TRUE(equal_in_constant_time("00ff", "00ff"));
  EXPECT_TRUE(equal_in_constant_time("", ""));
  for (const std::string other : {"", "00f", "00ff0", "10ff", "00fe", "00f\xff", "00FF"}) {
    EXPECT_FALSE(equal_in_constant_time(other, "00ff")) << other;
  }
}

TEST(NumericAddress, HasNoNameZoneOrBrackets) {
  for (const std::string text : {"127.0.0.1", "0.0.0.0", "::", "::1", "fe80::1", "::ffff:10.0.0.1"}) {
    EXPECT_TRUE(is_numeric_address(text)) << text;
  }
  for (const std::string& text : {""s, "localhost"s, "127.0.0.1:80"s, "127.1"s, "0x7f000001"s, "2130706433"s, "[::1]"s,
                                  "fe80::1%lo"s, "127.0.0.1\0"s, " 127.0.0.1"s, "1.2.3.4/8"s, "face"s}) {
    EXPECT_FALSE(is_numeric_address(text)) << text;
  }
}

TEST(Authority, HasBracketsAroundIpv6Only) {
  EXPECT_EQ(authority("127.0.0.1", 8080), "127.0.0.1:8080");
  EXPECT_EQ(authority("::1", 80), "[::1]:80");
}

struct HostCase {
  std::string address;
  int port;
  std::vector<std::string> own;
  std::vector<std::string> others;
};

TEST(Host, IsTheServersOwnAddressOrRefused) {
  const std::vector<HostCase> cases{
      {"127.0.0.1",
       8080,
       {"127.0.0.1:8080", "localhost:8080", "[::1]:8080", "[0:0:0:0:0:0:0:1]:8080", "127.1.2.3:8080"},
       {"",
        ":8080",
        "127.0.0.1",
        "localhost",
        "127.0.0.1:80",
        "127.0.0.1:08080",
        "127.0.0.1:8080:8080",
        "evil.example:8080",
        "localhost.evil.example:8080",
        "127.0.0.1.evil.example:8080",
        "10.0.0.1:8080",
        "0.0.0.0:8080",
        "[::]:8080",
        "user@127.0.0.1:8080",
        "127.0.0.1:8080@evil.example:8080",
        "::1:8080",
        "[127.0.0.1]:8080",
        "[::1]",
        "[::1:8080",
        "[]:8080",
        "[:8080",
        "127.0.0.1\0.evil.example:8080"s,
        "127.0.0.1 :8080",
        "127.0.0.1:8080 ",
        "2130706433:8080",
        "[::1%lo]:8080",
        "127.0.0.1:8080, evil.example:8080"}},
      {"127.0.0.1",
       80,
       {"127.0.0.1", "127.0.0.1:80", "localhost", "[::1]", "[::1]:80"},
       {"", ":80", "::1", "evil.example", "127.0.0.1:8080"}},
      {"::1", 9000, {"[::1]:9000", "localhost:9000", "127.0.0.1:9000"}, {"[::2]:9000", "::1:9000"}},
      {"192.168.7.5",
       9000,
       {"192.168.7.5:9000"},
       {"192.168.7.6:9000", "localhost:9000", "127.0.0.1:9000", "[::1]:9000"}},
      {"0.0.0.0",
       9000,
       {"192.168.7.5:9000", "127.0.0.1:9000", "[fe80::1]:9000"},
       {"localhost:9000", "evil.example:9000", "192.168.7.5:9001"}},
      {"::", 9000, {"192.168.7.5:9000", "[fe80::1]:9000"}, {"robot.local:9000", "[fe80::1%eth0]:9000"}}};
  for (const HostCase& c : cases) {
    for (const std::string& host : c.own) EXPECT_TRUE(is_own_host(host, c.address, std::uint16_t(c.port))) << host;
    for (const std::string& host : c.others) {
      EXPECT_FALSE(is_own_host(host, c.address, std::uint16_t(c.port))) << host << " at " << c.address;
    }
  }
}

TEST(SecurityPolicy, NamesTheWebSocketOfTheHost) {
  EXPECT_THAT(security_policy("127.0.0.1:8080"), HasSubstr("connect-src 'self' ws://127.0.0.1:8080"));
  EXPECT_THAT(security_policy("127.0.0.1:8080"), HasSubstr("default-src 'none'"));
  EXPECT_THAT(security_policy("[::1]:8080"), Not(HasSubstr("ws:")));
  EXPECT_THAT(security_policy(""), Not(HasSubstr("ws:")));
}

}  // namespace
}  // namespace twocone::web
