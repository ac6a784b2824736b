// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// Strings are names of files and messages.
constexpr std::size_t kLongestString = 10'000;
/// POV-Ray takes numbers this near to each other as equal, and this near to 0 as false.
constexpr double kEqual = 1e-10;

/// Returns both with the same number of components: a number becomes a vector of equal ones, and a short vector gets 0.
std::pair<Number, Number> promoted(Number a, Number b) {
  const int size = std::max(a.size, b.size);
  for (Number* one : {&a, &b}) {
    if (one->size == 1) std::fill(one->v.begin(), one->v.begin() + size, one->v[0]);
    one->size = size;
  }
  return {a, b};
}

template <class Operation>
Number combine(const Number& first, const Number& second, Operation operation) {
  auto [a, b] = promoted(first, second);
  for (std::size_t i = 0; i < std::size_t(a.size); ++i) a.v[i] = operation(a.v[i], b.v[i]);
  return a;
}

double linear_from_srgb(double coded) {
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

const std::map<std::string_view, double> kConstants{
    {"pi", std::numbers::pi},
    {"tau", 2 * std::numbers::pi},
    {"true", 1},
    {"yes", 1},
    {"on", 1},
    {"false", 0},
    {"no", 0},
    {"off", 0},
};

const std::map<std::string_view, int> kComponents{{"x", 0}, {"u", 0},      {"red", 0},     {"y", 1},
                                                  {"v", 1}, {"green", 1},  {"z", 2},       {"blue", 2},
                                                  {"t", 3}, {"filter", 3}, {"transmit", 4}};

using Unary = double (*)(double);
const std::map<std::string_view, Unary> kUnary{
    {"abs", [](double a) { return std::abs(a); }},
    {"acos", [](double a) { return std::acos(a); }},
    {"asin", [](double a) { return std::asin(a); }},
    {"atan", [](double a) { return std::atan(a); }},
    {"ceil", [](double a) { return std::ceil(a); }},
    {"cos", [](double a) { return std::cos(a); }},
    {"degrees", [](double a) { return a * 180 / std::numbers::pi; }},
    {"exp", [](double a) { return std::exp(a); }},
    {"floor", [](double a) { return std::floor(a); }},
    {"int", [](double a) { return std::trunc(a); }},
    {"ln", [](double a) { return std::log(a); }},
    {"log", [](double a) { return std::log10(a); }},
    {"radians", [](double a) { return a * std::numbers::pi / 180; }},
    {"sin", [](double a) { return std::sin(a); }},
    {"sqrt", [](double a) { return std::sqrt(a); }},
    {"tan", [](double a) { return std::tan(a); }},
};
using Binary = double (*)(double, double);
const std::map<std::string_view, Binary> kBinary{
    {"atan2", [](double a, double b) { return std::atan2(a, b); }},
    {"div", [](double a, double b) { return std::trunc(a / b); }},
    {"mod", [](double a, double b) { return std::fmod(a, b); }},
    {"pow", [](double a, double b) { return std::pow(a, b); }},
};

/// The other functions of call() and vector_call().
const std::set<std::string_view> kOtherFunctions{"min",    "max",     "select",     "seed", "rand",   "strcmp",
                                                 "strlen", "vlength", "vnormalize", "vdot", "vcross", "vrotate"};

const std::map<std::string_view, int> kColourSpaces{{"rgb", 3},  {"rgbf", 4},  {"rgbt", 4},  {"rgbft", 5},
                                                    {"srgb", 3}, {"srgbf", 4}, {"srgbt", 4}, {"srgbft", 5}};

bool is_colour_word(std::string_view word) {
  return word == "color" || word == "colour" || kColourSpaces.contains(word);
}

Vec3 as_vector(const Number& n) { return n.size == 1 ? Vec3{n.v[0], n.v[0], n.v[0]} : Vec3{n.v[0], n.v[1], n.v[2]}; }

}  // namespace

bool Evaluation::condition() {
  const Condition reading(*this);
  expect('(');
  const double truth = full().v[0];
  expect(')');
  return std::abs(truth) >= kEqual;
}

Number Evaluation::full() {
  const Level level(*this);
  Number result = logical();
  if (peek_symbol() == '?') {
    (void)next();
    const Number yes = full();
    expect(':');
    const Number no = full();
    result = std::abs(result.v[0]) >= kEqual ? yes : no;
  }
  return result;
}

