// A message for the administrator, before anyone decides how it travels.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <string>
#include <utility>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A message for the administrator.
struct Notice
{
    Notice() = default;
    Notice(std::string subject, std::string text) : subject(std::move(subject)), text(std::move(text)) {}

    std::string subject; ///< One line.
    std::string text;    ///< Lines end with `\n`, the last one too.
    std::string summary; ///< The same in one line, for logs and short messages.
    WallTime written;    ///< When it was written: every attempt to deliver it says the same time.
    /// Letters, digits, dots and hyphens that no other notice has, and the same at every attempt: a mail
    /// system that gets a notice twice can tell. May be empty.
    std::string id;

    bool operator==(Notice const&) const = default;
};

} // namespace webots_cloud
