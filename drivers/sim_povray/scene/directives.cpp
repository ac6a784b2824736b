// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// POV-Ray's own limit for includes. Macros that call themselves end here; no scene of a person comes near.
constexpr std::size_t kMostInputs = 100;

}  // namespace

void Evaluation::fail(const std::string& why) const {
  throw EvaluationError{fmt::format("{}:{}: {}", inputs_.back().file->path, line_, why)};
}

void Evaluation::unsupported(const Token& token, std::string_view where) const {
  const std::string what = token.kind == Kind::kEnd ? "the end of the text" : fmt::format("'{}'", token.text);
  throw EvaluationError{fmt::format("{}:{}: {} {}", inputs_.back().file->path, token.place.line, what, where)};
}

void Evaluation::fail_at_limit(const std::string& why) const {
  throw EvaluationError{fmt::format("{}:{}: {}", inputs_.back().file->path, line_, why), true};
}

void Evaluation::count_tokens(std::size_t count) {
  tokens_ += count;
  if (tokens_ > settings_.most_tokens) {
    fail_at_limit(fmt::format("the scene has more than {} tokens to evaluate", settings_.most_tokens));
  }
}

void Evaluation::count_objects(std::size_t count) {
  objects_ += count;
  if (objects_ > settings_.most_objects) {
    fail_at_limit(fmt::format("the scene makes more than {} objects, with all parts, corners and copies",
                              settings_.most_objects));
  }
}

Token Evaluation::raw() {
  count_tokens(1);
  while (true) {
    if (auto& pushed = inputs_.back().pushed) return *std::exchange(pushed, std::nullopt);
    Token token;
    try {
      token = inputs_.back().lexer.next();
    } catch (const SceneError& error) {
      throw EvaluationError{fmt::format("{}:{}: {}", inputs_.back().file->path, error.place.line, error.message), true};
    }
    line_ = token.place.line;
    if (token.kind != Kind::kEnd || inputs_.size() == 1) return token;
    if (!inputs_.back().sections.empty()) fail_at_limit("an #if, #while, #for, #switch or #macro has no #end");
    inputs_.pop_back();
  }
}

void Evaluation::put_back(const Token& token) {
  if (token.is('{')) --braces_;
  if (token.is('}')) ++braces_;
  inputs_.back().pushed = token;
}

Token Evaluation::next() {
  while (true) {
    const Token token = raw();
    switch (token.kind) {
      case Kind::kName:
        name_ = token.text;
        continue;
      case Kind::kDirective: {
        const std::size_t inputs = inputs_.size();
        const std::size_t sections = inputs_.back().sections.size();
        const int braces = braces_;
        try {
          directive(token);
        } catch (const EvaluationError& error) {
          if (!is_lenient() || error.is_limit) throw;
          recover_from(token, braces, inputs, sections);
          note(notes_.left_out, error.message);
        }
        continue;
      }
      case Kind::kWord:
        inputs_.back().file->reached[token.place.offset] = true;
        if (const auto* macro = find_as<Macro>(token.text)) {
          call_macro(Macro(*macro));
          continue;
        }
        return token;
      default:
        if (token.is('{')) ++braces_;
        if (token.is('}')) --braces_;
        return token;
    }
  }
}

Token Evaluation::peek() {
  const Token token = next();
  put_back(token);
  return token;
}

char Evaluation::peek_symbol() {
  while (true) {
    const Token token = raw();
    if (token.kind == Kind::kName) continue;
    if (token.kind == Kind::kDirective && token.text == "end" && !inputs_.back().sections.empty() &&
        inputs_.back().sections.back().kind == SectionKind::kMacro) {
      end_section(token);
      continue;
    }
    inputs_.back().pushed = token;
    return token.kind == Kind::kSymbol ? token.text.front() : '\0';
  }
}

bool Evaluation::peek_word(std::string_view word) {
  (void)peek_symbol();
  const auto& token = inputs_.back().pushed;
  return token && token->kind == Kind::kWord && token->text == word;
}

bool Evaluation::accept(char symbol) {
  if (!peek().is(symbol)) return false;
  (void)next();
  return true;
}

bool Evaluation::accept(std::string_view word) {
  const Token token = peek();
  if (token.kind != Kind::kWord || token.text != word) return false;
  (void)next();
  return true;
}

void Evaluation::expect(char symbol) {
  const Token token = next();
  if (!token.is(symbol)) unsupported(token, fmt::format("stands where '{}' is expected", symbol));
}

