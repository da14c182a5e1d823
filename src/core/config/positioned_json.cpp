// Our own reader of JSON, because libraries stop at the first mistake and forget where values stood. It works
// from left to right and goes on behind a fault where that is possible; config_reader.cpp turns places into
// lines and columns.
#include "positioned_json.hpp"

#include "core/text.hpp"
#include "written_quantity.hpp"

#include <boost/json/stream_parser.hpp>

#include <algorithm>
#include <array>
#include <optional>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
constexpr std::size_t max_depth = 32; // as Boost.JSON
constexpr std::size_t max_remarks = 200;
constexpr std::array<std::string_view, 6> yes{"True", "TRUE", "yes", "Yes", "on", "On"};
constexpr std::array<std::string_view, 6> no{"False", "FALSE", "no", "No", "off", "Off"};
constexpr std::array<std::string_view, 5> nothing{"None", "NULL", "Null", "nil", "undefined"};

/// What is no UTF-8, as it begins, and how it is called.
struct Encoding
{
    std::string_view beginning;
    std::string_view name;
};
constexpr std::array encodings{
    Encoding{std::string_view("\xff\xfe\0\0", 4), "UTF-32"},
    Encoding{std::string_view("\0\0\xfe\xff", 4), "UTF-32"},
    Encoding{"\xff\xfe", "UTF-16"},
    Encoding{"\xfe\xff", "UTF-16"},
    Encoding{std::string_view("{\0\0\0", 4), "UTF-32"},
    Encoding{std::string_view("\0\0\0{", 4), "UTF-32"},
    Encoding{std::string_view("{\0", 2), "UTF-16"},
    Encoding{std::string_view("\0{", 2), "UTF-16"},
};

// What word processors and web pages put in the place of quotes and blanks.
constexpr std::array<std::string_view, 7> typographic_quotes{
    "\xe2\x80\x9c", "\xe2\x80\x9d", "\xe2\x80\x9e", "\xe2\x80\x98", "\xe2\x80\x99", "\xc2\xab", "\xc2\xbb"};
constexpr std::array<std::string_view, 3> typographic_blanks{"\xc2\xa0", "\xe2\x80\xaf", "\xe2\x80\x8b"};

bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool is_structural(char c)
{
    return std::string_view(",:{}[]\"'").find(c) != std::string_view::npos;
}

template<class Words>
bool is_among(Words const& words, std::string_view word)
{
    return std::ranges::find(words, word) != words.end();
}

/// In a string: `\w` as in `C:\worlds`, which JSON does not know.
bool has_odd_escape(std::string_view token)
{
    for (std::size_t i = 0; i + 1 < token.size(); ++i)
        if (token[i] == '\\' && std::string_view("\"\\/bfnrtu").find(token[++i]) == std::string_view::npos)
            return true;
    return false;
}

/// As for `007`; otherwise nothing.
std::string number_advice(std::string_view token)
{
    auto const first = token.find_first_not_of('0');
    bool const is_number = token.find_first_not_of("0123456789") == std::string_view::npos;
    return first == 0 || first == std::string_view::npos || !is_number
               ? std::string()
               : concat(": write ", token.substr(first), ", without zeros in front");
}

/// Goes through the text from left to right. After a fault from which there is no way on, `broken_` is set,
/// and everybody returns what there is.
class JsonReader
{
public:
    explicit JsonReader(std::string_view text) : text_(text) {}

    PositionedJson read()
    {
        if (text_.starts_with(byte_order_mark)) {
            fault(0, "the file begins with a byte order mark, which is no JSON: save it as UTF-8 without one "
                     "(\"UTF-8\" instead of \"UTF-8 with BOM\")");
            at_ = byte_order_mark.size();
        }
        if (auto const encoding = other_encoding(); !encoding.empty())
            stop(0, concat("the file is in ", encoding, ": save it as UTF-8"));
        else
            read_all();
        std::stable_sort(json_.faults.begin(), json_.faults.end(),
                         [](auto const& left, auto const& right) { return left.offset < right.offset; });
        return std::move(json_);
    }

private:
    void read_all()
    {
        skip();
        if (is_at_end())
            return stop(at_, "the file is empty");
        auto const begin = at_;
        bool const is_likely = is_structural(text_[begin]) || is_at_string();
        json_.value = value(json_.place, 0);
        if (!is_likely && !json_.faults.empty()) {
            json_.faults.clear();
            return stop(begin, "a configuration begins with {, and this does not");
        }
        skip();
        if (!broken_ && !is_at_end())
            stop(at_, "the configuration has ended before this");
    }