Number Evaluation::logical() {
  Number left = relation();
  while (true) {
    const char symbol = peek_symbol();
    if (symbol != '&' && symbol != '|') return left;
    (void)next();
    const bool a = std::abs(left.v[0]) >= kEqual;
    const bool b = std::abs(relation().v[0]) >= kEqual;
    left = Number(symbol == '&' ? a && b : a || b);
  }
}

Number Evaluation::relation() {
  Number left = sum();
  while (true) {
    const char symbol = peek_symbol();
    if (symbol != '<' && symbol != '>' && symbol != '=' && symbol != '!') return left;
    (void)next();
    const bool or_equal = symbol != '=' && peek_symbol() == '=';
    if (or_equal) (void)next();
    const double difference = left.v[0] - sum().v[0];
    // Only comparisons that hold for equal numbers have a tolerance: measured.
    switch (symbol) {
      case '=':
        left = Number(std::abs(difference) <= kEqual);
        break;
      case '!':
        left = Number(std::abs(difference) > kEqual);
        break;
      case '<':
        left = Number(or_equal ? difference <= kEqual : difference < 0);
        break;
      default:
        left = Number(or_equal ? difference >= -kEqual : difference > 0);
    }
  }
}

Number Evaluation::sum() {
  const Level level(*this);
  Number left = product();
  while (true) {
    const char symbol = peek_symbol();
    if (symbol != '+' && symbol != '-') break;
    (void)next();
    const Number right = product();
    left = symbol == '+' ? combine(left, right, std::plus<>()) : combine(left, right, std::minus<>());
  }
  return left;
}

Number Evaluation::product() {
  Number left = factor();
  while (true) {
    const char symbol = peek_symbol();
    if (symbol != '*' && symbol != '/') return left;
    (void)next();
    const Number right = factor();
    left = symbol == '*' ? combine(left, right, std::multiplies<>()) : combine(left, right, std::divides<>());
  }
}

Number Evaluation::factor() {
  const Token token = peek();
  if (token.is('-') || token.is('+') || token.is('!')) {
    (void)next();
    const Level level(*this);
    const Number value = factor();
    if (token.is('!')) return Number(std::abs(value.v[0]) < kEqual);
    return token.is('-') ? combine(Number(0.0), value, std::minus<>()) : value;
  }
  Number value = primary();
  while (peek_symbol() == '.') {
    (void)next();
    const Token name = raw();
    const auto component = kComponents.find(name.text);
    if (component == kComponents.end()) unsupported(name, "is not a component of a vector or colour");
    // The fourth component of a vector is t, and of a colour filter.
    value = Number(value.v[std::size_t(component->second)]);
  }
  return value;
}

Number Evaluation::vector_literal() {
  Number result;
  result.size = 0;
  do {
    if (result.size == 5) fail("this vector has more than five components");
    result.v[std::size_t(result.size++)] = sum().v[0];
    (void)accept(',');
  } while (!peek().is('>'));
  (void)next();
  if (result.size == 1) fail("a vector of one component");
  return result;
}

Number Evaluation::primary() {
  const Token token = next();
  if (token.kind == Kind::kNumber) {
    double value = 0;
    const auto [end, error] = std::from_chars(token.text.data(), token.text.data() + token.text.size(), value);
    if (error != std::errc() || end != token.text.data() + token.text.size()) unsupported(token, "is not a number");
    return Number(value);
  }
  if (token.is('(')) {
    const Number value = full();
    expect(')');
    return value;
  }
  if (token.is('<')) return vector_literal();
  if (token.kind != Kind::kWord) unsupported(token, "stands where a number or vector is expected");
  return name_value(token);
}

