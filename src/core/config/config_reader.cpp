#include "config_reader.hpp"

#include "core/text.hpp"

#include <boost/json/serialize.hpp>
#include <boost/json/stream_parser.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t max_key_length = 60;
constexpr std::size_t max_path_length = 1024;
constexpr std::size_t max_unknown = 10; // keys that a failure names

/// "line 3, column 7" of a position in a text.
std::string position(std::string_view text, std::size_t at)
{
    auto const before = text.substr(0, at);
    auto const line = 1 + std::count(before.begin(), before.end(), '\n');
    auto const newline = before.rfind('\n');
    auto const column = newline == std::string_view::npos ? at + 1 : at - newline;
    return concat("line ", std::to_string(line), ", column ", std::to_string(column));
}

std::string describe(json::value const& value)
{
    auto const text = printable(json::serialize(value), 60);
    switch (value.kind()) {
    case json::kind::null:
        return "null";
    case json::kind::string:
        return concat("the string ", text);
    case json::kind::array:
        return concat("the list ", text);
    case json::kind::object:
        return concat("the object ", text);
    case json::kind::bool_:
        return text;
    default:
        return concat("the number ", text);
    }
}

bool is_plain(json::value const& value)
{
    auto const* text = value.if_string();
    return text && is_printable(*text);
}

std::string number_text(double value)
{
    return value == std::floor(value) && std::abs(value) < 1e9 ? std::to_string(static_cast<long>(value))
                                                               : python_float(value);
}

std::string entry_of(std::string_view key, std::size_t number)
{
    return concat("key \"", key, "\", entry ", std::to_string(number), ": ");
}

std::string unknown_key(std::string_view name, std::vector<std::string_view> const& known)
{
    auto sentence = concat("unknown key \"", printable(name, max_key_length), "\" is ignored");
    if (auto const near = nearest(name.substr(0, max_key_length), known); !near.empty())
        sentence += concat("; did you mean \"", near, "\"?");
    return sentence;
}

} // namespace

result<ConfigReader> ConfigReader::parse(std::string_view text, std::filesystem::path const& origin)
{
    ConfigReader reader(printable(origin.string(), max_path_length));
    json::stream_parser parser;
    boost::system::error_code error;
    auto const used = parser.write_some(text.data(), text.size(), error);
    if (!error && used < text.size())
        error = json::error::extra_data;
    if (!error)
        parser.finish(error);
    if (error)
        return Failure(errc::invalid_config,
                       concat(reader.origin_, ": not JSON: ", error.message(), " at ", position(text, used)));
    auto value = parser.release();
    if (!value.is_object())
        return Failure(errc::invalid_config,
                       concat(reader.origin_, ": expected a JSON object { ... }, found ", describe(value)));
    reader.object_ = std::move(value.get_object());
    return reader;
}

void ConfigReader::fail(std::string_view what)
{
    if (!failure_)
        failure_ = Failure(errc::invalid_config, concat(origin_, ": ", place_, what));
}

void ConfigReader::refuse(std::string_view key, std::string_view wanted)
{
    fail(concat("key \"", key, "\": expected ", wanted, ", found ", describe(object_.at(key))));
}

void ConfigReader::refuse_entry(std::string_view key, std::size_t number, json::value const& entry,
                                std::string_view wanted)
{
    fail(concat(entry_of(key, number), "expected ", wanted, ", found ", describe(entry)));
}

void ConfigReader::require(std::string_view key, std::string_view wanted)
{
    misses_key_ = misses_key_ || !failure_;
    fail(concat("key \"", key, "\" is missing: expected ", wanted));
}

json::value const* ConfigReader::find(std::string_view key)
{
    known_.push_back(key);
    return object_.if_contains(key);
}

void ConfigReader::ignore(std::vector<std::string_view> const& keys)
{
    known_.insert(known_.end(), keys.begin(), keys.end());
}

void ConfigReader::read(std::string_view key, std::string& value)
{
    auto const* found = find(key);
    if (found && is_plain(*found))
        value = found->get_string();
    else if (found)
        refuse(key, found->is_string() ? "a string without control characters" : "a string");
}

void ConfigReader::read_text(std::string_view key, std::string& value)
{
    auto const* found = find(key);
    if (found && found->is_string())
        value = found->get_string();
    else if (found)
        refuse(key, "a string");
}

void ConfigReader::read_secret(std::string_view key, std::string& value)
{
    auto const* found = find(key);
    if (found && is_plain(*found))
        value = found->get_string();
    else if (found)
        fail(concat("key \"", key, "\": expected a string without control characters, found something else"));
}

void ConfigReader::read(std::string_view key, bool& value)
{
    auto const* found = find(key);
    if (found && found->is_bool())
        value = found->get_bool();
    else if (found)
        refuse(key, "true or false");
}