    std::string_view other_encoding() const
    {
        for (auto const& encoding : encodings)
            if (text_.starts_with(encoding.beginning))
                return encoding.name;
        return {};
    }

    bool is_at_end() const { return at_ == text_.size(); }
    bool is_at(char c) const { return !is_at_end() && text_[at_] == c; }
    bool is_at(std::string_view beginning) const { return text_.substr(at_).starts_with(beginning); }
    bool is_at_comment() const { return is_at("//") || is_at("#") || is_at("/*"); }
    bool is_at_string() const
    {
        return is_at('"') || is_at('\'') || typographic(typographic_quotes, at_) > 0;
    }

    /// The size of the one of these characters that stands at an offset; 0: none does.
    template<std::size_t count>
    std::size_t typographic(std::array<std::string_view, count> const& characters, std::size_t offset) const
    {
        for (auto const character : characters)
            if (text_.substr(offset).starts_with(character))
                return character.size();
        return 0;
    }

    void fault(std::size_t offset, std::string text)
    {
        json_.faults.emplace_back(offset, std::move(text));
        if (json_.faults.size() < max_remarks)
            return;
        broken_ = true; // it is no configuration at all
        json_.is_complete = false;
    }

    void stop(std::size_t offset, std::string text)
    {
        fault(offset, std::move(text));
        broken_ = true;
        json_.is_complete = false;
    }

    void stop_at_end(std::string_view what, std::size_t begin)
    {
        stop(at_,
             concat("the file ends within the ", what, " that begins at ", line_and_column(text_, begin)));
    }

    void skip_comment()
    {
        bool const is_block = is_at("/*");
        auto const end = text_.find(is_block ? "*/" : "\n", at_ + 1);
        at_ = end == std::string_view::npos ? text_.size() : end + (is_block ? 2 : 0);
    }

    /// White space and comments, of which those without anything in between are one fault.
    void skip()
    {
        std::optional<std::size_t> first;
        for (; !is_at_end();) {
            if (is_space(text_[at_])) {
                ++at_;
            } else if (auto const blank = typographic(typographic_blanks, at_)) {
                if (!std::exchange(has_odd_blanks_, true))
                    fault(at_, "here is a character that looks like a space and is none, as those of word "
                               "processors and web pages: write a space");
                at_ += blank;
            } else if (is_at_comment()) {
                first = first.value_or(at_);
                skip_comment();
            } else {
                break;
            }
        }
        if (first)
            fault(*first,
                  "JSON has no comments: remove this one, and what follows it up to the next key or value");
    }

    /// The scalar in `token`, which stands at `offset`.
    json::value scalar(std::string_view token, std::size_t offset)
    {
        json::stream_parser parser;
        boost::system::error_code error;
        auto const used = parser.write_some(token.data(), token.size(), error);
        if (!error && used < token.size())
            error = json::error::extra_data;
        if (!error)
            parser.finish(error);
        if (!error)
            return parser.release();
        fault(offset, !is_utf8(token) ? "this is no UTF-8: save the file as UTF-8"
                      : token.starts_with('"') && has_odd_escape(token)
                          ? R"(a backslash in a string is written twice, as in "C:\\worlds")"
                      : token.starts_with('"')
                          ? concat("this string can't be read (", error.message(), " at ",
                                   line_and_column(text_, offset + used), ")")
                          : concat("this is neither a string in double quotes nor a number, true, false or "
                                   "null (",
                                   error.message(), ")", number_advice(token)));
        return nullptr;
    }

