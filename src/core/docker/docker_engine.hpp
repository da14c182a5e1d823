// Which Docker there is, from the output of its commands.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The format for `docker info --format`, which the functions below understand.
inline constexpr std::string_view docker_info_format =
    "Docker {{.ServerVersion}} has {{range $name, $_ := .Runtimes}}{{$name}} {{end}}"
    "with {{range .SecurityOptions}}{{.}} {{end}}";

/// What runs containers: `nvidia` where the daemon has that, otherwise `runc`.
///
/// Nothing: the daemon did not answer, which newer clients report with status 0 and an empty version.
/// Warnings may stand around the answer.
std::optional<std::string> parse_container_runtime(std::string_view info);

/// Whether the operator has taken something from what builds may do, which Docker has no options for in a
/// single build: the engine's list of system calls is another one than Docker's, or its containers have users
/// of their own.
bool confines_builds(std::string_view info);

} // namespace webots_cloud::core
