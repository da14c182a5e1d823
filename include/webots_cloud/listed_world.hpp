// A world that people are shown before they start it.
#pragma once

#include <webots_cloud/export.hpp>

#include <functional>
#include <map>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A text by language (`de`, `zh-Hant`); the one whose language is empty is for everybody.
using TextInLanguages = std::map<std::string, std::string, std::less<>>;

/// As a configuration lists it (`worlds`), or as a machine has found it. An empty text: nothing is known.
struct ListedWorld
{
    ListedWorld() = default;
    explicit ListedWorld(std::string address) : url(std::move(address)) {}

    /// The address of the world, as in `start`; in a configuration also of a folder of worlds.
    std::string url;
    std::string title;
    std::string text;  ///< A line about it.
    std::string group; ///< The heading below which it is shown.
    /// Of a world with a lesson: what to show in these languages instead of `title` and `text`.
    TextInLanguages titles;
    TextInLanguages texts;

    bool operator==(ListedWorld const&) const = default;
};

} // namespace webots_cloud
