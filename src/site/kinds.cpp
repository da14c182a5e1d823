#include "kinds.hpp"

#include "core/text.hpp"

namespace webots_cloud::site {

using core::concat;

std::string_view word_of(Kind kind) noexcept
{
    return kind == Kind::session ? "session" : kind == Kind::simulation ? "simulation" : "website_host";
}

std::string_view program_of(Kind kind) noexcept
{
    return kind == Kind::session      ? "webots-session-server"
           : kind == Kind::simulation ? "webots-simulation-server"
                                      : "webots-website-host";
}

std::string_view called(Kind kind) noexcept
{
    return kind == Kind::session      ? "session server"
           : kind == Kind::simulation ? "simulation server"
                                      : "website host";
}

std::string config_file(Kind kind, std::string_view name)
{
    return concat("config/", word_of(kind), "/", name, ".json");
}

std::string pid_file(Kind kind)
{
    return concat("log/.", word_of(kind), ".pid");
}

} // namespace webots_cloud::site