const std::shared_ptr<Value>* Evaluation::find_shared(std::string_view name) const {
  for (auto input = inputs_.rbegin(); input != inputs_.rend(); ++input) {
    const auto found = input->locals.find(name);
    if (found != input->locals.end()) return &found->second;
  }
  const auto found = globals_.find(name);
  return found == globals_.end() ? nullptr : &found->second;
}

void Evaluation::set(const std::string& name, Value value, bool local) {
  // #declare changes the innermost local name that is visible, and #local a parameter that is a reference: measured.
  if (const auto* known = local ? nullptr : find_shared(name)) {
    **known = std::move(value);
    return;
  }
  auto& slot = (local ? inputs_.back().locals : globals_)[name];
  if (slot == nullptr) slot = std::make_shared<Value>();
  *slot = std::move(value);
}

void Evaluation::directive(const Token& token) {
  const Level level(*this);  // a condition without its end reads the next directive
  const std::string_view word = token.text;
  if (word == "declare" || word == "local") {
    declare(word == "local");
  } else if (word == "macro") {
    define_macro();
  } else if (word == "if") {
    begin_if(condition());
  } else if (word == "ifdef" || word == "ifndef") {
    expect('(');
    const bool defined = find(raw().text) != nullptr;
    expect(')');
    begin_if(defined == (word == "ifdef"));
  } else if (word == "else" || word == "elseif" || word == "end" || word == "case" || word == "range") {
    end_section(token);
  } else if (word == "switch") {
    begin_switch();
  } else if (word == "while" || word == "for") {
    begin_loop(word);
  } else if (word == "break") {
    break_out();
  } else if (word == "include") {
    include();
  } else if (word == "version") {
    version_ = number();
    has_version_ = true;
    if (peek_symbol() == ';') (void)raw();
  } else if (word == "undef") {
    const std::string name(raw().text);
    inputs_.back().locals.erase(name);
    globals_.erase(name);
  } else if (word == "default") {
    read_default();
  } else if (word == "debug" || word == "warning" || word == "render" || word == "statistics") {
    (void)string();
  } else if (word == "error") {
    fail(fmt::format("the scene reports an error: {}", string()));
  } else {
    unsupported(token, "is a directive that is not supported");
  }
}

void Evaluation::check_open(std::string_view directive) const {
  const auto [inputs, sections] = closed_;
  if (inputs_.size() > inputs || inputs_.back().sections.size() > sections) return;
  fail(fmt::format("#{} stands inside of a condition", directive));
}

void Evaluation::end_section(const Token& token) {
  check_open(token.text);
  auto& sections = inputs_.back().sections;
  if (sections.empty()) unsupported(token, "stands outside of what it belongs to");
  const SectionKind kind = sections.back().kind;
  if (token.text == "end") {
    if (kind == SectionKind::kMacro) {
      inputs_.pop_back();
    } else if (kind == SectionKind::kLoop) {
      Loop& loop = *sections.back().loop;
      const Lexer start = loop.start;
      inputs_.back().lexer = start;
      if (!loop_goes_on(loop)) leave_section();
    } else {
      sections.pop_back();
    }
  } else if (kind == SectionKind::kSwitch) {
    // A case without #break goes on into the next one, and into #else.
    if (token.text == "else") return;
    const Condition reading(*this);
    expect('(');
    (void)full();
    if (accept(',')) (void)full();
    expect(')');
  } else {
    leave_section();  // the branch that was taken ends here
  }
}

std::string_view Evaluation::skip_to_branch_end() {
  int depth = 0;
  while (true) {
    const Token token = raw();
    if (token.kind == Kind::kEnd) fail("an #if, #while, #for, #switch or #macro has no #end");
    if (token.kind != Kind::kDirective) continue;
    if (section_begun_by(token.text)) {
      ++depth;
    } else if (token.text == "end") {
      if (depth-- == 0) return token.text;
    } else if (depth == 0 &&
               (token.text == "else" || token.text == "elseif" || token.text == "case" || token.text == "range")) {
      return token.text;
    }
  }
}

/// Skips to the #end of the innermost section.
void Evaluation::leave_section() {
  while (skip_to_branch_end() != "end") {
  }
  inputs_.back().sections.pop_back();
}

