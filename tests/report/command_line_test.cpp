// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/commands.h"

#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

using testing::StrEq;
using testing::ThrowsMessage;

struct Asked {
  std::string robot, budget;
  std::uint64_t seed = 1;
  double patience_s = 10;
  std::vector<std::string> runs;
};

/// Returns a program with subcommands that writes the parsed options into `asked`.
std::unique_ptr<CLI::App> program(Asked& asked) {
  auto app = std::make_unique<CLI::App>("a program", "twocone");
  app->require_subcommand(1);
  app->formatter(std::make_shared<HelpFormatter>());
  CLI::App* run = app->add_subcommand("run", "drives");
  run->add_option("--robot", asked.robot)->required();
  run->add_option("--budget-ms", asked.budget);
  run->add_option("--seed", asked.seed)->check(whole_number());
  run->add_option("--patience", asked.patience_s)->check(number_within(0, 86'400));
  CLI::App* compare = app->add_subcommand("compare", "compares");
  compare->add_option("RUN", asked.runs)->required()->expected(1, 2);
  app->add_subcommand("calibrate", "calibrates")->add_option("RUN", asked.runs)->required();
  return app;
}

/// Returns the error message for a call with these words, or "accepted".
std::string answer(const std::string& words, Asked* into = nullptr) {
  Asked asked;
  Asked& to = into == nullptr ? asked : *into;
  const auto app = program(to);
  try {
    app->parse(words);
  } catch (const CLI::ParseError& error) {
    return explain(*app, error);
  }
  return "accepted";
}

TEST(CommandLine, AnUnknownOptionNamesTheOneThatWasMeantAndTheRightHelp) {
  EXPECT_EQ(answer("run --robot f --budget_ms 3"),
            "unknown option '--budget_ms', did you mean --budget-ms? (see twocone run --help)");
  EXPECT_EQ(answer("run --robot f --sed=7"), "unknown option '--sed=7', did you mean --seed? (see twocone run --help)");
  EXPECT_EQ(answer("run --robot f -seed 7"), "unknown option '-seed', did you mean --seed? (see twocone run --help)");
  EXPECT_EQ(answer("run --robot f --budget 7"),
            "unknown option '--budget', did you mean --budget-ms? (see twocone run --help)");
  EXPECT_EQ(answer("run --robot f --teleport 7"), "unknown option '--teleport' (see twocone run --help)");
  EXPECT_EQ(answer("run --robt f"),
            "unknown option '--robt', did you mean --robot?; --robot is required (see twocone run --help)");
  EXPECT_EQ(answer("compare a b --job 3"), "unknown option '--job' (see twocone compare --help)")
      << "the 3 is its value, not a third run";
  EXPECT_EQ(answer("--quick run --robot f"), "unknown option '--quick' (see twocone --help)");
}

TEST(CommandLine, UnexpectedWordsAreNamedInTheirOrder) {
  EXPECT_EQ(answer("run --robot f one two three"),
            "nothing is expected at 'one' 'two' 'three' (see twocone run --help)");
  EXPECT_EQ(answer("run f"), "nothing is expected at 'f'; --robot is required (see twocone run --help)");
}

TEST(CommandLine, OtherMistakesAreReportedWithTheRightHelp) {
  EXPECT_EQ(answer("run"), "--robot is required (see twocone run --help)");
  EXPECT_EQ(answer("run --robot"), "--robot needs a value (see twocone run --help)");
  EXPECT_EQ(answer("compare a b c"), "RUN: At Most 2 required but received 3 (see twocone compare --help)");
}

TEST(CommandLine, AnUnknownSubcommandNamesTheOneThatWasMeant) {
  Asked asked;
  const auto app = program(asked);
  EXPECT_EQ(subcommand_named(*app, "run").get_name(), "run");
  EXPECT_THAT([&] { (void)subcommand_named(*app, "calibrat"); },
              ThrowsMessage<BadUsage>(
                  StrEq("no subcommand 'calibrat', did you mean calibrate?; there are: run, compare, calibrate")));
  EXPECT_THAT([&] { (void)subcommand_named(*app, "dance"); },
              ThrowsMessage<BadUsage>(StrEq("no subcommand 'dance'; there are: run, compare, calibrate")));
}

TEST(CommandLine, UsageShowsHowOftenAWordMayOccur) {
  Asked asked;
  const auto app = program(asked);
  const auto usage = [&app](const std::string& name) {
    const std::string help = app->get_subcommand(name)->help("twocone");
    const std::size_t at = help.find("Usage: ");
    return help.substr(at, help.find('\n', at) - at);
  };
  EXPECT_EQ(usage("compare"), "Usage: twocone compare [OPTIONS] RUN [RUN]");
  EXPECT_EQ(usage("calibrate"), "Usage: twocone calibrate [OPTIONS] RUN...");
}

TEST(CommandLine, ASeedIsAWholeNumberThatItsTypeHolds) {
  Asked asked;
  EXPECT_EQ(answer("run --robot f --seed 18446744073709551615", &asked), "accepted");
  EXPECT_EQ(asked.seed, 18446744073709551615U);
  for (const std::string bad :
       {"-1", "99999999999999999999999", "18446744073709551616", "1.5", "1e3", "0x10", "+1", "one"}) {
    EXPECT_EQ(answer("run --robot f --seed " + bad),
              "--seed: '" + bad + "' must be a whole number from 0 to 18446744073709551615 (see twocone run --help)");
  }
}

TEST(CommandLine, ANumberOutsideItsRangeIsRejectedAndSoIsNan) {
  Asked asked;
  EXPECT_EQ(answer("run --robot f --patience 0.5", &asked), "accepted");
  EXPECT_EQ(asked.patience_s, 0.5);
  for (const std::string bad : {"nan", "-0.1", "86401", "inf", "long"}) {
    EXPECT_EQ(answer("run --robot f --patience " + bad),
              "--patience: '" + bad + "' must be a number from 0 to 86400 (see twocone run --help)");
  }
}

TEST(ProgressLine, IsNeverAsWideAsTheTerminal) {
  for (const std::string what :
       {"verify", "186 settings, 240 shards", "a name that is longer than a narrow terminal"}) {
    for (int columns = 2; columns <= 132; ++columns) {
      for (const double done : {-1.0, 0.0, 0.019, 0.37, 1.0, 2.0}) {
        const std::string line = progress_line(what, done, 300, columns);
        EXPECT_LT(line.size(), std::size_t(columns)) << "'" << line << "' in " << columns << " columns";
      }
    }
  }
}

TEST(ProgressLine, OmitsTheBarAndThenTheTimeInANarrowTerminal) {
  EXPECT_EQ(progress_line("render", 0.25, 60, 80), "render [#######.......................]  25 % 3:00 left");
  EXPECT_EQ(progress_line("render", 0.25, 60, 40), "render [###...........]  25 % 3:00 left");
  EXPECT_EQ(progress_line("render", 0.25, 60, 30), "render  25 % 3:00 left");
  EXPECT_EQ(progress_line("render", 0.25, 60, 20), "render  25 %");
  EXPECT_EQ(progress_line("render", 0.25, 60, 8), "render ");
  EXPECT_EQ(progress_line("render", 0.01, 60, 80), "render [..............................]   1 %")
      << "too early for an estimate";
}

}  // namespace
}  // namespace twocone::cli
