// Reads VRML as Webots writes it: nodes and their fields. Worlds are written by strangers, so depth and
// number of values are bounded.
#include "vrml.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace webots_cloud::demo::vrml {
namespace {

enum class Kind
{
    end,
    word,
    number,
    string,
    open_brace,
    close_brace,
    open_bracket,
    close_bracket
};

struct Token
{
    Kind kind = Kind::end;
    std::string text;
    double number = 0;
};

/// Thrown and caught inside this file only: unwinds the recursive descent.
struct Malformed : std::runtime_error
{
    using std::runtime_error::runtime_error;
};

class Lexer
{
public:
    explicit Lexer(std::string_view text) : rest_(text) { advance(); }

    Token const& peek() const { return token_; }
    int line() const { return token_line_; }

    Token take()
    {
        Token taken = std::move(token_);
        advance();
        return taken;
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == ',' || (c >= '\t' && c <= '\r'); }
    static bool ends_word(char c)
    {
        return is_blank(c) || std::string_view{"{}[]\"#"}.find(c) != std::string_view::npos;
    }

    void skip_blanks_and_comments()
    {
        while (!rest_.empty() && (is_blank(rest_[0]) || rest_[0] == '#')) {
            if (rest_[0] == '#') {
                rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
                continue;
            }
            line_ += rest_[0] == '\n';
            rest_.remove_prefix(1);
        }
    }

    void advance()
    {
        skip_blanks_and_comments();
        token_ = {};
        token_line_ = line_;
        if (rest_.empty())
            return;
        switch (rest_[0]) {
        case '{':
            return punctuation(Kind::open_brace);
        case '}':
            return punctuation(Kind::close_brace);
        case '[':
            return punctuation(Kind::open_bracket);
        case ']':
            return punctuation(Kind::close_bracket);
        case '"':
            return quoted();
        default:
            return bare();
        }
    }

    void punctuation(Kind kind)
    {
        token_.kind = kind;
        token_.text = rest_[0];
        rest_.remove_prefix(1);
    }

    void quoted()
    {
        token_.kind = Kind::string;
        rest_.remove_prefix(1);
        while (!rest_.empty() && rest_[0] != '"') {
            if (rest_[0] == '\\' && rest_.size() > 1)
                rest_.remove_prefix(1);
            line_ += rest_[0] == '\n';
            token_.text += rest_[0];
            rest_.remove_prefix(1);
        }
        if (rest_.empty())
            throw Malformed("a string has no closing quote");
        rest_.remove_prefix(1);
    }

    void bare()
    {
        std::size_t length = 0;
        while (length < rest_.size() && !ends_word(rest_[length]))
            ++length;
        token_.text = rest_.substr(0, length);
        rest_.remove_prefix(length);
        char const* first = token_.text.data() + (token_.text[0] == '+' ? 1 : 0);
        char const* const last = token_.text.data() + token_.text.size();
        auto const [end, error] = std::from_chars(first, last, token_.number);
        bool const whole = error == std::errc{} && end == last && std::isfinite(token_.number);
        token_.kind = whole ? Kind::number : Kind::word;
    }

    std::string_view rest_;
    Token token_;
    int line_ = 1;
    int token_line_ = 1;
};

class Reader
{
public:
    explicit Reader(std::string_view text) : lexer_(text) {}

    int line() const { return lexer_.line(); }

    /// The next top-level node; skips `EXTERNPROTO "url"` lines. Nothing at the end of the text.
    std::optional<Node> next()
    {
        while (lexer_.peek().kind == Kind::word &&
               (lexer_.peek().text == "EXTERNPROTO" || lexer_.peek().text == "IMPORTABLE")) {
            lexer_.take();
            if (lexer_.peek().kind == Kind::string)
                lexer_.take();
        }
        if (lexer_.peek().kind == Kind::end)
            return std::nullopt;
        Value holder;
        node(holder, 0);
        if (holder.nodes.empty())
            throw Malformed("a node was expected");
        return std::move(holder.nodes.front());
    }

private:
    void count()
    {
        if (++values_ > max_values)
            throw Malformed("the world has too many values");
    }

    std::string word(char const* expected)
    {
        if (lexer_.peek().kind != Kind::word)
            throw Malformed(std::string(expected) + " was expected");
        return lexer_.take().text;
    }

    /// Reads `[DEF name] Type { ... }`, `USE name`, `IS name` or a bare word such as TRUE into `into`.
    void node(Value& into, std::size_t depth)
    {
        count();
        if (depth > deepest_nesting)
            throw Malformed("nodes are nested too deeply");
        std::string type = word("a node type");
        if (type == "USE" || type == "IS") {
            word("a name");
            return;
        }
        if (type == "DEF") {
            word("a name");
            type = word("a node type");
        }
        if (lexer_.peek().kind != Kind::open_brace) {
            into.words.push_back(std::move(type));
            return;
        }
        lexer_.take();
        Node result;
        result.type = std::move(type);
        while (lexer_.peek().kind != Kind::close_brace) {
            std::string name = word("a field name or '}'");
            if (name == "hidden" && lexer_.peek().kind == Kind::word)
                name = lexer_.take().text;
            value(result.fields[name], depth + 1);
        }
        lexer_.take();
        into.nodes.push_back(std::move(result));
    }

    void value(Value& into, std::size_t depth)
    {
        switch (lexer_.peek().kind) {
        case Kind::open_bracket:
            lexer_.take();
            while (lexer_.peek().kind != Kind::close_bracket)
                item(into, depth);
            lexer_.take();
            return;
        case Kind::number:
            while (lexer_.peek().kind == Kind::number)
                item(into, depth);
            return;
        default:
            item(into, depth);
        }
    }

    void item(Value& into, std::size_t depth)
    {
        switch (lexer_.peek().kind) {
        case Kind::number:
            count();
            into.numbers.push_back(lexer_.take().number);
            return;
        case Kind::string:
            count();
            into.words.push_back(lexer_.take().text);
            return;
        case Kind::word:
            return node(into, depth);
        default:
            throw Malformed("a value was expected");
        }
    }

    Lexer lexer_;
    std::size_t values_ = 0;
};

std::string version_of(std::string_view text)
{
    constexpr std::string_view magic = "#VRML_SIM ";
    if (!text.starts_with(magic))
        return {};
    text.remove_prefix(magic.size());
    return std::string(text.substr(0, std::min(text.find_first_of(" \t\r\n"), std::size_t{16})));
}

} // namespace

Value const& Node::field(std::string_view name) const
{
    static Value const none;
    auto const found = fields.find(name);
    return found == fields.end() ? none : found->second;
}

Document read(std::string_view text)
{
    Document document;
    document.version = version_of(text);
    std::optional<Reader> reader;
    try {
        reader.emplace(text);
        while (auto node = reader->next())
            document.nodes.push_back(std::move(*node));
    } catch (Malformed const& malformed) {
        document.problem = "line " + std::to_string(reader ? reader->line() : 1) + ": " + malformed.what();
    }
    return document;
}

} // namespace webots_cloud::demo::vrml
