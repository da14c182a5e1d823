// Reads and writes the lists, and makes titles where a world says none. Other machines are strangers: of
// their lists only what may be listed is taken.
#include "world_list.hpp"

#include "core/failure_json.hpp"
#include "core/projects/lesson.hpp"
#include "core/projects/world_info.hpp"
#include "core/text.hpp"

#include <webots_cloud/load_report.hpp>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>
#include <tuple>
#include <utility>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t longest_address = 2048; // as `parse_world_url`
constexpr std::size_t longest_title = 100;
constexpr std::size_t longest_text = 200;
constexpr std::size_t longest_error = 500;
constexpr std::size_t most_values = 16;
constexpr std::size_t key_size = 16;
constexpr std::size_t most_translated = std::size_t{128} << 10; // bytes of all worlds' texts in languages

std::string_view text_of(json::object const& object, std::string_view key)
{
    auto const* const value = object.if_contains(key);
    auto const* const text = value ? value->if_string() : nullptr;
    return text ? std::string_view(*text) : std::string_view();
}

/// A machine lists worlds of its forges. Addresses of other servers (`wss://`) are for people to type.
bool may_be_listed(std::string_view url)
{
    auto const scheme = lower_case(url.substr(0, url.find(':')));
    return is_world_link(url) && url.size() <= longest_address && is_printable(url) && scheme != "ws" &&
           scheme != "wss" && url.find_first_of(" \"<>\\^`{|}") == std::string_view::npos;
}

/// What an operator has not said of a world, a machine may know.
void complete(ListedWorld& world, std::span<ListedWorld const> found)
{
    auto const known = std::ranges::find(found, world.url, &ListedWorld::url);
    if (known != found.end() && world.title.empty())
        std::tie(world.title, world.titles) = std::tie(known->title, known->titles);
    if (known != found.end() && world.text.empty())
        std::tie(world.text, world.texts) = std::tie(known->text, known->texts);
    if (world.title.empty())
        world.title = title_of_address(world.url);
}

/// Each address once, as many as there may be.
class Gallery
{
public:
    explicit Gallery(std::span<ListedWorld const> found) : found_(found) {}

    void add(ListedWorld world)
    {
        if (worlds_.size() == max_listed_worlds ||
            std::ranges::find(worlds_, world.url, &ListedWorld::url) != worlds_.end())
            return;
        complete(world, found_);
        worlds_.push_back(std::move(world));
    }

    /// The worlds below an address; of all, below an empty one.
    void add_found(std::string_view folder, std::string const& group)
    {
        while (folder.ends_with('/'))
            folder.remove_suffix(1);
        for (auto world : found_) {
            bool const is_inside = folder.empty() || (world.url.starts_with(folder) &&
                                                      world.url.substr(folder.size()).starts_with('/'));
            if (!is_inside)
                continue;
            world.group = group;
            add(std::move(world));
        }
    }

    std::vector<ListedWorld> take() { return std::move(worlds_); }

private:
    std::span<ListedWorld const> found_;
    std::vector<ListedWorld> worlds_;
};

} // namespace

bool is_world_link(std::string_view url) noexcept
{
    return url.find(':') != std::string_view::npos && url.ends_with(".wbt");
}

std::string title_of_address(std::string_view url)
{
    constexpr std::string_view extension = ".wbt";
    auto name = url.substr(url.rfind('/') + 1);
    if (name.ends_with(extension))
        name.remove_suffix(extension.size());
    std::string title;
    if (!percent_decode(name, title) || !is_utf8(title))
        title = name;
    std::ranges::replace(title, '_', ' ');
    if (!title.empty() && title.front() >= 'a' && title.front() <= 'z')
        title.front() = static_cast<char>(title.front() - 'a' + 'A');
    return one_line(title, longest_title);
}

std::string picture_key(std::string_view url)
{
    constexpr std::string_view digits = "0123456789abcdef";
    auto rest = world_key(url, {}).world;
    std::string key(key_size, '0');
    for (auto digit = key.rbegin(); digit != key.rend(); ++digit, rest /= digits.size())
        *digit = digits[rest % digits.size()];
    return key;
}

namespace {

json::array listed(std::span<ListedWorld const> worlds)
{
    json::array list;
    std::size_t translated = 0;
    for (auto const& world : worlds) {
        auto& entry = list.emplace_back(json::object{{"url", world.url}}).get_object();
        for (auto const& [key, text] : {std::pair<std::string_view, std::string const&>("title", world.title),
                                        {"text", world.text},
                                        {"group", world.group}})
            if (!text.empty())
                entry[key] = text;
        for (auto const& [key, texts] :
             {std::pair<std::string_view, TextInLanguages const&>("titles", world.titles),
              {"texts", world.texts}}) {
            for (auto const& [language, text] : texts)
                translated += language.size() + text.size();
            if (!texts.empty() && translated <= most_translated)
                entry[key] = by_language(texts);
        }
    }
    return list;
}

} // namespace