Number Evaluation::name_value(const Token& token) {
  const std::string_view word = token.text;
  if (const Value* value = find(word)) {
    if (const auto* known = std::get_if<Number>(value)) return *known;
    if (const auto* why = std::get_if<Unusable>(value)) throw EvaluationError{why->why};
    unsupported(token, "is not a number, vector or colour");
  }
  if (word == "x") return Vec3{1, 0, 0};
  if (word == "y") return Vec3{0, 1, 0};
  if (word == "z") return Vec3{0, 0, 1};
  if (word == "u" || word == "v" || word == "t") {
    Number result;
    result.size = word == "t" ? 4 : 2;
    result.v[word == "t" ? 3 : word == "v" ? 1 : 0] = 1;
    return result;
  }
  if (is_colour_word(word)) {
    put_back(token);
    return colour_value();
  }
  if (const auto constant = kConstants.find(word); constant != kConstants.end()) return Number(constant->second);
  if (word == "version") return Number(version_);
  if (word == "image_width" && settings_.width_px > 0) return Number(settings_.width_px);
  if (word == "image_height" && settings_.height_px > 0) return Number(settings_.height_px);
  if (word == "defined") {
    expect('(');
    const bool defined = find(raw().text) != nullptr;
    expect(')');
    return Number(defined);
  }
  if (!kUnary.contains(word) && !kBinary.contains(word) && !kOtherFunctions.contains(word)) {
    unsupported(token, "is neither declared nor supported here");
  }
  return call(std::string(word));
}

Number Evaluation::call(const std::string& function) {
  expect('(');
  std::optional<Number> result = vector_call(function);
  if (result) {
    // done
  } else if (const auto unary = kUnary.find(function); unary != kUnary.end()) {
    result = unary->second(full().v[0]);
  } else if (const auto binary = kBinary.find(function); binary != kBinary.end()) {
    const double a = full().v[0];
    result = binary->second(a, argument());
  } else if (function == "min" || function == "max") {
    double value = full().v[0];
    while (accept(',')) {
      const double other = full().v[0];
      value = function == "min" ? std::min(value, other) : std::max(value, other);
    }
    result = value;
  } else if (function == "select") {
    const double choice = full().v[0];
    const double negative = argument();
    const double zero = argument();
    const double positive = peek().is(',') ? argument() : zero;
    result = choice < 0 ? negative : choice > 0 ? positive : zero;
  } else if (function == "seed") {
    // Seeds of other sizes wrap in POV-Ray; they are not distinguished here from wrong ones.
    const double seed = full().v[0];
    if (!(std::abs(seed) < 2147483647)) fail("this seed() is not a 32-bit integer");
    streams_.emplace_back(int(seed));
    result = double(streams_.size() - 1);
  } else if (function == "rand") {
    const double stream = full().v[0];
    if (!(stream >= 0 && stream < double(streams_.size()))) fail("rand() of something that seed() did not return");
    result = streams_[std::size_t(stream)].next();
  } else if (function == "strcmp") {
    const std::string a = string();
    expect(',');
    result = double(a.compare(string()));
  } else {
    const std::string text = string();  // strlen
    double letters = 0;
    for (std::size_t i = 0; i < text.size(); i += text[i] == '\\' ? 2 : 1) ++letters;
    result = letters;
  }
  expect(')');
  return *result;
}

std::optional<Number> Evaluation::vector_call(const std::string& function) {
  const auto second = [this] {
    expect(',');
    return as_vector(full());
  };
  if (function == "vlength") return length(as_vector(full()));
  if (function == "vnormalize") {
    const Vec3 v = as_vector(full());
    return length(v) == 0 ? Vec3{} : normalized(v);
  }
  if (function == "vdot") {
    const Vec3 a = as_vector(full());
    return dot(a, second());
  }
  if (function == "vcross") {
    const Vec3 a = as_vector(full());
    return cross(a, second());
  }
  if (function == "vrotate") {
    const Vec3 a = as_vector(full());
    return Transform::rotation(second()).point(a);
  }
  return std::nullopt;
}

double Evaluation::argument() {
  expect(',');
  return full().v[0];
}

double Evaluation::number() { return sum().v[0]; }

Vec3 Evaluation::vector() { return as_vector(sum()); }

bool Evaluation::flag() {
  const Token token = peek();
  if (token.kind == Kind::kNumber || kConstants.contains(token.text)) return std::abs(number()) >= kEqual;
  return true;
}

