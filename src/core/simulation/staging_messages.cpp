#include "staging_messages.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t longest_staged_url = 2048; // as of the worlds of classes
constexpr std::size_t longest_staged_mode = 16;
constexpr int most_taken = 1'000'000'000; // a connection may last for years

bool read_staging_text(json::object const& object, std::string_view key, std::size_t longest,
                       std::string& text)
{
    auto const* value = object.if_contains(key);
    auto const* found = value ? value->if_string() : nullptr;
    if (!found || found->size() > longest)
        return false;
    text = *found;
    return true;
}

bool read_staging_count(json::object const& object, std::string_view key, int most, int& count)
{
    auto const* value = object.if_contains(key);
    auto const* found = value ? value->if_int64() : nullptr;
    if (!found || *found < 0 || *found > most)
        return false;
    count = static_cast<int>(*found);
    return true;
}

/// A list of wishes or figures. `read_counts` reads what the two differ in.
template<class Entry, class ReadCounts>
std::optional<std::vector<Entry>> read_staging_list(json::value const* value, ReadCounts const& read_counts)
{
    auto const* list = value ? value->if_array() : nullptr;
    if (!list || list->size() > max_staging_wishes)
        return std::nullopt;
    std::vector<Entry> entries;
    for (auto const& each : *list) {
        auto& entry = entries.emplace_back();
        auto const* object = each.if_object();
        if (!object || !read_staging_text(*object, "url", longest_staged_url, entry.url) ||
            !read_staging_text(*object, "mode", longest_staged_mode, entry.mode) ||
            !read_counts(*object, entry))
            return std::nullopt;
    }
    return entries;
}

std::string staging_list_text(std::string_view key, json::array list)
{
    json::object message;
    message[key] = std::move(list);
    return json::serialize(message);
}

} // namespace

std::string stage_message(std::vector<StagingWish> const& wishes)
{
    json::array list;
    for (auto const& wish : wishes)
        list.push_back({{"url", wish.url}, {"mode", wish.mode}, {"count", wish.count}});
    return staging_list_text("stage", std::move(list));
}

std::optional<StageMessage> read_stage_message(json::value const& value)
{
    auto wishes = read_staging_list<StagingWish>(&value, [](auto const& object, StagingWish& wish) {
        return read_staging_count(object, "count", max_staging_count, wish.count);
    });
    if (!wishes)
        return std::nullopt;
    StageMessage message;
    message.wishes = std::move(*wishes);
    return message;
}

std::string staged_message(std::vector<StagedFigure> const& figures)
{
    json::array list;
    for (auto const& figure : figures)
        list.push_back(
            {{"url", figure.url}, {"mode", figure.mode}, {"ready", figure.ready}, {"taken", figure.taken}});
    return staging_list_text("staged", std::move(list));
}

std::optional<std::vector<StagedFigure>> parse_staged_message(std::string_view text)
{
    boost::system::error_code error;
    auto const value = json::parse(text, error);
    auto const* object = error ? nullptr : value.if_object();
    if (!object)
        return std::nullopt;
    return read_staging_list<StagedFigure>(
        object->if_contains("staged"), [](auto const& each, StagedFigure& figure) {
            return read_staging_count(each, "ready", max_staging_count, figure.ready) &&
                   read_staging_count(each, "taken", most_taken, figure.taken);
        });
}

} // namespace webots_cloud::core
