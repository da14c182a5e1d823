// A configuration is read to its end whatever is wrong with it, so that all faults are told at once, in the
// order of the file. Values are taken by the rows of the tables of keys; what rows can't say is asked
// afterwards (config_rules.cpp and the two parsers).
#include "config_reader.hpp"

#include "core/text.hpp"
#include "written_quantity.hpp"

#include <boost/json/serialize.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t max_key_length = 60;
constexpr std::size_t max_path_length = 1024;
constexpr std::size_t max_lines = 50; // of a failure

/// As `json::serialize`, but for numbers.
std::string json_text(json::value const& value)
{
    std::string text;
    if (auto const* list = value.if_array()) {
        for (auto const& entry : *list)
            text += concat(text.empty() ? "" : ",", json_text(entry));
        return concat("[", text, "]");
    }
    if (auto const* object = value.if_object()) {
        for (auto const& [name, member] : *object)
            text +=
                concat(text.empty() ? "" : ",", json::serialize(json::string(name)), ":", json_text(member));
        return concat("{", text, "}");
    }
    return value.is_double() ? number_text(value.get_double()) : json::serialize(value);
}

std::string describe(json::value const& value)
{
    auto const text = printable(json_text(value), 60);
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

/// What to write instead of a truth value in quotes, or of a number that stands for one; else nothing.
std::string truth_advice(json::value const& found)
{
    constexpr std::array<std::string_view, 5> yes{"true", "yes", "on", "1", "y"};
    constexpr std::array<std::string_view, 5> no{"false", "no", "off", "0", "n"};
    auto const* text = found.if_string();
    auto const word = text ? lower_case(trim(*text)) : found.is_number() ? json_text(found) : std::string();
    bool const is_yes = std::ranges::find(yes, word) != yes.end();
    if (!is_yes && std::ranges::find(no, word) == no.end())
        return {};
    return concat(": write ", is_yes ? "true" : "false", text ? ", without quotes" : "");
}

bool is_plain(json::value const& value)
{
    auto const* text = value.if_string();
    return text && is_printable(*text);
}

std::string entry_of(std::string_view key, std::size_t number)
{
    return concat("key \"", key, "\", entry ", std::to_string(number), ": ");
}

/// Where a place that an unreadable part of the file may lack.
JsonPlace const& nowhere()
{
    static JsonPlace const place;
    return place;
}

} // namespace

std::string list_advice(json::value const& found)
{
    constexpr std::size_t longest = 60;
    bool const is_short = found.is_string() && found.get_string().size() <= longest;
    return is_short ? concat(": write [", json_text(found), "]") : std::string();
}

std::string number_text(double value)
{
    constexpr double exact = 9'007'199'254'740'992; // 2^53
    return value == std::floor(value) && std::abs(value) < exact
               ? std::to_string(static_cast<long long>(value))
               : python_float(value);
}

result<ConfigReader> ConfigReader::parse(std::string_view text, std::filesystem::path const& origin,
                                         std::span<ConfigTopic const> topics, OtherServer const& other)
{
    ConfigReader reader;
    reader.origin_ = printable(origin.string(), max_path_length);
    reader.text_ = std::make_shared<std::string const>(text);
    reader.json_ = std::make_shared<PositionedJson const>(read_positioned_json(text));
    reader.place_ = &reader.json_->place;
    reader.advice_ = std::make_shared<std::map<std::size_t, std::string>>();
    reader.other_ = other;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys)
            reader.keys_.push_back(&key);
    auto const& value = reader.json_->value;
    if (auto const* object = value.if_object())
        reader.object_ = *object;
    else if (reader.json_->faults.empty())
        reader.fail(reader.place_->value, concat("expected a JSON object { ... }, found ", describe(value)));
    if (!value.is_object())
        return *reader.failure();
    return reader;
}

std::string ConfigReader::line(Remark const& remark, TextPlaces& places) const
{
    return concat(origin_, ":", places.at(remark.offset), ": ", remark.text);
}

