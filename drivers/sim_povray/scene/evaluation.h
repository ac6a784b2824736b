// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/evaluator.h"
#include "drivers/sim_povray/scene/random_stream.h"
#include "drivers/sim_povray/scene/scene_text.h"

/// The parts of evaluator.h, private to this folder.
namespace twocone::sim_povray {

/// A number, vector or colour. A colour has five components: red, green, blue, filter, transmit.
struct Number {
  std::array<double, 5> v{};
  int size = 1;

  Number() = default;
  Number(double value) : v{value} {}                                    // NOLINT: a number is a number
  Number(const Vec3& value) : v{value.x, value.y, value.z}, size(3) {}  // NOLINT
};

/// Moves a pigment with the surface that shows it.
void move_pigment(Pigment& pigment, const Transform& transform);

/// A transformation, and the pose that follows it.
struct Placing {
  Transform transform{};
  std::optional<int> mover{};
};

using ColourMap = std::vector<PigmentEntry>;

/// A text that is evaluated, or was.
struct SourceFile {
  std::string path;
  std::string text;
  std::shared_ptr<const std::string> shared_path = std::make_shared<const std::string>(path);
  std::vector<bool> reached = std::vector<bool>(text.size());  // offsets of the words that were evaluated
};

struct Macro {
  SourceFile* file = nullptr;
  Lexer body;
  std::vector<std::string> parameters;
};

/// A declaration that cannot be evaluated, and why.
struct Unusable {
  std::string why;
};

using Value = std::variant<Number, std::string, Placing, ColourMap, Pigment, Finish, Texture, Object, LightSource,
                           PerspectiveCamera, Macro, Unusable>;

/// A macro shares the value of a name that it gets as an argument: POV-Ray passes it by reference.
using Names = std::map<std::string, std::shared_ptr<Value>, std::less<>>;

/// Thrown at what cannot be evaluated; what() as `FILE:LINE: why`.
struct EvaluationError {
  std::string message;
  bool is_limit = false;  ///< the evaluation must end, also if nothing uses the declaration
};

/// Returns whether read_bound() knows the shape of that keyword.
bool has_bound(std::string_view word);

/// Reads one scene from its first token to its last. Each group of functions has a file: directives.cpp,
/// expressions.cpp, textures.cpp, objects.cpp, items.cpp.
class Evaluation {
 public:
  Evaluation(std::string_view text, const std::string& path, const IncludeReader& read,
             const EvaluatorSettings& settings);

  EvaluatedScene run();

 private:
  /// Counts how deep the reading is: a text must not exhaust the stack.
  class Level {
   public:
    explicit Level(Evaluation& evaluation) : depth_(evaluation.nesting_) {
      constexpr int kMostNesting = 200;
      if (depth_ >= kMostNesting) evaluation.fail("this is nested too deeply");
      ++depth_;
    }
    ~Level() { --depth_; }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

   private:
    int& depth_;
  };

  /// While it exists, the sections that are open stay open: a condition must not end what depends on it.
  class Condition {
   public:
    explicit Condition(Evaluation& evaluation)
        : evaluation_(evaluation),
          outer_(std::exchange(evaluation.closed_,
                               {evaluation.inputs_.size(), evaluation.inputs_.back().sections.size()})) {}
    ~Condition() { evaluation_.closed_ = outer_; }
    Condition(const Condition&) = delete;
    Condition& operator=(const Condition&) = delete;

   private:
    Evaluation& evaluation_;
    std::pair<std::size_t, std::size_t> outer_;
  };

  // ---- tokens and directives
  struct Loop {
    Lexer start;            // at the condition
    std::string counter{};  // of a #for
    double first = 0, last = 0, step = 0;
    bool has_begun = false;
  };
  struct Section {
    SectionKind kind;
    std::optional<Loop> loop{};
  };
  /// A file, or a macro's body, that is being read.
  struct Input {
    SourceFile* file;
    Lexer lexer;
    bool is_macro = false;
    std::vector<Section> sections{};
    Names locals{};
    std::optional<Token> pushed{};  // read ahead
    int braces = 0;                 // that were open where it begins
  };

  /// Returns the next token of the present input as it is written.
  Token raw();
  /// Returns the next token that is not a directive, and not a macro's name: these are carried out.
  Token next();
  /// Returns the same, and leaves it to be read again.
  Token peek();
  void put_back(const Token& token);
  /// Returns the next symbol if it can continue an expression; carries out nothing but the end of a macro.
  char peek_symbol();
  /// Returns whether the next token is that word; carries out as little as peek_symbol().
  bool peek_word(std::string_view word);
  bool accept(char symbol);
  bool accept(std::string_view word);
  void expect(char symbol);

  void directive(const Token& token);
  void end_section(const Token& token);
  /// Fails if the directive would end a section whose condition is being read.
  void check_open(std::string_view directive) const;
  /// Skips to the directive that ends the present branch, and returns it.
  std::string_view skip_to_branch_end();
  void leave_section();
  void begin_if(bool condition);
  void begin_switch();
  bool loop_goes_on(Loop& loop);
  void begin_loop(std::string_view kind);
  void break_out();
  void define_macro();
  void call_macro(const Macro& macro);
  void include();
  void declare(bool local);
  void read_default();

