// SPDX-License-Identifier: Apache-2.0
#include "apps/web/document.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/page_data.h"

namespace twocone::web {
namespace {

using testing::HasSubstr;
using testing::Not;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(Document, HoldsTitleTextDataAndTheWholeViewer) {
  const std::string page = document({{"page", "report"}, {"name", "lab"}}, "a run", "frames 450");
  EXPECT_THAT(page, HasSubstr("<title>a run</title>"));
  EXPECT_THAT(page, HasSubstr("<pre>frames 450</pre>"));
  EXPECT_THAT(page, HasSubstr(R"(type="application/json">{"page":"report","name":"lab"}</script>)"));
  EXPECT_THAT(page, HasSubstr("d3js.org"));
  EXPECT_THAT(page, HasSubstr("Redistribution and use")) << "the licence of D3";
  EXPECT_THAT(page, HasSubstr("function reportPage("));
  for (const char* const mark : {"@TITLE@", "@STYLE@", "@PLAIN@", "@DATA@", "@LIBRARY@", "@SCRIPT@"}) {
    EXPECT_THAT(page, Not(HasSubstr(mark)));
  }
  EXPECT_EQ(page, document({{"page", "report"}, {"name", "lab"}}, "a run", "frames 450"));
}

TEST(Document, NothingInItsPartsBecomesMarkup) {
  const std::string plain = document({{"page", "report"}}, "", "");
  const std::string hostile = "</script><script>alert(1)</script><!-- @DATA@ @SCRIPT@";
  const std::string page = document({{"page", "report"}, {hostile, hostile}}, hostile, hostile);
  for (const char* const markup : {"<script", "</script", "<!--"}) EXPECT_EQ(count(page, markup), count(plain, markup));
  EXPECT_EQ(testing_support::page_data(page)[hostile], hostile);
}

TEST(Document, TextThatIsNotUtf8IsReplaced) {
  const std::string page = document({{"name", "a\xff"}}, "", "");
  EXPECT_THAT(page, HasSubstr("{\"name\":\"a\xEF\xBF\xBD\"}"));
}

}  // namespace
}  // namespace twocone::web