void ConfigReader::read(std::string_view key, std::filesystem::path& value)
{
    auto const* found = find(key);
    if (found && is_plain(*found) && !found->get_string().empty())
        value = expand_path(found->get_string());
    else if (found)
        refuse(key, found->is_string() && !is_plain(*found) ? "a path without control characters" : "a path");
}

void ConfigReader::read(std::string_view key, std::vector<std::string>& value)
{
    auto const* found = find(key);
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list ||
        !std::all_of(list->begin(), list->end(), [](json::value const& entry) { return entry.is_string(); }))
        return refuse(key, "a list of strings");
    if (!std::all_of(list->begin(), list->end(), is_plain))
        return refuse(key, "a list of strings without control characters");
    value.clear();
    for (auto const& entry : *list)
        value.emplace_back(entry.get_string());
}

void ConfigReader::read_number(std::string_view key, double& value, double min, double max)
{
    auto const* found = find(key);
    if (!found)
        return;
    boost::system::error_code ignored;
    double const number = found->is_number() ? found->to_number<double>(ignored) : std::nan("");
    if (!(number >= min && number <= max))
        return refuse(key, concat("a number from ", number_text(min), " to ", number_text(max)));
    value = number;
}

void ConfigReader::read_integer(std::string_view key, int& value, int min, int max)
{
    auto const* found = find(key);
    if (!found)
        return;
    boost::system::error_code error;
    auto const number = found->is_number() ? found->to_number<std::int64_t>(error) : 0;
    if (!found->is_number() || error || number < min || number > max)
        return refuse(key, concat("an integer from ", std::to_string(min), " to ", std::to_string(max)));
    value = static_cast<int>(number);
}

void ConfigReader::read_choice(std::string_view key, std::string& value,
                               std::vector<std::string_view> const& choices)
{
    auto const* found = find(key);
    if (!found)
        return;
    if (found->is_string() &&
        std::find(choices.begin(), choices.end(), std::string_view(found->get_string())) != choices.end()) {
        value = found->get_string();
        return;
    }
    std::string wanted = "one of";
    for (auto const choice : choices)
        wanted += concat(wanted.size() > 6 ? ", \"" : " \"", choice, "\"");
    refuse(key, wanted);
}

ConfigReader ConfigReader::entry(std::string_view key, std::size_t number, json::object const& object) const
{
    ConfigReader reader(origin_);
    reader.object_ = object;
    reader.place_ = entry_of(key, number);
    return reader;
}

void ConfigReader::take_over(ConfigReader const& entry)
{
    if (!failure_) {
        failure_ = entry.failure_;
        misses_key_ = entry.misses_key_;
    }
    auto const unknown = entry.unknown();
    unknown_within_.insert(unknown_within_.end(), unknown.begin(), unknown.end());
}

std::optional<Failure> ConfigReader::failure() const
{
    if (!misses_key_)
        return failure_;
    auto sentence = failure_->message(); // the missing key may be there under a wrong name
    auto const others = unknown();
    for (std::size_t i = 0; i < std::min(others.size(), max_unknown); ++i)
        sentence += concat("; ", others[i]);
    if (others.size() > max_unknown)
        sentence += concat("; and ", std::to_string(others.size() - max_unknown), " more unknown keys");
    return Failure(errc::invalid_config, std::move(sentence));
}

std::vector<std::string> ConfigReader::unknown() const
{
    std::vector<std::string> sentences;
    for (auto const& [name, value] : object_)
        if (std::find(known_.begin(), known_.end(), std::string_view(name)) == known_.end())
            sentences.push_back(concat(place_, unknown_key(name, known_)));
    sentences.insert(sentences.end(), unknown_within_.begin(), unknown_within_.end());
    return sentences;
}

std::vector<std::string> ConfigReader::unknown_keys() const
{
    auto sentences = unknown();
    for (auto& sentence : sentences)
        sentence = concat(origin_, ": ", sentence);
    return sentences;
}

std::string expand_path(std::string_view text)
{
    std::string path;
    if (text == "~" || text.starts_with("~/")) {
        char const* const home = std::getenv("HOME");
        path = home ? home : "~";
        text.remove_prefix(1);
    }
    while (!text.empty()) {
        auto const dollar = text.find('$');
        path += text.substr(0, dollar);
        if (dollar == std::string_view::npos)
            break;
        text.remove_prefix(dollar);
        bool const braced = text.starts_with("${") && text.find('}') != std::string_view::npos;
        auto const name_end =
            braced ? text.find('}')
                   : std::min(text.size(), text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                                  "abcdefghijklmnopqrstuvwxyz0123456789_",
                                                                  1));
        auto const name = std::string(text.substr(braced ? 2 : 1, name_end - (braced ? 2 : 1)));
        auto const whole = text.substr(0, name_end + (braced ? 1 : 0));
        char const* const value = name.empty() ? nullptr : std::getenv(name.c_str());
        path += value ? std::string_view(value) : whole;
        text.remove_prefix(whole.size());
    }
    return path;
}

} // namespace webots_cloud::core
