// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/yaml_reader.h"

#include <filesystem>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/text_file.h"
#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

namespace fs = std::filesystem;

/// A folder for each test, which is removed after it.
class ReadingFiles : public testing::Test {
 protected:
  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    return temporary_.write(name, text);
  }

  const testing_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

std::string refusal(const fs::path& file) {
  return message_of([&] { load_yaml(file); });
}

TEST_F(ReadingFiles, TextComesByteForByte) {
  std::string bytes;
  for (int i = 0; i < 100'000; ++i) bytes.push_back(static_cast<char>(i * 31));  // larger than any one block read
  EXPECT_EQ(read_text(write("bytes", bytes)), bytes);
  EXPECT_EQ(read_text(write("nothing", "")), "");
}

TEST_F(ReadingFiles, AnUnreadableFileIsReportedInOneLine) {
  EXPECT_EQ(refusal(folder_ / "absent.yaml"), (folder_ / "absent.yaml").string() + ": no such file");
  EXPECT_EQ(refusal(folder_ / "absent" / "absent.yaml"),
            (folder_ / "absent" / "absent.yaml").string() + ": no such file");
  EXPECT_EQ(refusal(folder_), folder_.string() + ": is a folder, must be a file");
  EXPECT_EQ(refusal(write("file", "a: 1") / "below.yaml"), (folder_ / "file/below.yaml").string() + ": no such file");

  fs::create_symlink(folder_ / "ring", folder_ / "ring");
  EXPECT_EQ(refusal(folder_ / "ring"),
            (folder_ / "ring").string() + ": cannot be read: Too many levels of symbolic links");
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(refusal(folder_ / "pipe"), (folder_ / "pipe").string() + ": is not a regular file");
  // The file opens, and reading it fails even for the superuser, because address 0 is never mapped.
  EXPECT_EQ(refusal("/proc/self/mem"), "/proc/self/mem: cannot be read: Input/output error");
}

TEST_F(ReadingFiles, AFileWithoutADocumentIsEmpty) {
  for (const char* text : {"", "\n\n", "# only a comment\n", "---\n", "~\n"}) {
    const fs::path file = write("empty.yaml", text);
    EXPECT_EQ(refusal(file), file.string() + ": is empty, must be a mapping of keys") << "text: " << text;
  }
}

TEST_F(ReadingFiles, ASecondDocumentIsNotDroppedSilently) {
  const fs::path file = write("two.yaml", "a: 1\n---\na: 2\n");
  EXPECT_EQ(refusal(file), file.string() + ": holds several YAML documents, must be one");
}

TEST_F(ReadingFiles, AnUnopenedBracketIsRejectedAtOnce) {
  // yaml-cpp's LoadAll makes an endless number of empty documents from these texts.
  for (const char* text : {",name: lab\n", "], name: lab\n", "}\n", "name: lab\n, a\n"}) {
    const fs::path file = write("front.yaml", text);
    EXPECT_EQ(refusal(file).rfind(file.string() + ":", 0), 0u) << "text: " << text << "\n" << refusal(file);
  }
}

TEST_F(ReadingFiles, SyntaxErrorsHaveLineAndColumn) {
  const fs::path file = write("broken.yaml", "name: lab\ndrive: {driver: sim_povray\nmap: x\n");
  EXPECT_EQ(refusal(file), file.string() + ":3:4: end of map flow not found") << "the colon behind map";
  const fs::path tab = write("tab.yaml", "drive:\n\tdriver: a\n");
  EXPECT_EQ(refusal(tab), tab.string() + ":2: the line is indented by a tab, must be by spaces");
  const fs::path later = write("tab_later.yaml", "drive: [1,\nname: a: b\n\nlate:\n\tx: 1\n");
  EXPECT_EQ(refusal(later).find("tab,"), std::string::npos) << "the error precedes the tab: " << refusal(later);
}

TEST_F(ReadingFiles, DepthBeyondReasonIsASyntaxError) {
  const fs::path file = write("deep.yaml", std::string(100'000, '['));
  EXPECT_EQ(refusal(file).rfind(file.string() + ":1:", 0), 0u) << refusal(file).substr(0, 200);
}

TEST_F(ReadingFiles, AFileThatIsNoMappingIsNamedByItsKind) {
  EXPECT_EQ(message_of([] { parse_robot(parse_yaml("- 1\n- 2\n", "list.yaml"), "list.yaml"); }),
            "list.yaml:1: the file is [1, 2], must be a mapping of keys");
  EXPECT_EQ(message_of([] { parse_robot(parse_yaml("# a\nhello\n", "word.yaml"), "word.yaml"); }),
            "word.yaml:2: the file is 'hello', must be a mapping of keys");
}

TEST_F(ReadingFiles, AKeyThatTheLargerFileLacksIsReportedToo) {
  const YAML::Node run = YAML::Load("seed: 1");
  EXPECT_EQ(message_of([&] { parse_robot(run["robot"], "run.yaml"); }), "run.yaml: the mapping to be read is missing");
  EXPECT_EQ(message_of([] { parse_robot(YAML::Load("robot:")["robot"], "run.yaml"); }),
            "run.yaml:1: the file is empty, must be a mapping of keys");
}

TEST_F(ReadingFiles, WindowsLineEndsAndAByteOrderMarkDoNotMatter) {
  std::string text = read_text(data("good_robot.yaml"));
  std::string dos = "\xEF\xBB\xBF";
  for (const char c : text) dos += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(parse_robot(parse_yaml(dos, "a.yaml"), "a.yaml"), parse_robot(parse_yaml(text, "a.yaml"), "a.yaml"));
}

TEST_F(ReadingFiles, PathsStartAtTheFilesFolder) {
  EXPECT_EQ(resolve("../scenes/lab.map.yaml", "robots/lab.yaml"), "scenes/lab.map.yaml");
  EXPECT_EQ(resolve("lab.pov", "lab.map.yaml"), "lab.pov");
  EXPECT_EQ(resolve("/srv/lab.pov", "scenes/lab.map.yaml"), "/srv/lab.pov");
}

TEST_F(ReadingFiles, DotDotBehindALinkMeansTheSameAsForTheSystem) {
  fs::create_directories(folder_ / "far/robots");
  static_cast<void>(write("far/lab.map.yaml", "far"));
  static_cast<void>(write("lab.map.yaml", "near"));
  fs::create_directory_symlink(folder_ / "far/robots", folder_ / "robots");
  EXPECT_EQ(read_text(resolve("../lab.map.yaml", folder_ / "robots/lab.yaml")), "far");
  EXPECT_EQ(read_text(resolve("../lab.map.yaml", folder_ / "far/robots/lab.yaml")), "far");
}

/// Reads numbers as people write them, with a key that accepts any number.
std::string read_x(const std::string& number, double& x) {
  return message_of([&] {
    Reading reading(parse_yaml("x: " + number, "n.yaml"), "n.yaml");
    reading.root().number("x", {"x", kMetres, kAnyNumber}, x);
    reading.finish();
  });
}

TEST(Numbers, AreDecimalInEverySpelling) {
  const std::pair<const char*, double> spellings[] = {
      {"0.3", 0.3},      {"-0.3", -0.3},   {"+0.3", 0.3}, {".3", 0.3}, {"3.", 3.0},
      {"3e2", 300},      {"-3E-2", -0.03}, {"010", 10.0}, {"-0", 0.0}, {"1.5707963267948966", 1.5707963267948966},
      {"1e-300", 1e-300}};
  for (const auto& [text, wanted] : spellings) {
    double x = 1e9;
    EXPECT_EQ(read_x(text, x), "no error") << text;
    EXPECT_EQ(x, wanted) << text;
  }
}

TEST(Numbers, OtherTextIsNone) {
  for (const char* text : {"0x10", "0o10", "1_000", "1e", "--1", "+-1", "1.2.3", "e3", "+", ".", "true", "12h"}) {
    double x = 1e9;
    EXPECT_EQ(read_x(text, x), fmt::format("n.yaml:1: x is '{}', must be a number (metres)", text));
    EXPECT_EQ(x, 1e9) << "a rejected value must not be stored: " << text;
  }
}

TEST(Numbers, ALongValueIsCutBetweenCharacters) {
  std::string text = "y";
  for (int i = 0; i < 100; ++i) text += "\u00e4";  // two bytes each: byte 60 is inside one
  std::string shown = "y";
  for (int i = 0; i < 29; ++i) shown += "\u00e4";
  double x = 0;
  EXPECT_EQ(read_x(text, x), fmt::format("n.yaml:1: x is '{}...', must be a number (metres)", shown));
}

/// Damages files. Whatever bytes change, the file is read, or a FileError names it on every line.
TEST(DamagedFiles, AreRejectedOrRead) {
  constexpr int kFiles = 3000;
  const std::string good = read_text(data("good_robot.yaml"));
  std::mt19937_64 random(20240607);
  int refused = 0;
  for (int i = 0; i < kFiles; ++i) {
    std::string text = good;
    const int changes = 1 + static_cast<int>(random() % 3);
    for (int change = 0; change < changes; ++change) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          text.erase(at, 1 + random() % 20);
          break;
        case 2:
          text.insert(at, 1, "{}[]:,-#&*!|>'\"%@\n\t ?"[random() % 22]);
          break;
        default:
          text.resize(at + 1);
      }
    }
    const std::string message = message_of([&] { parse_robot(parse_yaml(text, "robot.yaml"), "robot.yaml"); });
    if (message == "no error") continue;
    ++refused;
    for (std::size_t line = 0; line != std::string::npos; line = message.find('\n', line)) {
      if (message[line] == '\n') ++line;
      ASSERT_EQ(message.compare(line, 11, "robot.yaml:"), 0) << "file " << i << ":\n" << text << "\n" << message;
    }
  }
  EXPECT_GT(refused, kFiles / 2) << "the damage must have an effect";
  EXPECT_LT(refused, kFiles) << "damaged comments do no harm";
}

}  // namespace
}  // namespace twocone::config