Number Evaluation::colour_value() {
  (void)(accept("color") || accept("colour"));
  Number result;
  result.size = 5;
  const Token token = peek();
  if (token.text == "red" || token.text == "green" || token.text == "blue") {
    while (true) {
      const Token part = peek();
      const auto component = kComponents.find(part.text);
      if (part.kind != Kind::kWord || component == kComponents.end() || part.text.size() == 1) return result;
      (void)next();
      result.v[std::size_t(component->second)] = number();
    }
  }
  const auto space = kColourSpaces.find(token.text);
  if (token.kind == Kind::kWord && space != kColourSpaces.end()) {
    (void)next();
    Number given = sum();
    if (given.size == 1) {
      std::fill(given.v.begin(), given.v.begin() + space->second, given.v[0]);
      given.size = space->second;
    }
    std::copy(given.v.begin(), given.v.begin() + 3, result.v.begin());
    const bool only_transmit = token.text.ends_with("bt");
    for (int i = 3; i < space->second && i < given.size; ++i) {
      result.v[std::size_t(only_transmit ? 4 : i)] = given.v[std::size_t(i)];
    }
    if (token.text.front() == 's') {
      for (std::size_t i = 0; i < 3; ++i) result.v[i] = linear_from_srgb(result.v[i]);
    }
  } else {
    const Number given = sum();
    result.v = given.v;
    if (given.size == 1) std::fill(result.v.begin(), result.v.end(), given.v[0]);
  }
  // A colour goes on with parts of it: `color Red filter 0.5`.
  for (Token part = peek(); part.text == "filter" || part.text == "transmit"; part = peek()) {
    (void)next();
    result.v[part.text == "filter" ? 3 : 4] = number();
  }
  return result;
}

Colour Evaluation::colour() {
  const Token here = peek();
  const Number value = colour_value();
  if (value.v[3] != 0 || value.v[4] != 0) unsupported(here, "begins a transparent colour, which is not supported");
  return {value.v[0], value.v[1], value.v[2]};
}

bool Evaluation::begins_colour(const Token& token) const {
  return token.kind == Kind::kWord && (is_colour_word(token.text) || find_as<Number>(token.text) != nullptr);
}

Colour Evaluation::grey_or_colour() {
  if (is_colour_word(peek().text)) return colour();
  return as_vector(sum());
}

std::string Evaluation::string() {
  const Level level(*this);
  const Token token = next();
  if (token.kind == Kind::kString) return std::string(token.text.substr(1, token.text.size() - 2));
  if (token.text == "concat") {
    expect('(');
    std::string result = string();
    while (accept(',')) {
      result += string();
      if (result.size() > kLongestString)
        fail_at_limit(fmt::format("this string has more than {} bytes", kLongestString));
    }
    expect(')');
    return result;
  }
  if (token.text == "str") {
    expect('(');
    const double value = full().v[0];
    const int least = int(std::clamp(argument(), -100.0, 100.0));
    const int digits = int(std::clamp(argument(), -1.0, 17.0));
    expect(')');
    const int shown = digits < 0 ? 6 : digits;
    return least < 0 ? fmt::format("{:0{}.{}f}", value, -least, shown) : fmt::format("{:{}.{}f}", value, least, shown);
  }
  if (const auto* known = find_as<std::string>(token.text)) return *known;
  unsupported(token, "stands where a string is expected");
}

Value Evaluation::value() {
  const Level level(*this);
  const Token token = peek();
  if (token.kind == Kind::kString || token.text == "concat" || token.text == "str") return string();
  if (token.kind != Kind::kWord) return full();
  const std::string_view word = token.text;
  const Value* known = find(word);
  if (known != nullptr) {
    if (const auto* why = std::get_if<Unusable>(known)) throw EvaluationError{why->why};
    if (!std::holds_alternative<Number>(*known)) {
      (void)next();
      if (const auto* object = std::get_if<Object>(known)) return copied(*object);
      return *known;
    }
    return full();
  }
  const auto after = [&](auto read) {
    (void)next();
    return (this->*read)();
  };
  if (word == "pigment") return after(&Evaluation::read_pigment);
  if (word == "finish") return after(&Evaluation::read_finish);
  if (word == "texture") {
    Texture texture = after(&Evaluation::read_texture);
    // Of opaque layers only the last is seen.
    while (peek_word("texture")) texture = after(&Evaluation::read_texture);
    return texture;
  }
  if (word == "camera") return after(&Evaluation::read_camera);
  if (word == "light_source") return after(&Evaluation::read_light);
  if (word == "transform") return after(&Evaluation::read_placing);
  if (word == "color_map" || word == "colour_map" || word == "pigment_map") {
    (void)next();
    return read_map(word == "pigment_map");
  }
  if (is_colour_word(word)) return colour_value();
  (void)next();
  if (auto object = read_object(token)) return *std::move(object);
  put_back(token);
  return full();
}

}  // namespace twocone::sim_povray
