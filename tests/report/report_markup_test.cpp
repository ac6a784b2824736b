// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/html.h"

#include <gtest/gtest.h>

namespace twocone::report {
namespace {

TEST(Escape, MakesEveryMeaningfulCharacterAnEntity) {
  EXPECT_EQ(escape("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(escape("&amp;"), "&amp;amp;") << "text that looks like an entity is text";
}

TEST(Escape, KeepsUtf8AndReplacesInvalidBytes) {
  EXPECT_EQ(escape("gr\u00fcn \u2192 \U0001F916"), "gr\u00fcn \u2192 \U0001F916");
  EXPECT_EQ(escape("a\xFF"
                   "b"),
            "a\uFFFD"
            "b");
  EXPECT_EQ(escape("a\xC3"), "a\uFFFD") << "cut off within a character";
  EXPECT_EQ(escape("\xC0\xAF"), "\uFFFD\uFFFD") << "an overlong '/'";
  EXPECT_EQ(escape("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "half of a surrogate pair";
  EXPECT_EQ(escape("\xEF\xBF\xBF"), "\uFFFD") << "not a character in XML";
}

TEST(Escape, LeavesOutControlCharactersThatXmlForbids) {
  EXPECT_EQ(escape(std::string("a\0b\x01"
                               "c\td\ne",
                               9)),
            "abc\td\ne");
}

TEST(Base64, GivesTheVectorsOfRfc4648) {
  const auto encoded = [](std::string_view text) {
    return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foo"), "Zm9v");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
  EXPECT_EQ(encoded("\xFB\xFF\xBF"), "+/+/");
}

TEST(Slug, GivesANameThatIsSafeInAnyPath) {
  EXPECT_EQ(slug("Red Landmark"), "red_landmark");
  EXPECT_EQ(slug("../../etc"), "______etc");
  EXPECT_EQ(slug(""), "_");
  EXPECT_EQ(slug(std::string(300, 'x')).size(), 32U);
}

TEST(InlineSvg, KeepsTwoFiguresOnOnePageApart) {
  const std::string svg =
      "<?xml version=\"1.0\"?>\n<svg><circle id='dot'/><g id=\"g\"><use xlink:href='#dot' id='two'/>"
      "<text filter=\"url(#box)\">#dot</text></g></svg>";
  EXPECT_EQ(inline_svg(svg, "a"),
            "<svg><circle id='a_dot'/><g id=\"a_g\"><use xlink:href='#a_dot' id='a_two'/>"
            "<text filter=\"url(#a_box)\">#dot</text></g></svg>");
}

}  // namespace
}  // namespace twocone::report
