// SPDX-License-Identifier: Apache-2.0
#include "hal/device_info.h"

#include <gtest/gtest.h>

namespace twocone {
namespace {

TEST(Printable, LeavesTextAsItIs) {
  for (const char* text : {"", "USB Roboclaw 2x7a v4.1.34", "Caméra 3 µm", "\u30ab\u30e1\u30e9", "\U0001F4F7"}) {
    EXPECT_EQ(printable(text), text);
  }
}

// Catches a device whose name controls the terminal in which it is listed.
TEST(Printable, ReplacesControlCharacters) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a?[2Jb");
  EXPECT_EQ(printable(std::string_view("a\0b\r\n\t\x7f", 7)), "a?b????") << "zeros and lines";
  EXPECT_EQ(printable("a\xc2\x9b"
                      "31mb"),
            "a??31mb")
      << "the one-character CSI";
  EXPECT_EQ(printable("a\u202eb"), "a???b") << "a mark that reverses the direction of writing";
}

TEST(Printable, ReplacesBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("\xff\xfe"), "??");
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "?31m")
      << "CSI in Latin 1";
  EXPECT_EQ(printable("\xc0\x9b"), "??") << "an overlong form";
  EXPECT_EQ(printable("\xe0\x9b"), "??") << "truncated";
  EXPECT_EQ(printable("\xed\xa0\x80"), "???") << "a surrogate";
}

}  // namespace
}  // namespace twocone