void Evaluation::begin_if(bool condition_holds) {
  inputs_.back().sections.push_back({SectionKind::kIf});
  while (!condition_holds) {
    const std::string_view stop = skip_to_branch_end();
    if (stop == "end") {
      inputs_.back().sections.pop_back();
      return;
    }
    condition_holds = stop == "else" || (stop == "elseif" && condition());
  }
}

void Evaluation::begin_switch() {
  expect('(');
  const double selected = full().v[0];
  expect(')');
  inputs_.back().sections.push_back({SectionKind::kSwitch});
  // #case compares with this tolerance, and #range with none: measured.
  constexpr double kEqual = 1e-10;
  while (true) {
    const std::string_view stop = skip_to_branch_end();
    if (stop == "end") {
      inputs_.back().sections.pop_back();
      return;
    }
    if (stop == "else") return;
    const Condition reading(*this);
    expect('(');
    const double from = full().v[0];
    double to = from;
    if (stop == "range") {
      expect(',');
      to = full().v[0];
    }
    expect(')');
    const double tolerance = stop == "range" ? 0 : kEqual;
    if (selected >= from - tolerance && selected <= to + tolerance) return;
  }
}

bool Evaluation::loop_goes_on(Loop& loop) {
  if (loop.counter.empty()) return condition();
  // The body may have changed the counter.
  const auto* present = find_as<Number>(loop.counter);
  const double value = loop.has_begun && present != nullptr ? present->v[0] + loop.step : loop.first;
  loop.has_begun = true;
  set(loop.counter, Number(value), true);
  return loop.step > 0 ? value <= loop.last + 1e-10 : value >= loop.last - 1e-10;
}

void Evaluation::begin_loop(std::string_view kind) {
  Loop loop{.start = inputs_.back().lexer};
  if (kind == "for") {
    expect('(');
    loop.counter = std::string(raw().text);
    const auto known = inputs_.back().locals.find(loop.counter);
    if (known != inputs_.back().locals.end() && known->second.use_count() > 1) {
      fail(fmt::format("'{}' counts a #for and is a name of the macro's caller, which POV-Ray refuses", loop.counter));
    }
    expect(',');
    loop.first = number();
    expect(',');
    loop.last = number();
    loop.step = accept(',') ? number() : 1;
    expect(')');
    if (loop.step == 0) fail("the step of this #for is 0");
    loop.start = inputs_.back().lexer;
  }
  inputs_.back().sections.push_back({SectionKind::kLoop, loop});
  // The condition may call a macro: it changes nothing in `sections` that lasts.
  if (!loop_goes_on(*inputs_.back().sections.back().loop)) leave_section();
}

void Evaluation::break_out() {
  check_open("break");
  auto& sections = inputs_.back().sections;
  while (!sections.empty() && sections.back().kind == SectionKind::kIf) leave_section();
  if (sections.empty()) fail("this #break is in no #switch and no loop");
  if (sections.back().kind == SectionKind::kMacro) {
    inputs_.pop_back();
  } else {
    leave_section();
  }
}

void Evaluation::define_macro() {
  const std::string name(raw().text);
  Macro macro{.file = inputs_.back().file, .body = inputs_.back().lexer, .parameters = {}};
  expect('(');
  for (Token token = raw(); !token.is(')'); token = raw()) {
    if (token.kind == Kind::kWord) {
      macro.parameters.emplace_back(token.text);
    } else if (!token.is(',')) {
      unsupported(token, "stands among the parameters of a macro");
    }
  }
  macro.body = inputs_.back().lexer;
  while (skip_to_branch_end() != "end") {
  }
  set(name, std::move(macro), false);
}

void Evaluation::call_macro(const Macro& macro) {
  const Level level(*this);  // an argument may call a macro
  if (inputs_.size() >= kMostInputs) fail_at_limit(fmt::format("more than {} macros and files are open", kMostInputs));
  Names arguments;
  expect('(');
  for (const std::string& parameter : macro.parameters) {
    if (!arguments.empty()) expect(',');
    auto argument = accept_reference();
    if (argument == nullptr) argument = std::make_shared<Value>(value());
    arguments.insert_or_assign(parameter, std::move(argument));
  }
  expect(')');
  inputs_.push_back({macro.file, macro.body, true, {{SectionKind::kMacro}}, std::move(arguments), {}, braces_});
}

