#include "lesson.hpp"

#include "core/projects/world_info.hpp"
#include "core/text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t most_languages = 20;
constexpr std::size_t most_lesson_steps = 20;
constexpr std::size_t longest_lesson_title = 100; // as in a list of worlds
constexpr std::size_t longest_lesson_about = 200;
constexpr std::size_t longest_lesson_step = 1000;
constexpr std::size_t longest_language_tag = 35; // RFC 5646, section 4.4.1

/// The empty one is for everybody.
bool is_language_tag(std::string_view tag)
{
    return tag.size() != 1 && tag.size() <= longest_language_tag && std::ranges::all_of(tag, [](char c) {
               return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
           });
}

Failure wrong_lesson(std::string_view what)
{
    return Failure(errc::invalid_argument, std::string(what));
}

} // namespace

json::object by_language(TextInLanguages const& texts)
{
    json::object object;
    for (auto const& [language, text] : texts)
        object[language] = text;
    return object;
}

std::optional<TextInLanguages> texts_in(json::value const* value, std::size_t limit)
{
    TextInLanguages texts;
    if (!value)
        return texts;
    if (auto const* const text = value->if_string()) {
        texts[""] = one_line(*text, limit);
        return texts;
    }
    auto const* const object = value->if_object();
    if (!object || object->size() > most_languages)
        return std::nullopt;
    for (auto const& [language, text] : *object) {
        if (!is_language_tag(language) || !text.is_string())
            return std::nullopt;
        texts[language] = one_line(text.get_string(), limit);
    }
    return texts;
}

std::string lesson_file(std::string_view world)
{
    constexpr std::string_view extension = ".wbt";
    if (world.ends_with(extension))
        world.remove_suffix(extension.size());
    return concat(world, ".lesson.json");
}

result<Lesson> parse_lesson(std::string_view file)
{
    if (file.size() > largest_lesson)
        return wrong_lesson(concat("It is larger than ", std::to_string(largest_lesson), " bytes."));
    boost::system::error_code failed;
    auto const parsed = json::parse({file.data(), file.size()}, failed);
    auto const* const object = failed ? nullptr : parsed.if_object();
    if (!object)
        return wrong_lesson("It is no JSON object.");
    auto title = texts_in(object->if_contains("title"), longest_lesson_title);
    auto about = texts_in(object->if_contains("about"), longest_lesson_about);
    auto const* const steps = object->if_contains("steps");
    if (!title || !about)
        return wrong_lesson(
            "\"title\" and \"about\" must be texts, or objects with a text for each language.");
    if (steps && (!steps->is_array() || steps->get_array().size() > most_lesson_steps))
        return wrong_lesson(
            concat("\"steps\" must be a list of at most ", std::to_string(most_lesson_steps), " texts."));
    Lesson lesson;
    lesson.title = std::move(*title);
    lesson.about = std::move(*about);
    for (auto const& step : steps ? steps->get_array() : json::array()) {
        auto texts = texts_in(&step, longest_lesson_step);
        if (!texts)
            return wrong_lesson(
                "Each of \"steps\" must be a text, or an object with a text for each language.");
        lesson.steps.push_back(std::move(*texts));
    }
    return lesson;
}

std::string lesson_message(Lesson const& lesson)
{
    json::array steps;
    for (auto const& step : lesson.steps)
        steps.push_back(by_language(step));
    json::object const object{{"title", by_language(lesson.title)},
                              {"about", by_language(lesson.about)},
                              {"steps", std::move(steps)}};
    return concat("lesson: ", json::serialize(object));
}

std::string lesson_left_out_message(std::string_view file, Failure const& failure)
{
    return concat("stderr:", printable(file), " is left out: ", failure.detail());
}

} // namespace webots_cloud::core