    /// A string in quotes that only look like the double ones of JSON. All of a file are one fault.
    json::value typographic_string()
    {
        auto const begin = at_;
        at_ += typographic(typographic_quotes, at_);
        auto const inside = at_;
        auto const is_quote = [this] { return is_at('"') || typographic(typographic_quotes, at_) > 0; };
        while (!is_at_end() && text_[at_] != '\n' && !is_quote())
            ++at_;
        auto const text = text_.substr(inside, at_ - inside);
        if (!std::exchange(has_odd_quotes_, true))
            fault(begin, "these are typographic quotation marks, as those of word processors and web pages: "
                         "write \" around every string");
        if (is_at_end() || !is_quote()) {
            lost_comma_ = true; // it may be in the string
            return nullptr;
        }
        at_ += is_at('"') ? 1 : typographic(typographic_quotes, at_);
        return json::value(text);
    }

    /// A string in double quotes, or in others, which is a fault.
    json::value string()
    {
        if (typographic(typographic_quotes, at_) > 0)
            return typographic_string();
        auto const begin = at_;
        char const quote = text_[at_++];
        while (!is_at_end() && text_[at_] != quote && text_[at_] != '\n')
            at_ += text_[at_] == '\\' && at_ + 1 < text_.size() && text_[at_ + 1] != '\n' ? 2 : 1;
        if (is_at_end() || text_[at_] == '\n') {
            fault(begin, "this string has no quote at its end");
            lost_comma_ = true; // it may be in the string
            return nullptr;
        }
        ++at_;
        if (quote == '"')
            return scalar(text_.substr(begin, at_ - begin), begin);
        fault(begin, "JSON has double quotes, no single ones");
        return json::value(text_.substr(begin + 1, at_ - begin - 2));
    }

    std::string_view word()
    {
        auto const begin = at_;
        while (!is_at_end() && !is_space(text_[at_]) && !is_structural(text_[at_]) && !is_at_comment() &&
               typographic(typographic_blanks, at_) == 0)
            ++at_;
        return text_.substr(begin, at_ - begin);
    }

    /// A number with a unit, or several, that begins at `begin` and may go on behind what was read; empty: it
    /// is none.
    std::string_view quantity(std::size_t begin)
    {
        for (auto end = at_;; end = at_) {
            while (is_at(' ') || is_at('\t'))
                ++at_;
            bool const is_more = !word().empty() && is_quantity(text_.substr(begin, at_ - begin));
            if (is_more)
                continue;
            at_ = end;
            auto const whole = text_.substr(begin, end - begin);
            return is_quantity(whole) ? whole : std::string_view();
        }
    }

    /// What is neither an object, nor a list, nor a string.
    json::value bare_value()
    {
        auto const begin = at_;
        auto const token = word();
        if (auto const number = quantity(begin); !number.empty()) {
            fault(begin, "a number has no unit");
            json_.faults.back().is_quantity = true;
            return json::value(number);
        }
        auto const* const meant = is_among(yes, token)       ? "true"
                                  : is_among(no, token)      ? "false"
                                  : is_among(nothing, token) ? "null"
                                                             : nullptr;
        if (!meant)
            return scalar(token, begin);
        fault(begin, concat("JSON has ", meant, " in place of ", token));
        return nullptr;
    }

    json::value value(JsonPlace& place, std::size_t depth)
    {
        place.value = at_;
        if ((is_at('{') || is_at('[')) && depth == max_depth) {
            stop(at_, "there are more than 32 objects and lists within each other");
            return nullptr;
        }
        if (is_at('{'))
            return object(place, depth + 1);
        if (is_at('['))
            return list(place, depth + 1);
        if (is_at_string())
            return string();
        if (is_at_end() || is_structural(text_[at_])) {
            stop(at_, "a value is missing here");
            return nullptr;
        }
        return bare_value();
    }

    /// After an entry of what ends with `close`: whether there is another one. `begin` is where it begins.
    bool has_more(char close, std::string_view what, std::size_t begin)
    {
        auto const end = at_;
        bool const lost_comma = std::exchange(lost_comma_, false);
        skip();
        if (broken_)
            return false;
        if (is_at_end()) {
            stop_at_end(what, begin);
            return false;
        }
        if (is_at(close)) {
            ++at_;
            return false;
        }
        if (is_at(',')) {
            auto const comma = at_++;
            skip();
            while (is_at(',')) {
                fault(at_++, "there is a comma too many");
                skip();
            }
            if (is_at(close)) {
                fault(comma, concat("there is a comma after the last entry of the ", what));
                ++at_;
                return false;
            }
            if (is_at_end())
                stop_at_end(what, begin);
            return !broken_;
        }
        if (is_at('}') || is_at(']') || is_at(':')) {
            stop(at_, concat("expected \",\" or \"", std::string(1, close), "\", for the ", what,
                             " that begins at ", line_and_column(text_, begin)));
            return false;
        }
        if (!lost_comma)
            fault(end, "a comma is missing here");
        return !broken_;
    }