ConfigKey const& ConfigReader::described(std::string_view key) const
{
    for (auto const* candidate : keys_)
        if (candidate->name == key || (!key.empty() && candidate->alias == key))
            return *candidate;
    throw std::logic_error(concat("no table has the key ", key));
}

JsonPlace const& ConfigReader::place_of(std::string_view key) const
{
    auto const found = place_->members.find(key);
    return found == place_->members.end() ? nowhere() : found->second;
}

void ConfigReader::fail(std::size_t offset, std::string_view what)
{
    auto const is_there = [offset](auto const& remark) { return remark.offset == offset; };
    if (std::ranges::none_of(wrong_, is_there) && std::ranges::none_of(json_->faults, is_there))
        wrong_.push_back({offset, concat(context_, what)});
}

void ConfigReader::refuse(std::string_view key, std::string_view wanted, std::string_view advice)
{
    auto const found =
        described(key).value.type == KeyType::secret ? "something else" : describe(object_.at(key));
    fail(place_of(key).value, concat("key \"", key, "\": expected ", wanted, ", found ", found, advice));
}

void ConfigReader::warn(std::string_view key, std::string_view sentence)
{
    odd_.push_back({place_of(key).value, concat(context_, "key \"", key, "\": ", sentence)});
}

void ConfigReader::warn_entry(std::string_view key, std::size_t number, std::string_view sentence)
{
    auto const& entries = place_of(key).entries;
    odd_.push_back({number <= entries.size() ? entries[number - 1].value : place_of(key).value,
                    concat(context_, entry_of(key, number), sentence)});
}

void ConfigReader::refuse_entry(std::string_view key, std::size_t number, json::value const& entry,
                                std::string_view wanted, std::string_view advice)
{
    auto const& entries = place_of(key).entries;
    fail(number <= entries.size() ? entries[number - 1].value : place_of(key).value,
         concat(entry_of(key, number), "expected ", wanted, ", found ", describe(entry), advice));
}

void ConfigReader::require(std::string_view key, std::string_view wanted)
{
    if (json_->is_complete)
        missing_.push_back(
            {place_->value, concat(context_, "key \"", key, "\" is missing: expected ", wanted)});
}

json::value const* ConfigReader::find(std::string_view key)
{
    (void)described(key);
    read_.push_back(key);
    return object_.if_contains(key);
}

json::value const* ConfigReader::find(std::string_view key, std::initializer_list<KeyType> types)
{
    if (std::ranges::find(types, described(key).value.type) == types.end())
        throw std::logic_error(concat("the table has another type for ", key));
    return find(key);
}

void ConfigReader::read(std::string_view key, std::string& value)
{
    auto const* found = find(key, {KeyType::text, KeyType::secret});
    if (found && is_plain(*found))
        value = found->get_string();
    else if (found)
        refuse(key, found->is_string() || described(key).value.type == KeyType::secret
                        ? "a string without control characters"
                        : "a string");
}

void ConfigReader::read_text(std::string_view key, std::string& value)
{
    auto const* found = find(key, {KeyType::text});
    if (found && found->is_string())
        value = found->get_string();
    else if (found)
        refuse(key, "a string");
}

void ConfigReader::read(std::string_view key, bool& value)
{
    auto const* found = find(key, {KeyType::boolean});
    if (found && found->is_bool())
        value = found->get_bool();
    else if (found)
        refuse(key, "true or false", truth_advice(*found));
}

void ConfigReader::read(std::string_view key, std::filesystem::path& value)
{
    auto const* found = find(key, {KeyType::path});
    if (found && is_plain(*found) && !found->get_string().empty())
        value = expand_path(found->get_string());
    else if (found)
        refuse(key, found->is_string() && !is_plain(*found) ? "a path without control characters" : "a path");
}

