// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene.h"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/repeated.h"

namespace twocone::sim_povray {
namespace {

using testing::HasSubstr;
using testing_support::repeated;

/// Returns one line of text per token.
std::vector<std::string> tokens(std::string_view text) {
  std::vector<std::string> result;
  Lexer lexer(text);
  for (Token t = lexer.next(); t.kind != Token::Kind::kEnd; t = lexer.next()) {
    const char* kind = "";
    if (t.kind == Token::Kind::kDirective) kind = "#";
    if (t.kind == Token::Kind::kName) kind = "name ";
    result.push_back(fmt::format("{}:{} {}{}", t.place.line, t.place.column, kind, t.text));
  }
  return result;
}

TEST(Lexer, WordsNumbersSymbolsAndDirectives) {
  EXPECT_THAT(tokens("sphere{<1.5,-2e-3,.5>, R_2}\n#declare X=3E+2;"),
              testing::ElementsAre("1:1 sphere", "1:7 {", "1:8 <", "1:9 1.5", "1:12 ,", "1:13 -", "1:14 2e-3", "1:18 ,",
                                   "1:19 .5", "1:21 >", "1:22 ,", "1:24 R_2", "1:27 }", "2:1 #declare", "2:10 X",
                                   "2:11 =", "2:12 3E+2", "2:16 ;"));
}

struct TextCase {
  const char* text;
  std::vector<std::string> expected;
};

TEST(Lexer, SkipsComments) {
  for (const TextCase& c : std::vector<TextCase>{
           {"a /* b */ c", {"1:1 a", "1:11 c"}},
           {"a /* b /* c */ d */ e", {"1:1 a", "1:21 e"}},
           {"a /* b //* c */ d */ e", {"1:1 a", "1:22 e"}},
           {"a /* b // c */ d", {"1:1 a", "1:16 d"}},
           {"/*/ a */ b", {"1:10 b"}},
           {"/* a **/ b", {"1:10 b"}},
           {"/* \" */ b", {"1:9 b"}},
           {"a // b /* c\nd", {"1:1 a", "2:1 d"}},
           {"a // b \" c\nd", {"1:1 a", "2:1 d"}},
           {"a //* b\nd", {"1:1 a", "2:1 d"}},
           {"a / b", {"1:1 a", "1:3 /", "1:5 b"}},
           {"a // no newline at the end", {"1:1 a"}},
           {"a//", {"1:1 a"}},
       }) {
    EXPECT_EQ(tokens(c.text), c.expected) << c.text;
  }
}

TEST(Lexer, StringsHideTheirContent) {
  for (const TextCase& c : std::vector<TextCase>{
           {R"("a // b" c)", {R"(1:1 "a // b")", "1:10 c"}},
           {R"("a /* b" c)", {R"(1:1 "a /* b")", "1:10 c"}},
           {R"("a \" } b" c)", {R"(1:1 "a \" } b")", "1:12 c"}},
           {R"("a\\" c)", {R"(1:1 "a\\")", "1:7 c"}},
           {"\"a\nb\" c", {"1:1 \"a\nb\"", "2:4 c"}},
           {R"("" c)", {R"(1:1 "")", "1:4 c"}},
       }) {
    EXPECT_EQ(tokens(c.text), c.expected) << c.text;
  }
}

TEST(Lexer, LineEndsOfEverySystem) {
  EXPECT_THAT(tokens("a // x\r\nb\r\n c"), testing::ElementsAre("1:1 a", "2:1 b", "3:2 c"));
  EXPECT_THAT(tokens("a // x\rb\n c"), testing::ElementsAre("1:1 a", "2:1 b", "3:2 c"));
}

TEST(Lexer, ByteOrderMarkAndUtf8) {
  EXPECT_THAT(tokens("\xEF\xBB\xBF"
                     "a \"\xC3\xA9\" b"),
              testing::ElementsAre("1:1 a", "1:3 \"\xC3\xA9\"", "1:7 b"))
      << "columns count characters, and the mark is not counted";
}

TEST(Lexer, NameComments) {
  EXPECT_THAT(tokens("{//*PMName robot  \r\n}"), testing::ElementsAre("1:1 {", "1:2 name robot", "2:1 }"));
  EXPECT_THAT(tokens("//*PMName my robot"), testing::ElementsAre("1:1 name my robot"));
  EXPECT_THAT(tokens("//*PMNames robot\n// *PMName a\n//*PMName\n//*PMName \n//*pmname a\n"), testing::IsEmpty());
  EXPECT_THAT(tokens("/*\n//*PMName robot */ */ a"), testing::ElementsAre("2:23 a"));
  EXPECT_THAT(tokens("\"//*PMName robot\""), testing::ElementsAre("1:1 \"//*PMName robot\""));
}

TEST(Lexer, ADirectiveMayBeSeparateFromItsHash) {
  EXPECT_THAT(tokens("# /* x */ \n if"), testing::ElementsAre("1:1 #if"));
  EXPECT_THAT(tokens("#"), testing::ElementsAre("1:1 #"));
}

TEST(Lexer, EmptyTextHasNoToken) {
  EXPECT_THAT(tokens(""), testing::IsEmpty());
  EXPECT_THAT(tokens("\xEF\xBB\xBF"), testing::IsEmpty());
}

// ---- the outline

struct Fault {
  int line = 0;
  int column = 0;
  std::string message;
};
Fault fault_of(std::string_view text) {
  try {
    (void)outline(text);
  } catch (const SceneError& e) {
    return {e.place.line, e.place.column, e.message};
  }
  return {};
}

TEST(Outline, FaultsAreFoundAtTheirPlace) {
  struct Case {
    const char* text;
    int line;
    int column;
    const char* message;
  };
  for (const Case& c : std::vector<Case>{
           {"a\n /* b", 2, 2, "comment has no end"},
           {"/* //*PMName robot */", 1, 1, "comment has no end"},
           {"a\n  \"b", 2, 3, "string has no closing quote"},
           {"\"a\\\"", 1, 1, "string has no closing quote"},
           {"\"a\\", 1, 1, "string has no closing quote"},
           {"union {\n sphere {\n }", 1, 7, "never closed"},
           {"union {\n }\n  }", 3, 3, "closes nothing"},
           {"#if (1)\n union {\n #else }", 1, 1, "#if has no #end"},
           {"#while (X)\n{", 1, 1, "#while has no #end"},
           {"a\n #end", 2, 2, "ends nothing"},
           {"#else", 1, 1, "belongs to no #if"},
           {"#while (X) #else #end", 1, 12, "belongs to no #if"},
           {"#case (1)", 1, 1, "belongs to no #switch"},
           {"#if (0) \"a #end", 1, 9, "string has no closing quote"},
       }) {
    const Fault fault = fault_of(c.text);
    EXPECT_EQ(fault.line, c.line) << c.text;
    EXPECT_EQ(fault.column, c.column) << c.text;
    EXPECT_THAT(fault.message, HasSubstr(c.message)) << c.text;
  }
}

/// Returns the only block of a text.
NamedBlock only_block(const std::string& text) {
  const SceneOutline found = outline(text);
  if (found.blocks.size() != 1) {
    ADD_FAILURE() << found.blocks.size() << " blocks in: " << text;
    return {};
  }
  return found.blocks[0];
}

TEST(Outline, FindsKeywordNameAndBrace) {
  const std::string text =
      "sphere { 0, 1 }\nunion\n{\n\n  // the robot\n  //*PMName robot\n  sphere { 0, 1 } // }\n}\nbox { }";
  const NamedBlock block = only_block(text);
  EXPECT_EQ(block.name, "robot");
  EXPECT_EQ(block.keyword, "union");
  EXPECT_EQ(block.place.line, 6);
  EXPECT_EQ(block.begin, text.find("union"));
  EXPECT_EQ(block.close, text.find("}\nbox"));
  EXPECT_EQ(block.obstacle, "");
}

struct SceneCase {
  const char* text;
  const char* obstacle;  // "" if the block is found and may be used
};

TEST(Outline, EvaluatesDirectivesAsPovRayDoes) {
  for (const char* text : {
           "#if (1) union { //*PMName robot\n } #end",
           "#if (0) } \" { \" #else union { //*PMName robot\n } #end",
           "#if (false) #elseif (yes) union { //*PMName robot\n } #else } #end",
           "#if ((-2.5)) union { //*PMName robot\n } #end",
           "#if (0) #if (X) } #else } #end #end union { //*PMName robot\n }",
           "#if (0) union { //*PMName robot\n } #end object { //*PMName robot\n }",
           "#if (1e-11) union { //*PMName robot\n } #end object { //*PMName robot\n }",
           "#declare A = union { sphere { 0, 1 } } object { //*PMName robot\n A }",
           "#declare A = array[2] { 1, 2 }; union { //*PMName robot\n }",
           "union { //*PMName robot\n #if (X) scale 2 #else scale 3 #end }",
           "#if (X) union { #else merge { #end sphere { 0, 1 } } union { //*PMName robot\n }",
           "#if (X) union { #end sphere { 0, 1 } #if (X) } #end union { //*PMName robot\n }",
           "#if (X) union { #else #end sphere { 0, 1 } #if (X) } #else #end union { //*PMName robot\n }",
           "#switch (X) #case (0) union { #break #range (1, 2) merge { #break #else object { #end } union { //*PMName "
           "robot\n }",
           "#macro Begin(A, B) union { #end #macro End() } #end Begin(1, 2) sphere { } End() union { //*PMName robot\n "
           "}",
           "#macro Swap() } union { #end box { Swap() } union { //*PMName robot\n }",
           "#while (X) sphere { 0, X } #end union { //*PMName robot\n }",
           "#for (I, 1, 9) sphere { 0, I } #end union { //*PMName robot\n }",
           "#debug \"}\" #include \"x}.inc\" union { //*PMName robot\n }",
           "#ifdef (X) sphere { } #end #ifndef (Y) sphere { } #end union { //*PMName robot\n }",
           "\xEF\xBB\xBFunion {\r\n//*PMName robot\r\n}\r\n\x1A",
       }) {
    EXPECT_EQ(only_block(text).obstacle, "") << text;
    EXPECT_EQ(only_block(text).name, "robot") << text;
  }
}

TEST(Outline, NamesTheObstacle) {
  for (const SceneCase& c : std::vector<SceneCase>{
           {"\n#if (X)\nunion { //*PMName robot\n } #end", "under a condition that needs evaluating (#if in line 2)"},
           {"#if (X) #else union { //*PMName robot\n } #end",
            "under a condition that needs evaluating (#if in line 1)"},
           {"#if (X) #elseif (1) union { //*PMName robot\n } #end", "under a condition that needs evaluating"},
           {"#if (0+1) union { //*PMName robot\n } #end", "under a condition that needs evaluating"},
           {"#ifdef (X) union { //*PMName robot\n } #end",
            "under a condition that needs evaluating (#ifdef in line 1)"},
           {"#ifndef (X) union { //*PMName robot\n } #end",
            "under a condition that needs evaluating (#ifndef in line 1)"},
           {"#switch (1) #case (1) union { //*PMName robot\n } #end", "(#switch in line 1)"},
           {"#while (X) union { //*PMName robot\n } #end", "in a loop (#while in line 1)"},
           {"#for (I, 1, 2) union { //*PMName robot\n } #end", "in a loop (#for in line 1)"},
           {"#macro M() union { //*PMName robot\n } #end", "in a macro (#macro M in line 1)"},
           {"\nunion { sphere { //*PMName robot\n } }", "inside the 'union' of line 2"},
           {"#declare R = union { //*PMName robot\n }", "value of a #declare or #local"},
           {"#local R = union { //*PMName robot\n }", "value of a #declare or #local"},
           {"Place(union { //*PMName robot\n }, 3)", "inside the '(' of line 1"},
           {"#macro Begin() union { #end Begin() sphere { //*PMName robot\n } }", "inside the 'Begin' of line 1"},
           {"union { //*PMName robot\n #if (X) } #else scale 2 } #end",
            "its closing brace, in line 2, is under a condition"},
           {"#if (1) #if (X) #if (1) union { //*PMName robot\n } #end #end #end", "(#if in line 1)"},
       }) {
    EXPECT_THAT(only_block(c.text).obstacle, HasSubstr(c.obstacle)) << c.text;
  }
}

TEST(Outline, ANameThatIsNotFirstNamesNoBlock) {
  for (const char* text : {"//*PMName robot\nunion { }", "union { sphere { } //*PMName robot\n }",
                           "union //*PMName robot\n { }", "union { #if (1) //*PMName robot\n #end }"}) {
    const SceneOutline found = outline(text);
    EXPECT_TRUE(found.blocks.empty()) << text;
    ASSERT_EQ(found.strays.size(), 1U) << text;
    EXPECT_EQ(found.strays[0].name, "robot") << text;
  }
  EXPECT_TRUE(outline("#if (0) union { //*PMName robot\n } #end").strays.empty());
}

/// Without limits the time would grow with the square of the text, or double with each macro.
TEST(Outline, NestingIsBounded) {
  const auto fault_of = [](const std::string& text) -> std::string {
    try {
      outline(text);
    } catch (const SceneError& error) {
      return error.message;
    }
    return "";
  };
  EXPECT_EQ(fault_of(repeated("#if (X) ", 199) + repeated("#end ", 199)), "") << "POV-Ray allows this depth";
  EXPECT_THAT(fault_of(repeated("#if (X) ", 200) + repeated("#end ", 200)), HasSubstr("more than 199"));
  EXPECT_EQ(fault_of(repeated("union { ", 256) + repeated("} ", 256)), "");
  EXPECT_THAT(fault_of(repeated("union { ", 257) + repeated("} ", 257)), HasSubstr("more than 256"));
  EXPECT_THAT(fault_of("#macro A() " + repeated("{", 100) + " #end A() A() A()"), HasSubstr("more than 256"));
  std::string doubling = "#macro M0() } #end ";
  for (int i = 1; i < 64; ++i) doubling += fmt::format("#macro M{}() M{}() M{}() #end ", i, i - 1, i - 1);
  EXPECT_THAT(fault_of(doubling), HasSubstr("closes more than 256"));
}

TEST(Outline, EmptySceneHasNoBlocks) {
  EXPECT_TRUE(outline("").blocks.empty());
  EXPECT_TRUE(outline("\n\n// nothing").blocks.empty());
}

}  // namespace
}  // namespace twocone::sim_povray
