// Decides what is ours in a listing of Docker's, by names and labels with random bits: on a shared machine,
// removing one container too many is worse than leaving one. docker_cleanup.cpp carries it out.
#include "docker_leftovers.hpp"

#include "core/text.hpp"
#include "labels.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <iterator>
#include <optional>

namespace webots_cloud::core {
namespace {

constexpr auto image_age = std::chrono::hours(48);

constexpr int max_looks = 12;
constexpr int empty_looks_at_end = 2; // by then no step of a build that was given up will come any more

/// FNV-1a: the same on every machine and in every version, which std::hash is not.
std::uint32_t digest(std::string_view text)
{
    std::uint32_t value = 2166136261u;
    for (char const c : text)
        value = (value ^ static_cast<unsigned char>(c)) * 16777619u;
    return value;
}

/// `webots-2000-1f3a9c4d-...` is a simulation of `webots-2000-1f3a9c4d`.
bool is_of(std::string_view project, std::string_view identity)
{
    return project.starts_with(identity) && project.substr(identity.size()).starts_with('-');
}

/// Of a project with the service `webots`, compose 1 names the image `<project>_webots`, compose 2
/// `<project>-webots`.
bool is_image_of(std::string_view image, std::string_view project)
{
    auto const rest = image.starts_with(project) ? image.substr(project.size()) : std::string_view();
    return rest.starts_with('_') || rest.starts_with('-');
}

/// A label without its quotes. JSON escapes in it stay escaped: our own labels have none. Nothing: it is not
/// a JSON string.
std::optional<std::string_view> label_of(std::string_view json)
{
    if (json.size() < 2 || !json.starts_with('"') || !json.ends_with('"'))
        return std::nullopt;
    return json.substr(1, json.size() - 2);
}

bool is_build(std::vector<std::string_view> const& fields, std::string_view identity)
{
    return fields.size() == 4 && label_of(fields[1]) == "" && label_of(fields[2]) == identity;
}

/// The build that ran in such a container has failed: nothing will ever use it.
bool is_failed_build(std::vector<std::string_view> const& fields, std::string_view identity)
{
    return is_build(fields, identity) && fields[3].starts_with("Exited (") &&
           !fields[3].starts_with("Exited (0)");
}

/// The lines of a listing as fields. Lines whose first field docker would take for an option are left out.
std::vector<std::vector<std::string_view>> rows_of(std::string_view listing)
{
    std::vector<std::vector<std::string_view>> rows;
    for (auto const line : split(listing, '\n'))
        if (auto fields = split(line, '\t');
            fields.size() >= 2 && !fields[0].empty() && !fields[0].starts_with('-'))
            rows.push_back(std::move(fields));
    return rows;
}

/// Of `2026-11-21 17:25:24 +0000 UTC`.
std::optional<WallTime> parse_time(std::string const& text)
{
    int year = 0;
    unsigned month = 0;
    unsigned day = 0;
    int hour = 0;
    int minute = 0;
    int zone = 0;
    if (std::sscanf(text.c_str(), "%4d-%2u-%2u %2d:%2d:%*d %5d", &year, &month, &day, &hour, &minute,
                    &zone) != 6)
        return std::nullopt;
    std::chrono::year_month_day const date{std::chrono::year(year), std::chrono::month(month),
                                           std::chrono::day(day)};
    if (!date.ok() || year < 1970 || year > 2200) // what WallTime can say
        return std::nullopt;
    auto const offset = std::chrono::hours(zone / 100) + std::chrono::minutes(zone % 100);
    return std::chrono::sys_days(date) + std::chrono::hours(hour) + std::chrono::minutes(minute) - offset;
}

bool is_old(std::string_view created, WallTime now)
{
    auto const time = parse_time(std::string(created));
    return time && now - *time > image_age;
}

} // namespace

std::string docker_identity(std::string_view machine, std::uint16_t port,
                            std::filesystem::path const& instances)
{
    char hash[9];
    std::snprintf(hash, sizeof hash, "%08x", digest(concat(machine, ":", instances.string())));
    return concat("webots-", std::to_string(port), "-", hash);
}

std::vector<LeftoverKind> leftover_kinds()
{
    using Words = std::vector<std::string>;
    std::string const containers(container_format);
    std::string const networks(network_format);
    std::string const volumes(volume_format);
    std::string const images(image_format);
    return {
        LeftoverKind(Words{"ps", "--all", "--format", containers}, leftovers,
                     Words{"rm", "--force", "--volumes"}),
        LeftoverKind(Words{"network", "ls", "--format", networks}, leftovers, Words{"network", "rm"}),
        LeftoverKind(Words{"volume", "ls", "--format", volumes}, leftovers, Words{"volume", "rm", "--force"}),
        LeftoverKind(Words{"images", "--format", images}, named_images,
                     Words{"rmi", "--force", "--no-prune"})};
}

bool BuildWatch::goes_on() const noexcept
{
    return looks_ < max_looks && empty_in_a_row_ < empty_looks_at_end;
}

std::vector<std::string> BuildWatch::look(std::vector<std::string> unstarted)
{
    std::vector<std::string> given_up;
    std::copy_if(unstarted.begin(), unstarted.end(), std::back_inserter(given_up),
                 [this](std::string const& id) {
                     return std::find(before_.begin(), before_.end(), id) != before_.end();
                 });
    ++looks_;
    empty_in_a_row_ = unstarted.empty() ? empty_in_a_row_ + 1 : 0;
    before_ = std::move(unstarted);
    return given_up;
}

std::vector<std::string> leftovers(std::string_view listing, DockerScope const& scope)
{
    std::vector<std::string> found;
    for (auto const& fields : rows_of(listing)) {
        auto const project = label_of(fields[1]);
        bool const wanted =
            project && (scope.project.empty() ? is_of(*project, scope.identity) : *project == scope.project);
        if (wanted || is_failed_build(fields, scope.identity))
            found.emplace_back(fields[0]);
    }
    return found;
}

std::vector<std::string> named_images(std::string_view listing, DockerScope const& scope)
{
    std::vector<std::string> found;
    for (auto const& fields : rows_of(listing))
        if (is_of(fields[0], scope.identity) &&
            (scope.project.empty() || is_image_of(fields[0], scope.project)))
            found.emplace_back(fields[0]);
    return found;
}

std::vector<std::string> unstarted_builds(std::string_view listing, std::string_view identity)
{
    std::vector<std::string> found;
    for (auto const& fields : rows_of(listing))
        if (is_build(fields, identity) && fields[3] == "Created")
            found.emplace_back(fields[0]);
    return found;
}

std::vector<std::string> old_images(std::string_view listing, ImagePolicy const& policy, WallTime now)
{
    std::vector<std::string> found;
    for (auto const& fields : rows_of(listing)) {
        auto const& keep = policy.persistent;
        if (fields.size() == 2 && fields[0].starts_with(concat(policy.repository, ":")) &&
            is_old(fields[1], now) && std::find(keep.begin(), keep.end(), fields[0]) == keep.end())
            found.emplace_back(fields[0]);
    }
    return found;
}

std::vector<std::string> list_builds(std::string_view identity)
{
    return {"images",
            "--filter",
            "dangling=true",
            "--filter",
            concat("label=", server_label, "=", identity),
            "--format",
            std::string(build_format)};
}

std::vector<std::string> old_builds(std::string_view listing, WallTime now)
{
    std::vector<std::string> found;
    for (auto const& fields : rows_of(listing))
        if (fields.size() == 2 && is_old(fields[1], now))
            found.emplace_back(fields[0]);
    return found;
}

} // namespace webots_cloud::core