std::shared_ptr<Value> Evaluation::accept_reference() {
  const Token name = peek();
  if (name.kind != Kind::kWord) return nullptr;
  const auto* known = find_shared(name.text);
  if (known == nullptr) return nullptr;
  auto value = *known;
  try {
    const Token after = Lexer(inputs_.back().lexer).next();
    if (!after.is(',') && !after.is(')')) return nullptr;
  } catch (const SceneError&) {
    return nullptr;  // the text ends here, which the next token reports
  }
  (void)next();
  return value;
}

void Evaluation::include() {
  constexpr std::size_t kCost = 1000;  // tokens: that of opening a file
  count_tokens(kCost);
  const std::string name = string();
  const int line = line_;
  if (peek_symbol() == ';') (void)raw();
  line_ = line;
  const auto depth = std::count_if(inputs_.begin(), inputs_.end(), [](const Input& input) { return !input.is_macro; });
  if (std::size_t(depth) > kDeepestInclude)
    fail_at_limit(fmt::format("more than {} files include each other", kDeepestInclude));
  auto found = read_(name);
  if (found && !found->refusal.empty()) fail(found->refusal);
  if (!found || found->is_folder) fail(fmt::format("the file \"{}\" cannot be read", name));
  bytes_ += found->text.size();
  if (bytes_ > kMostIncludedBytes) fail_at_limit(fmt::format("more than {} bytes are included", kMostIncludedBytes));
  files_.push_back({std::move(found->path), std::move(found->text)});
  inputs_.push_back({.file = &files_.back(), .lexer = Lexer(files_.back().text), .braces = braces_});
}

void Evaluation::declare(bool local) {
  const Level level(*this);
  Token name = raw();
  if (name.text == "deprecated") {  // [once] ["what to use instead"]
    name = raw();
    if (name.text == "once") name = raw();
    if (name.kind == Kind::kString) name = raw();
  }
  if (name.kind != Kind::kWord) unsupported(name, "is not a name that can be declared");
  expect('=');
  const int braces = braces_;
  const std::size_t inputs = inputs_.size();
  Leniency notes = std::exchange(notes_, {});
  const auto keep_notes = [&] {
    std::swap(notes, notes_);
    if (is_lenient()) notes_of_declared_.insert_or_assign(std::string(name.text), std::move(notes));
  };
  // Reading the value may end the macro that declares the name, and change which names exist.
  const auto own = inputs_.back().locals.find(name.text);
  const auto* known = !local ? find_shared(name.text) : own != inputs_.back().locals.end() ? &own->second : nullptr;
  const std::shared_ptr<Value> target = known != nullptr ? *known : nullptr;
  const auto assign = [&](Value value) {
    if (target != nullptr) {
      *target = std::move(value);
    } else if (!local || inputs_.size() >= inputs) {
      // A macro that gave the value may still be open: it is not the place of its caller's names.
      Names& names = local ? inputs_[inputs - 1].locals : globals_;
      names.insert_or_assign(std::string(name.text), std::make_shared<Value>(std::move(value)));
    }
  };
  try {
    assign(value());
    if (peek_symbol() == ';') (void)raw();
    keep_notes();
  } catch (const EvaluationError& error) {
    // What the declaration says is lost, but only a use of it is an error. A macro that has been left cannot be
    // entered again.
    keep_notes();
    if (error.is_limit || inputs_.size() < inputs) throw;
    while (inputs_.size() > inputs) {
      braces_ = inputs_.back().braces;
      inputs_.pop_back();
    }
    // The parameters of a function stand before its braces.
    if (braces_ == braces && peek_symbol() == '(') {
      while (!raw().is(')')) {
      }
    }
    if (braces_ == braces && peek_symbol() == '{') (void)next();
    while (braces_ > braces || peek_word("texture")) {
      if (next().kind == Kind::kEnd) throw;
      if (braces_ == braces && peek_symbol() == '{') (void)next();
    }
    assign(Unusable{error.message});
    if (is_lenient()) skip_line(name.place.line);
    if (peek_symbol() == ';') (void)raw();
  }
}

void Evaluation::read_default() {
  expect('{');
  for (Token token = next(); !token.is('}'); token = next()) {
    if (token.text == "texture") {
      default_ = read_texture();
    } else if (token.text == "pigment") {
      default_.pigment = read_pigment();
    } else if (token.text == "finish") {
      default_.finish = read_finish();
    } else {
      unsupported(token, "is not supported in #default");
    }
  }
}

}  // namespace twocone::sim_povray
