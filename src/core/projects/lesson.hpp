// What a lesson says beside its world, in several languages: docs/lessons.md.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/listed_world.hpp>

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// In bytes. In JSON, where each byte takes two at most, it fits into a message of 64 KiB.
inline constexpr std::size_t largest_lesson = 30'000;

struct Lesson
{
    Lesson() = default;

    TextInLanguages title;
    TextInLanguages about; ///< A line for those who choose a world.
    std::vector<TextInLanguages> steps;
};

/// A text, which is for everybody, or an object of texts by language, each in one line of at most `limit`
/// bytes. Null is no text. Nothing: it is something else.
std::optional<TextInLanguages> texts_in(boost::json::value const* value, std::size_t limit);

/// The same as JSON.
boost::json::object by_language(TextInLanguages const& texts);

/// The name of the file beside a world: `worlds/a.lesson.json` of `worlds/a.wbt`.
std::string lesson_file(std::string_view world);

/// Reads the file, which is a project's. What it has beyond the members of `Lesson` is ignored.
///
/// Errors: `invalid_argument`; the detail says in a sentence what is wrong with the file.
result<Lesson> parse_lesson(std::string_view file);

/// `lesson: {"title":{"en":"..."},"about":{"en":"..."},"steps":[{"en":"..."}]}`
std::string lesson_message(Lesson const& lesson);

/// For the console, where a lesson's author sees it.
std::string lesson_left_out_message(std::string_view file, Failure const& failure);

} // namespace webots_cloud::core