void ConfigReader::read(std::string_view key, std::vector<std::string>& value)
{
    auto const* found = find(key, {KeyType::texts, KeyType::text_or_list});
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list ||
        !std::all_of(list->begin(), list->end(), [](json::value const& entry) { return entry.is_string(); }))
        return refuse(key, "a list of strings", list_advice(*found));
    if (!std::all_of(list->begin(), list->end(), is_plain))
        return refuse(key, "a list of strings without control characters");
    value.clear();
    for (auto const& entry : *list)
        value.emplace_back(entry.get_string());
}

void ConfigReader::refuse_number(ConfigKey const& key, json::value const& found, std::string_view kind,
                                 double max)
{
    auto const range = concat(key.least > 0 ? "0, or " : "", kind, " from ",
                              number_text(key.least > 0 ? key.least : key.min), " to ", number_text(max),
                              key.unit.empty() ? "" : concat(" (", key.unit, ")"));
    auto const offset = place_of(key.name).value;
    auto const* const text = found.if_string();
    bool const is_bare = std::ranges::any_of(
        json_->faults, [offset](auto const& fault) { return fault.is_quantity && fault.offset == offset; });
    auto const advice =
        text ? number_advice(*text, key, is_bare ? Quotes::none : Quotes::around) : std::string();
    if (is_bare)
        advice_->emplace(offset, advice.empty() ? concat(", and \"", key.name, "\" is ", range) : advice);
    fail(offset, concat("key \"", key.name, "\": expected ", range, ", found ", describe(found), advice));
}

void ConfigReader::read_number(std::string_view key, double& value)
{
    auto const* found = find(key, {KeyType::number});
    if (!found)
        return;
    auto const& wanted = described(key);
    boost::system::error_code ignored;
    double const number = found->is_number() ? found->to_number<double>(ignored) : std::nan("");
    bool const is_in_gap = number > 0 && number < wanted.least;
    if (!(number >= wanted.min && number <= wanted.max) || is_in_gap)
        return refuse_number(wanted, *found, "a number", wanted.max);
    value = number;
}

void ConfigReader::read_integer(std::string_view key, int& value, std::optional<int> highest)
{
    auto const* found = find(key, {KeyType::integer});
    if (!found)
        return;
    auto const& wanted = described(key);
    auto const max = highest ? *highest : static_cast<int>(wanted.max);
    boost::system::error_code error;
    auto const number = found->is_number() ? found->to_number<std::int64_t>(error) : 0;
    if (!found->is_number() || error || number < static_cast<int>(wanted.min) || number > max)
        return refuse_number(wanted, *found, "an integer", max);
    value = static_cast<int>(number);
}

void ConfigReader::read_choice(std::string_view key, std::string& value)
{
    auto const* found = find(key, {KeyType::choice});
    if (!found)
        return;
    auto const choices = described(key).choices;
    if (found->is_string() &&
        std::ranges::find(choices, std::string_view(found->get_string())) != choices.end()) {
        value = found->get_string();
        return;
    }
    refuse(key, one_of(choices));
}

void ConfigReader::read_members(void const* tag, void* owner)
{
    for (auto const* key : keys_) {
        if (key->value.owner && key->value.owner != tag)
            throw std::logic_error(concat("another struct has the key ", key->name));
        if (key->value.read)
            key->value.read(*this, *key, owner);
    }
}

ConfigReader ConfigReader::entry(std::string_view key, std::size_t number, json::object const& object) const
{
    auto const& entries = place_of(key).entries;
    return part(key, object, number <= entries.size() ? entries[number - 1] : nowhere(),
                entry_of(key, number));
}

ConfigReader ConfigReader::inside(std::string_view key, json::object const& object) const
{
    return part(key, object, place_of(key), concat("key \"", key, "\": "));
}

ConfigReader ConfigReader::part(std::string_view key, json::object const& object, JsonPlace const& place,
                                std::string context) const
{
    ConfigReader reader;
    reader.json_ = json_;
    reader.text_ = text_;
    reader.advice_ = advice_;
    reader.origin_ = origin_;
    reader.object_ = object;
    reader.context_ = concat(context_, context);
    reader.place_ = &place;
    for (auto const& inner : described(key).keys)
        reader.keys_.push_back(&inner);
    return reader;
}