  [[nodiscard]] const std::shared_ptr<Value>* find_shared(std::string_view name) const;
  [[nodiscard]] const Value* find(std::string_view name) const {
    const auto* found = find_shared(name);
    return found == nullptr ? nullptr : found->get();
  }
  void set(const std::string& name, Value value, bool local);
  /// Returns the value of the name that is the whole next argument of a macro, or null.
  std::shared_ptr<Value> accept_reference();
  /// Returns the value of a declared name of that type, or null.
  template <class T>
  [[nodiscard]] const T* find_as(std::string_view name) const {
    const Value* value = find(name);
    return value == nullptr ? nullptr : std::get_if<T>(value);
  }
  [[noreturn]] void fail(const std::string& why) const;
  /// Count against the limits, and fail beyond them.
  void count_tokens(std::size_t count);
  void count_objects(std::size_t count);
  [[noreturn]] void fail_at_limit(const std::string& why) const;
  [[noreturn]] void unsupported(const Token& token, std::string_view where) const;

  // ---- recovery from what is not supported
  [[nodiscard]] bool is_lenient() const { return settings_.leniency != nullptr; }
  /// Reads something. If that fails in a lenient evaluation, notes it, goes on behind it, and returns false.
  /// @param is_noted false: only a texture is concerned
  template <class Read>
  bool attempt(Read read, bool is_noted = true) {
    const int braces = braces_;
    const std::size_t inputs = inputs_.size();
    try {
      read();
      return true;
    } catch (const EvaluationError& error) {
      if (!is_lenient() || error.is_limit) throw;
      recover(braces, inputs);
      if (is_noted) note(notes_.left_out, error.message);
      return false;
    }
  }
  /// Leaves the inputs and the braces that have been entered since there were so many.
  void recover(int braces, std::size_t inputs);
  /// Goes on behind a directive that failed. @param braces,inputs,sections those that were open before it
  void recover_from(const Token& token, int braces, std::size_t inputs, std::size_t sections);
  static void note(std::vector<std::string>& list, const std::string& message);
  /// What a declared object lacks counts where the object is used.
  void note_use(std::string_view name);
  void skip_line(int line);
  /// Reads a shape for which has_bound() holds, as a simple one around it.
  Shape read_bound(std::string_view word);
  /// Reads a part of an object that only a lenient evaluation knows, or leaves it out.
  void read_bound_part(const Token& token, Object& object);
  /// Leaves out a word that is not understood and the block or numbers that follow it.
  void skip_argument();

  // ---- expressions
  bool condition();
  Number full();
  Number logical();
  Number relation();
  Number sum();
  Number product();
  Number factor();
  Number primary();
  Number vector_literal();
  Number name_value(const Token& token);
  Number call(const std::string& function);
  std::optional<Number> vector_call(const std::string& function);
  double number();
  double argument();
  Vec3 vector();
  Colour grey_or_colour();
  Colour colour();
  [[nodiscard]] bool begins_colour(const Token& token) const;
  Number colour_value();
  std::string string();
  Value value();
  bool flag();

  // ---- textures
  void read_pigment_parts(Pigment& pigment);
  /// Fails if the pigment has grown beyond the limits.
  void check_size(Pigment& pigment);
  bool read_pigment_part(const Token& token, Pigment& pigment);
  bool read_pattern(std::string_view word, Pigment& pigment);
  bool read_wave(const Token& token, Pigment& pigment);
  Pigment read_pigment() { return change_pigment(default_.pigment); }
  Finish read_finish() { return change_finish(default_.finish); }
  /// Reads what changes a pigment or a finish: a texture that has one keeps what the text does not name.
  Pigment change_pigment(Pigment pigment);
  Finish change_finish(Finish finish);
  Texture read_texture();
  ColourMap read_map(bool of_pigments);
  PatternStep read_warp();
  std::vector<PigmentEntry> read_list();
  bool read_transformation(const Token& token, Placing& placing);
  Placing read_placing();

  // ---- objects
  std::optional<Object> read_object(const Token& token);
  /// Returns a copy, whose parts count against the limit.
  Object copied(const Object& object);
  /// Reads the brace that opens a block. @returns the block's name; empty: none
  std::string open_block();
  Shape read_shape(const std::string& word);
  std::vector<Contour> read_contours(int count);
  Csg read_csg(Combination combination);
  void read_object_parts(Object& object);
  bool read_object_part(const Token& token, Object& object);
  void place(Object& object, const Placing& placing);
  void skip_block();
  /// Skips until no more than so many braces are open.
  void leave_block(int braces);
  std::vector<Object> read_objects();

  // ---- items of the scene
  LightSource read_light();
  PerspectiveCamera read_camera();
  void read_global_settings();
  void read_item(const Token& token);

  const IncludeReader& read_;
  const EvaluatorSettings& settings_;
  std::deque<SourceFile> files_;
  std::deque<Input> inputs_;
  Names globals_;
  std::vector<RandomStream> streams_;
  std::size_t tokens_ = 0;
  std::size_t objects_ = 0;
  std::size_t bytes_ = 0;
  int braces_ = 0;
  int nesting_ = 0;
  std::pair<std::size_t, std::size_t>
      closed_{};    // inputs_, and sections of the last one, that a condition keeps; 0: none is read
  Leniency notes_;  // of what is being read: of a declaration, else of the scene
  std::map<std::string, Leniency, std::less<>> notes_of_declared_;
  int line_ = 1;           // of the last token read
  std::string_view name_;  // the last name comment read
  double version_ = 3.7;
  bool has_version_ = false;
  bool has_assumed_gamma_ = false;
  Texture default_;
  EvaluatedScene scene_;
  std::string camera_obstacle_;
};

}  // namespace twocone::sim_povray
