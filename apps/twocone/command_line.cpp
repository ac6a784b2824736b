// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/commands.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/yaml/names.h"
#include "apps/estimation/method.h"
#include "base/log.h"

namespace twocone::cli {
namespace {

/// Replaces '-' by '_', because config::nearest() expects an underscore before a unit.
std::string underscored(std::string_view name) {
  std::string text(name);
  std::ranges::replace(text, '-', '_');
  return text;
}

/// Returns the option of `command` that `word` probably means, for example for --budget_ms or -seed.
std::optional<std::string> option_meant(const CLI::App& command, std::string_view word) {
  word = word.substr(0, word.find('='));
  word.remove_prefix(std::min(word.find_first_not_of('-'), word.size()));
  std::vector<std::string> names, known;
  for (const CLI::Option* const option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      names.push_back(name);
      known.push_back(underscored(name));
    }
  }
  const std::optional<std::string> found = config::nearest(underscored(word), known);
  if (!found) return std::nullopt;
  return "--" + names[std::size_t(std::ranges::find(known, *found) - known.begin())];
}

/// Returns the text of CLI11, except for "--robot: 1 required TEXT missing".
std::string what_of(const CLI::ParseError& error) {
  std::string what = error.what();
  const std::size_t at = what.find(": 1 required ");
  if (at == std::string::npos || !what.ends_with(" missing")) return what;
  return what.substr(0, at) + " needs a value";
}

}  // namespace

std::string HelpFormatter::make_option_usage(const CLI::Option* option) const {
  const std::string name = make_option_name(option, true);
  const int least = option->get_required() ? std::max(1, option->get_expected_min()) : 0;
  std::string text;
  const auto add = [&text](const std::string& word) { text += (text.empty() ? "" : " ") + word; };
  if (option->get_expected_max() >= CLI::detail::expected_max_vector_size) {
    add(least > 0 ? name + "..." : "[" + name + "...]");
    return text;
  }
  for (int i = 0; i < std::max(1, option->get_expected_max()); ++i) add(i < least ? name : "[" + name + "]");
  return text;
}

std::string explain(const CLI::App& program, const CLI::ParseError& error) {
  const auto chosen = program.get_subcommands();
  const bool is_program = chosen.empty() || program.remaining_size() > 0;
  const CLI::App& command = is_program ? program : *chosen.front();
  std::string text, words;
  for (const std::string& word : command.remaining()) {
    if (word.size() > 1 && word.starts_with('-') && word != "--") {
      const std::string_view option = std::string_view(word).substr(0, word.find('='));
      const std::string_view present = config::present_name(config::NameOf::kOption, option);
      const auto meant = option_meant(command, word);
      text += fmt::format("{}unknown option '{}'{}", text.empty() ? "" : "; ", word,
                          present != option ? fmt::format(", it is now named {}", present)
                          : meant           ? fmt::format(", did you mean {}?", *meant)
                                            : "");
    } else {
      words += fmt::format(" '{}'", word);
    }
  }
  // A word after an unknown option is probably its value.
  if (text.empty() && !words.empty()) text = "nothing is expected at" + words;
  // A word after an unknown option may be the cause of another complaint.
  const bool is_missing = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  if (text.empty() || is_missing) {
    text += fmt::format("{}{}", text.empty() ? "" : "; ", what_of(error));
  }
  return fmt::format("{} (see twocone {}--help)", text, is_program ? "" : command.get_name() + " ");
}

const CLI::App& subcommand_named(const CLI::App& program, const std::string& name) {
  std::vector<std::string> known;
  for (const CLI::App* const command : program.get_subcommands({})) {
    if (command->get_name() == name) return *command;
    known.push_back(command->get_name());
  }
  const auto meant = config::nearest(name, known);
  throw BadUsage("no subcommand '{}'{}; there are: {}", name, meant ? fmt::format(", did you mean {}?", *meant) : "",
                 fmt::join(known, ", "));
}

void add_help(CLI::App& program) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = program.add_subcommand("help", "Print what a subcommand does, and its options");
  command->add_option("COMMAND", *name, "Subcommand; none: list all subcommands");
  command->callback([&program, name] {
    const CLI::App& asked = name->empty() ? program : subcommand_named(program, *name);
    const std::string usage = name->empty() ? "twocone" : "twocone " + *name;
    fmt::print("{}", program.get_formatter()->make_help(&asked, usage, CLI::AppFormatMode::Normal));
  });
}

void add_log_level(CLI::App& program) {
  const std::vector<std::string> levels(base::kLogLevels.begin(), base::kLogLevels.end());
  for (const char* name :
       {"run", "localise", "serve", "look", "calibrate", "survey", "doctor", "tradeoff", "compare"}) {
    program.get_subcommand(name)
        ->add_option_function<std::string>("--log-level", base::show_log,
                                           "Show the log on standard error, from this level on")
        ->check(CLI::IsMember(levels));
  }
}

config::Robot RobotArgument::read() const {
  std::vector<config::KeyChange> parsed;
  for (const std::string& change : changes) parsed.push_back(config::parse_change(change));
  return config::read_robot(file, parsed);
}

CLI::Option* add_robot(CLI::App* command, RobotArgument& robot, const std::string& text) {
  command
      ->add_option("--set", robot.changes,
                   "KEY=VALUE: use this value for a key of the robot file, such as cameras.lower.antialias=3;\n"
                   "may be given more than once")
      ->allow_extra_args(false);
  return command->add_option("--robot", robot.file, text);
}

CLI::Option* add_renderer(CLI::App* command, std::optional<sim_povray::RendererKind>& kind) {
  return command
      ->add_option_function<std::string>(
          "--renderer", [&kind](const std::string& name) { kind = sim_povray::renderer_named(name); },
          "What renders a simulation: auto (the native renderer if its first image agrees with\n"
          "POV-Ray's, else POV-Ray), native (unchecked) or povray (default: from the map, else auto)")
      ->check(CLI::IsMember({"auto", "native", "povray"}));
}

CLI::Validator whole_number() {
  return CLI::Validator(
      [](std::string& text) {
        std::uint64_t number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error == std::errc() && end == text.data() + text.size()) return std::string();
        return fmt::format("'{}' must be a whole number from 0 to {}", text, std::numeric_limits<std::uint64_t>::max());
      },
      "");
}

CLI::Validator number_within(double least, double greatest) {
  return CLI::Validator(
      [least, greatest](std::string& text) {
        double number = 0;
        const bool is_number = CLI::detail::lexical_cast(text, number);
        if (is_number && number >= least && number <= greatest) return std::string();
        return fmt::format("'{}' must be a number from {} to {}", text, least, greatest);
      },
      fmt::format("in [{} - {}]", least, greatest));
}

CLI::Validator is_method() {
  return CLI::Validator(
      [](const std::string& name) -> std::string {
        try {
          static_cast<void>(estimation::method_named(name));
          return {};
        } catch (const std::invalid_argument& error) {
          return error.what();
        }
      },
      fmt::format("{{{}}}", fmt::join(estimation::method_names(), ",")));
}

}  // namespace twocone::cli
