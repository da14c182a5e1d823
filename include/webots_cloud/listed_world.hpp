// A world that people are shown before they start it.
#pragma once

#include <webots_cloud/export.hpp>

#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

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

    bool operator==(ListedWorld const&) const = default;
};

} // namespace webots_cloud