void ConfigReader::take_over(ConfigReader const& entry)
{
    entry.check_all_are_read();
    wrong_.insert(wrong_.end(), entry.wrong_.begin(), entry.wrong_.end());
    missing_.insert(missing_.end(), entry.missing_.begin(), entry.missing_.end());
    odd_.insert(odd_.end(), entry.odd_.begin(), entry.odd_.end());
    auto const unknown = entry.unknown();
    unknown_within_.insert(unknown_within_.end(), unknown.begin(), unknown.end());
}

void ConfigReader::check_all_are_read() const
{
    for (auto const* key : keys_)
        for (auto const name : {key->name, key->alias})
            if (!name.empty() && std::ranges::find(read_, name) == read_.end())
                throw std::logic_error(concat("nobody reads the key ", name));
}

bool ConfigReader::is_refused(std::string_view key) const
{
    auto const offset = place_of(key).value;
    auto const is_there = [offset](auto const& remark) { return remark.offset == offset; };
    return has(key) &&
           (std::ranges::any_of(wrong_, is_there) || std::ranges::any_of(json_->faults, is_there));
}

std::optional<Failure> ConfigReader::failure() const
{
    std::vector<Remark> all;
    auto const add_in_order = [&all](std::vector<Remark> remarks) {
        std::ranges::stable_sort(remarks, {}, &Remark::offset);
        all.insert(all.end(), remarks.begin(), remarks.end());
    };
    for (auto const& fault : json_->faults) {
        auto const advice = advice_->find(fault.offset);
        all.push_back(
            {fault.offset, concat("not JSON: ", fault.text,
                                  fault.is_quantity && advice != advice_->end() ? advice->second : "")});
    }
    add_in_order(wrong_);
    add_in_order(missing_);
    if (all.empty())
        return std::nullopt;
    add_in_order(ignored());
    TextPlaces places(*text_);
    std::string lines;
    for (std::size_t i = 0; i < std::min(all.size(), max_lines); ++i)
        lines += concat(i == 0 ? "" : "\n", line(all[i], places));
    if (all.size() > max_lines)
        lines += concat("\n", origin_, ": and ", std::to_string(all.size() - max_lines), " more");
    return Failure(errc::invalid_config, std::move(lines));
}

std::vector<ConfigReader::Remark> ConfigReader::unknown() const
{
    std::vector<std::string_view> known;
    for (auto const* key : keys_)
        for (auto const name : {key->name, key->alias})
            if (!name.empty())
                known.push_back(name);
    std::vector<Remark> remarks;
    for (auto const& [name, value] : object_) {
        std::string_view const key = name;
        if (std::ranges::find(known, key) != known.end())
            continue;
        auto sentence = concat(context_, "unknown key \"", printable(key, max_key_length), "\" is ignored");
        if (find_key(other_.topics, key))
            sentence += concat(": it belongs into the configuration of ", other_.name);
        else if (auto const near = nearest(key.substr(0, max_key_length), known); !near.empty())
            sentence += concat("; did you mean \"", near, "\"?");
        remarks.push_back({place_of(key).key, std::move(sentence)});
    }
    remarks.insert(remarks.end(), unknown_within_.begin(), unknown_within_.end());
    return remarks;
}

std::vector<ConfigReader::Remark> ConfigReader::ignored() const
{
    auto remarks = unknown();
    for (auto const& duplicate : json_->duplicates)
        remarks.push_back({duplicate.offset, duplicate.text});
    return remarks;
}

std::vector<std::string> ConfigReader::warnings() const
{
    check_all_are_read();
    auto remarks = ignored();
    remarks.insert(remarks.end(), odd_.begin(), odd_.end());
    std::ranges::stable_sort(remarks, {}, &Remark::offset);
    TextPlaces places(*text_);
    std::vector<std::string> sentences;
    for (auto const& remark : remarks)
        sentences.push_back(line(remark, places));
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