std::string world_list_json(std::span<ListedWorld const> worlds, std::span<std::string const> pictures)
{
    json::object answer{{"worlds", listed(worlds)}};
    if (!pictures.empty())
        answer["pictures"] = json::array(pictures.begin(), pictures.end());
    return json::serialize(answer);
}

std::string gallery_json(std::span<ListedWorld const> worlds, std::span<std::string const> pictures,
                         json::object site)
{
    auto list = listed(worlds);
    for (std::size_t i = 0; i < worlds.size(); ++i)
        if (auto const key = picture_key(worlds[i].url); std::ranges::find(pictures, key) != pictures.end())
            list[i].get_object()["picture"] = concat("picture/", key);
    json::object answer{{"worlds", std::move(list)}};
    if (!site.empty())
        answer["site"] = std::move(site);
    return json::serialize(answer);
}

namespace {

/// A list in an object. Nothing: there is none.
std::optional<json::array> list_in(std::string_view text, std::string_view key)
{
    boost::system::error_code failed;
    auto const parsed = json::parse(text, failed);
    auto const* const object = failed ? nullptr : parsed.if_object();
    auto const* const member = object ? object->if_contains(key) : nullptr;
    auto const* const list = member ? member->if_array() : nullptr;
    return list ? std::optional(*list) : std::nullopt;
}

} // namespace

std::vector<std::string> parse_picture_keys(std::string_view text)
{
    std::vector<std::string> keys;
    for (auto const& entry : list_in(text, "pictures").value_or(json::array())) {
        auto const* const key = entry.if_string();
        bool const is_key = key && key->size() == key_size &&
                            key->find_first_not_of("0123456789abcdef") == json::string::npos;
        if (is_key && keys.size() < max_listed_worlds)
            keys.emplace_back(*key);
    }
    return keys;
}

std::string world_list_error(Failure const& why)
{
    json::object answer;
    add_failure(answer, why);
    return json::serialize(answer);
}

std::optional<std::string> parse_world_list_error(std::string_view text)
{
    boost::system::error_code failed;
    auto const parsed = json::parse(text, failed);
    auto const* const object = failed ? nullptr : parsed.if_object();
    if (!object || text_of(*object, "error").empty())
        return std::nullopt;
    json::object answer{{"error", printable(text_of(*object, "error"), longest_error)}};
    if (auto const code = text_of(*object, "code"); !code.empty())
        answer["code"] = printable(code, longest_title);
    json::object values;
    auto const* const told = object->if_contains("values");
    for (auto const& [name, value] : told && told->is_object() ? told->get_object() : json::object())
        if (auto const* const word = value.if_string(); word && values.size() < most_values)
            values[name] = printable(*word, longest_error);
    if (!values.empty())
        answer["values"] = std::move(values);
    return json::serialize(answer);
}

std::optional<std::vector<ListedWorld>> parse_world_list(std::string_view text)
{
    auto const list = list_in(text, "worlds");
    if (!list)
        return std::nullopt;
    std::vector<ListedWorld> worlds;
    for (auto const& entry : *list) {
        auto const* const described = entry.if_object();
        if (!described || worlds.size() == max_listed_worlds || !may_be_listed(text_of(*described, "url")))
            continue;
        auto& world = worlds.emplace_back(std::string(text_of(*described, "url")));
        world.title = one_line(text_of(*described, "title"), longest_title);
        world.text = one_line(text_of(*described, "text"), longest_text);
        world.titles = texts_in(described->if_contains("titles"), longest_title).value_or(TextInLanguages());
        world.texts = texts_in(described->if_contains("texts"), longest_text).value_or(TextInLanguages());
    }
    return worlds;
}

std::vector<ListedWorld> gallery_worlds(std::optional<std::vector<ListedWorld>> const& configured,
                                        std::string_view viewer_url, std::span<ListedWorld const> found)
{
    Gallery gallery(found);
    if (!configured) {
        if (is_world_link(viewer_url))
            gallery.add(ListedWorld(std::string(viewer_url)));
        gallery.add_found({}, {});
        return gallery.take();
    }
    for (auto const& entry : *configured) {
        if (is_world_link(entry.url))
            gallery.add(entry);
        else
            gallery.add_found(entry.url, entry.group);
    }
    return gallery.take();
}

} // namespace webots_cloud::core
