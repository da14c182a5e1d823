// A project that the page of a website asked for.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What `{"init": [...]}` names (protocol section 5): a template among this server's own projects, over which
/// the website lays what its user has changed.
struct WebsiteProject
{
    WebsiteProject() = default;

    std::string origin;  ///< `http(s)://<name>[:<port>]` of the website, in lower case.
    std::string project; ///< A folder of the operator's `projectsDir`; every part of it is a safe name.
    std::string world;   ///< `<file>.wbt`, in the project's folder `worlds`.
    // As the page gave them; for the website alone to judge.
    std::string user1_id; ///< Empty: nobody has logged in, and the website is not asked.
    std::string user1_name;
    std::string user1_authentication;
    std::string user2_id;
    std::string user2_name;
    std::string custom_data;
    /// In which its page shows the simulation: `mjpeg`; `w3d`, `x3d` or empty, in which the page draws.
    std::string mode;
    bool relayed = false;       ///< It comes from a session server, which can ask another machine.
    bool wants_reasons = false; ///< Its page has a text for each code of a refusal.

    /// The website's name without scheme and port: what its key is filed under.
    std::string host() const;

    /// Whether its user may edit controllers: visitors in their copy of the template, and users that can
    /// prove who they are.
    bool may_edit() const noexcept;

    /// `<origin>/<project>/worlds/<world>`: for logs and pages.
    std::string url() const;

    bool operator==(WebsiteProject const&) const = default;
};

/// Takes the elements of an `init` apart: three (origin, project, world) to nine (what the browsers of 2018
/// to 2021 send).
///
/// Errors: `invalid_url`; the detail is what is wrong, without a full stop.
result<WebsiteProject> parse_init(std::vector<std::string> const& elements);

} // namespace webots_cloud