    json::value list(JsonPlace& place, std::size_t depth)
    {
        auto const begin = at_++;
        json::array entries;
        skip();
        if (is_at(']')) {
            ++at_;
            return entries;
        }
        if (is_at_end())
            stop_at_end("list", begin);
        bool more = !broken_;
        while (more) {
            auto const entry = place.entries.emplace(place.entries.end());
            entries.push_back(value(*entry, depth));
            more = has_more(']', "list", begin);
        }
        return entries;
    }

    /// The name of a member; none after a fault from which there is no way on.
    std::optional<std::string> name()
    {
        auto const begin = at_;
        if (is_at_string()) {
            auto const text = string();
            return text.is_string() ? std::string(text.get_string()) : std::string();
        }
        if (is_at_end() || is_structural(text_[at_])) {
            stop(at_, "expected a key in double quotes");
            return std::nullopt;
        }
        fault(begin, "a key is in double quotes");
        return std::string(word());
    }

    /// From the colon to the value of a member.
    json::value member(JsonPlace& place, std::size_t depth)
    {
        auto const end = at_;
        place.value = end;
        if (lost_comma_ || broken_) // the value may be in the key
            return nullptr;
        skip();
        place.value = at_;
        if (is_at(':') || is_at('=')) {
            if (is_at('='))
                fault(at_, "there is a \":\" between a key and its value");
            ++at_;
            skip();
        } else if (is_at(',') || is_at('}')) {
            fault(end, "this key has no value");
            place.value = end;
            return nullptr;
        } else {
            fault(end, "a \":\" is missing after the key");
        }
        return value(place, depth);
    }

    json::value object(JsonPlace& place, std::size_t depth)
    {
        auto const begin = at_++;
        json::object members;
        skip();
        if (is_at('}')) {
            ++at_;
            return members;
        }
        if (is_at_end())
            stop_at_end("object", begin);
        bool more = !broken_;
        while (more) {
            JsonPlace inner;
            inner.key = at_;
            auto const key = name();
            if (!key)
                break;
            auto found = member(inner, depth);
            if (auto const first = place.members.find(*key);
                first != place.members.end() && json_.duplicates.size() < max_remarks)
                json_.duplicates.emplace_back(inner.key,
                                              concat("key \"", printable(*key, 60),
                                                     "\" is here for the second time, and counts; "
                                                     "that at ",
                                                     line_and_column(text_, first->second.key), " does not"));
            members[*key] = std::move(found);
            place.members[*key] = std::move(inner);
            more = has_more('}', "object", begin);
        }
        return members;
    }

    std::string_view text_;
    std::size_t at_ = 0;
    bool broken_ = false;
    bool lost_comma_ = false;
    bool has_odd_quotes_ = false; ///< That was told.
    bool has_odd_blanks_ = false;
    PositionedJson json_;
};

} // namespace

PositionedJson read_positioned_json(std::string_view text)
{
    return JsonReader(text).read();
}

std::string TextPlaces::at(std::size_t offset)
{
    if (offset < offset_)
        *this = TextPlaces(text_);
    for (; offset_ < std::min(offset, text_.size()); ++offset_) {
        bool const is_first_byte = (static_cast<unsigned char>(text_[offset_]) & 0xc0) != 0x80;
        column_ = text_[offset_] == '\n' ? 1 : column_ + (is_first_byte ? 1 : 0);
        line_ += text_[offset_] == '\n' ? 1 : 0;
    }
    return concat(std::to_string(line_), ":", std::to_string(column_));
}

std::string line_and_column(std::string_view text, std::size_t offset)
{
    return TextPlaces(text).at(offset);
}

} // namespace webots_cloud::core
