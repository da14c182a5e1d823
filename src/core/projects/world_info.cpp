// Looks for WorldInfo in the text of a world, word by word, without understanding the rest.
#include "world_info.hpp"

#include "core/text.hpp"
#include "core/unicode_characters.hpp"

#include <optional>

namespace webots_cloud::core {
namespace {

constexpr std::size_t longest_title = 100;
constexpr std::size_t longest_text = 200;

/// A word, a string without its quotes, or one of `{}[]`.
struct WorldToken
{
    enum class Kind
    {
        end,
        word,
        string,
        sign
    };

    Kind kind = Kind::end;
    std::string text;

    bool is(Kind wanted, std::string_view what) const { return kind == wanted && text == what; }
    bool opens() const { return kind == Kind::sign && (text == "{" || text == "["); }
    bool closes() const { return kind == Kind::sign && (text == "}" || text == "]"); }
};

class WorldTokens
{
public:
    explicit WorldTokens(std::string_view file) : rest_(file) {}

    WorldToken next()
    {
        skip_blanks();
        if (rest_.empty())
            return {};
        if (rest_.front() == '"')
            return string();
        if (signs.find(rest_.front()) != std::string_view::npos)
            return take(WorldToken::Kind::sign, 1);
        auto const end = rest_.find_first_of(word_ends);
        return take(WorldToken::Kind::word, end == std::string_view::npos ? rest_.size() : end);
    }

private:
    static constexpr std::string_view signs = "{}[]";
    static constexpr std::string_view blanks = " \t\r\n,";
    static constexpr std::string_view word_ends = " \t\r\n,#\"{}[]";

    void skip_blanks()
    {
        for (;;) {
            auto const begin = rest_.find_first_not_of(blanks);
            rest_.remove_prefix(begin == std::string_view::npos ? rest_.size() : begin);
            if (!rest_.starts_with('#'))
                return;
            auto const line = rest_.find('\n');
            rest_.remove_prefix(line == std::string_view::npos ? rest_.size() : line);
        }
    }

    WorldToken take(WorldToken::Kind kind, std::size_t length)
    {
        WorldToken token;
        token.kind = kind;
        token.text = rest_.substr(0, length);
        rest_.remove_prefix(length);
        return token;
    }

    WorldToken string()
    {
        WorldToken token;
        token.kind = WorldToken::Kind::string;
        for (rest_.remove_prefix(1); !rest_.empty() && rest_.front() != '"'; rest_.remove_prefix(1)) {
            if (rest_.front() == '\\' && rest_.size() > 1)
                rest_.remove_prefix(1);
            token.text += rest_.front();
        }
        if (rest_.empty())
            return {}; // the file ends, or what we have of it: half a sentence is none
        rest_.remove_prefix(1);
        return token;
    }

    std::string_view rest_;
};

/// `"text"`, or `[ "text" "text" ]`; `first` is the token after the name of the field.
std::string strings_of(WorldToken first, WorldTokens& tokens)
{
    if (first.kind == WorldToken::Kind::string)
        return std::move(first.text);
    std::string all;
    if (!first.is(WorldToken::Kind::sign, "["))
        return all;
    for (auto token = tokens.next(); token.kind == WorldToken::Kind::string; token = tokens.next())
        all += concat(all.empty() ? "" : " ", token.text);
    return all;
}

} // namespace

std::string one_line(std::string_view text, std::size_t limit)
{
    constexpr std::string_view ellipsis = "…";
    std::string line;
    std::size_t whole = 0; // bytes of the words that are complete
    bool is_cut = false;
    while (!text.empty()) {
        auto const length = utf8_length(text);
        if (length == 0)
            return {};
        auto const kind = kind_of_character(code_point(text, length));
        if (kind == CharacterKind::space || kind == CharacterKind::hidden) {
            whole = line.ends_with(' ') || line.empty() ? whole : line.size();
            if (!line.empty() && !line.ends_with(' '))
                line += ' ';
        } else {
            line += text.substr(0, length);
        }
        text.remove_prefix(length);
        if (line.size() > limit) {
            is_cut = true;
            break;
        }
    }
    if (!is_cut)
        return std::string(trim(line));
    // One word that is too long is cut within.
    if (whole == 0 || whole + ellipsis.size() > limit) {
        whole = 0;
        for (auto rest = std::string_view(line); whole + utf8_length(rest) + ellipsis.size() <= limit;
             rest = std::string_view(line).substr(whole))
            whole += utf8_length(rest);
    }
    return concat(trim(std::string_view(line).substr(0, whole)), ellipsis);
}

bool is_published(std::string_view webots_yml)
{
    constexpr std::string_view key = "publish:";
    for (auto line : split(webots_yml, '\n')) {
        if (!line.starts_with(key))
            continue;
        line.remove_prefix(key.size());
        auto const value = lower_case(trim(line.substr(0, line.find('#'))));
        return value != "false" && value != "no" && value != "off";
    }
    return true;
}

WorldInfo world_info(std::string_view file)
{
    WorldTokens tokens(file.substr(0, world_info_bytes));
    WorldInfo info;
    auto token = tokens.next();
    while (token.kind != WorldToken::Kind::end && !token.is(WorldToken::Kind::word, "WorldInfo"))
        token = tokens.next();
    if (!tokens.next().is(WorldToken::Kind::sign, "{"))
        return info;
    int depth = 1;
    for (token = tokens.next(); depth > 0 && token.kind != WorldToken::Kind::end; token = tokens.next()) {
        if (depth == 1 && token.is(WorldToken::Kind::word, "title"))
            info.title = one_line(strings_of(tokens.next(), tokens), longest_title);
        else if (depth == 1 && token.is(WorldToken::Kind::word, "info"))
            info.text = one_line(strings_of(tokens.next(), tokens), longest_text);
        else
            depth += token.opens() ? 1 : token.closes() ? -1 : 0;
    }
    return info;
}

} // namespace webots_cloud::core
