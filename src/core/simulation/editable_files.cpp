// What a page may do with the programs of its simulation. The limits keep each answer within one message, and
// the memory of a simulation's texts within a few megabytes.
#include "editable_files.hpp"

#include "core/failure_json.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t longest_name = 200;
constexpr std::array<std::string_view, 4> source_endings{".c", ".cpp", ".cc", ".cxx"};
constexpr std::size_t most_scanned = 1 << 20; // bytes of a world: strangers write larger ones

// A person saves every few seconds; what an editor saves by itself may come in a burst.
constexpr Duration between_saves = std::chrono::milliseconds(500);
constexpr int saves_at_once = 20;

std::string file_text(json::object const& object)
{
    return concat("file: ", json::serialize(object));
}

/// Of those that makefiles of Webots look for.
bool is_source(std::string_view file)
{
    return std::any_of(source_endings.begin(), source_endings.end(),
                       [file](std::string_view ending) { return file.ends_with(ending); });
}

/// The names in `controller "NAME"`, wherever they stand.
std::set<std::string, std::less<>> controllers_of(std::string_view world)
{
    constexpr std::string_view field = "controller";
    world = world.substr(0, most_scanned);
    std::set<std::string, std::less<>> names;
    for (auto at = world.find(field); at != std::string_view::npos; at = world.find(field, at)) {
        at += field.size();
        auto const begin = world.find_first_not_of(" \t\r\n", at);
        if (begin == std::string_view::npos || world[begin] != '"')
            continue; // `controllerArgs`, for instance
        auto const end = world.find('"', begin + 1);
        if (end != std::string_view::npos)
            names.emplace(world.substr(begin + 1, end - begin - 1));
    }
    return names;
}

} // namespace

bool is_editable_text(std::string_view text) noexcept
{
    return is_utf8(text) && std::all_of(text.begin(), text.end(), [](char c) {
               auto const byte = static_cast<unsigned char>(c);
               return byte >= 0x20 ? byte != 0x7f : c == '\t' || c == '\n' || c == '\r';
           });
}

bool is_editable_name(std::string_view file)
{
    auto const parts = split(file, '/');
    return parts.size() >= 2 && file.size() <= longest_name &&
           std::all_of(parts.begin(), parts.end(), is_safe_file_name);
}

EditableFiles::EditableFiles(Texts originals, std::string_view world) : used_(controllers_of(world))
{
    for (auto& [name, text] : originals) {
        if (texts_.size() == most_editable)
            break;
        if (!is_editable_name(name) || text.size() > largest_editable || !is_editable_text(text))
            continue;
        auto& file = texts_[name];
        file.text = text;
        file.original = std::move(text);
    }
}

std::string EditableFiles::list_message() const
{
    json::array list;
    for (bool const used : {true, false})
        for (auto const& [name, file] : texts_)
            if (is_used(name) == used)
                list.push_back({{"path", name}, {"changed", file.is_new || file.text != file.original}});
    return concat("files: ", json::serialize(list));
}

result<std::string> EditableFiles::read(std::string_view file, bool original) const
{
    auto const found = texts_.find(file);
    if (found == texts_.end())
        return refused(Refused::no_file, {{"file", printable(file, longest_name)}});
    return original ? found->second.original : found->second.text;
}

bool EditableFiles::is_used(std::string_view file) const
{
    return used_.contains(file.substr(0, file.find('/')));
}

bool EditableFiles::has_folder_of(std::string_view file) const
{
    auto const folder = file.substr(0, file.rfind('/') + 1);
    auto const found = texts_.lower_bound(folder);
    return found != texts_.end() && found->first.starts_with(folder);
}

result<> EditableFiles::may_save(std::string_view file, std::string_view text, TimePoint now)
{
    if (!saves_.take(now, between_saves, saves_at_once))
        return refused(Refused::saved_too_often);
    if (!is_editable_name(file) || !has_folder_of(file))
        return refused(Refused::no_file, {{"file", printable(file, longest_name)}});
    if (text.size() > largest_editable)
        return refused(Refused::program_too_large, {{"max", std::to_string(largest_editable)}});
    if (!is_editable_text(text))
        return refused(Refused::program_no_text);
    if (texts_.size() == most_editable && !texts_.contains(file))
        return refused(Refused::too_many_programs, {{"max", std::to_string(most_editable)}});
    return {};
}

std::vector<std::string> EditableFiles::compiled_controllers() const
{
    std::vector<std::string> controllers;
    for (auto const& [name, file] : texts_) {
        auto const slash = name.find('/');
        auto const controller = name.substr(0, slash);
        bool const is_direct = name.find('/', slash + 1) == std::string::npos;
        if (is_direct && is_source(name) && (controllers.empty() || controllers.back() != controller))
            controllers.push_back(controller);
    }
    return controllers;
}

bool EditableFiles::has_makefile(std::string_view controller) const
{
    return texts_.contains(concat(controller, "/Makefile"));
}

result<> EditableFiles::may_compile(std::string_view controller, TimePoint now)
{
    if (!saves_.take(now, between_saves, saves_at_once))
        return refused(Refused::saved_too_often);
    auto const known = compiled_controllers();
    if (std::find(known.begin(), known.end(), controller) == known.end())
        return refused(Refused::no_compiler, {{"controller", printable(controller, longest_name)}});
    return {};
}

void EditableFiles::saved(std::string file, std::string text)
{
    auto const [place, is_new] = texts_.try_emplace(std::move(file));
    place->second.is_new |= is_new;
    place->second.text = std::move(text);
}

void EditableFiles::restored(std::string_view file)
{
    if (auto const found = texts_.find(file); found != texts_.end())
        found->second.text = found->second.original;
}

std::string file_message(std::string_view file, std::string_view text, bool original)
{
    return file_text({{"path", file}, {original ? "original" : "text", text}});
}

std::string file_saved_message(std::string_view file)
{
    return file_text({{"path", file}, {"saved", true}});
}

std::string file_error_message(std::string_view file, Failure const& failure)
{
    json::object object{{"path", file}};
    add_failure(object, failure);
    return file_text(object);
}

std::string compiles_message(std::vector<std::string> const& controllers)
{
    json::array list;
    for (auto const& controller : controllers)
        list.emplace_back(controller);
    return concat("compiles: ", json::serialize(list));
}

std::string compiled_message(std::string_view controller, std::string_view output, result<> const& outcome)
{
    std::string text;
    for (auto const line : split(output, '\n'))
        text.append(printable(line)).append("\n");
    text.erase(text.find_last_not_of('\n') + 1);
    json::object object{{"controller", controller}, {"output", text}};
    if (!outcome)
        add_failure(object, outcome.error());
    return concat("compiled: ", json::serialize(object));
}

} // namespace webots_cloud::core
