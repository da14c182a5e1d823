// The table of refusals: a sentence is changed here. What quotes it: docs/recipes.md, "A failure".
#include "refusals.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace webots_cloud::core {
namespace {

using R = Refused;

constexpr auto everywhere = StartRefusal::everywhere;
constexpr auto here = StartRefusal::here;
constexpr auto full = StartRefusal::full;
constexpr bool pythons = true;

// clang-format off
constexpr std::array<RefusalRow, static_cast<std::size_t>(R::count)> table{{
    {R::server_drains, "server-stops", errc::refused, here,
     "This simulation server is about to stop. Please start again on another one."},
    {R::server_stops, "server-stops", errc::unavailable, here,
     "This simulation server is being stopped. Please start again."},
    {R::no_place, "full", errc::unavailable, full,
     "Too many open connections (>{max}): this simulation server is full. Please try again later."},
    {R::client_has_enough, "your-network", errc::refused, here,
     "Your network has {count} simulations on this server already, and may not have more. Please end one of them, or "
     "try again later. Its operator can raise \"simulationsPerAddress\"."},
    {R::world_has_enough, "world-limit", errc::unavailable, full,
     "This world runs here as often as this server allows ({max}). Please try again later."},
    {R::no_ticket, "own-page", errc::refused, here,
     "Simulations of this site start through its session server: please start again from the site's own page."},
    {R::unknown_ticket, "server-fault", errc::refused, here,
     "This machine does not know the ticket of its session server: its operator finds the reason in the log."},
    {R::expired_ticket, "again", errc::refused, here,
     "The ticket for this simulation has expired: please start again. If that happens every time, the clocks of this "
     "site's machines differ."},
    {R::used_ticket, "again", errc::refused, here,
     "The ticket for this simulation has been used: please start again."},
    {R::too_many_tickets, "too-fast", errc::refused, here,
     "Too many simulations were started in the last minute: please try again in a minute."},
    {R::no_way_through_gateway, "server-fault", errc::refused, here,
     "This machine is not set up for the gateway of its session server: its operator finds the reason in the log."},

    {R::foreign_site, "other-site", errc::invalid_url, everywhere,
     "Unsupported URL protocol: {url}. The URL must start with {sites}"},
    {R::address_too_long, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: longer than 2048 characters"},
    {R::address_malformed, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: malformed percent-encoding"},
    {R::address_too_short, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL", pythons},
    {R::address_of_folder, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: it leads to a folder. Add the name of a world file to it, as in "
     "worlds/my_world.wbt"},
    {R::address_without_folder, "no-list", errc::invalid_url, everywhere,
     "This address leads to no repository, and to no folder of one. Copy it from the page that lists the files."},
    {R::address_without_blob, "no-address", errc::invalid_url, everywhere,
     "Missing blob in Webots simulation URL, founds {found}", pythons},
    {R::address_without_worlds, "no-address", errc::invalid_url, everywhere,
     "Missing worlds folder in Webots simulation URL", pythons},
    {R::address_not_in_worlds, "no-address", errc::invalid_url, everywhere,
     "Missing worlds folder in Webots simulation URL: worlds have to be in a folder \"worlds\", as in worlds/{world}"},
    {R::address_without_world, "no-address", errc::invalid_url, everywhere,
     "Missing world file in Webots simulation URL", pythons},
    {R::address_owner, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: \"{part}\" is no name of an owner"},
    {R::address_repository, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: \"{part}\" is no name of a repository"},
    {R::address_name, "no-address", errc::invalid_url, everywhere,
     "Wrong Webots simulation URL: \"{part}\" is no name of a branch, folder or file"},
    {R::outside_allowed, "not-allowed", errc::refused, here,
     "Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\".", pythons},
    {R::outside_sandbox, "not-allowed", errc::refused, here,
     "Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\". Its operator can "
     "accept them in its sandbox, with {needed}."},
    {R::not_shared, "not-allowed", errc::refused, here,
     "This simulation server is not configured to share idle time.", pythons},
    {R::too_busy, "busy", errc::refused, here,
     "Cannot share idle time when current load is above threshold: {load}.", pythons},
    {R::blocked, "not-allowed", errc::refused, here,
     "Cannot run simulation from blocked repository: {url}", pythons},

    {R::no_repository, "no-repository", errc::not_found, everywhere,
     "Repository {name} does not exist or is private."},
    {R::no_commit, "not-there", errc::not_found, everywhere,
     "Repository {name} has no such commit."},
    {R::no_ref, "not-there", errc::not_found, everywhere,
     "Repository {name} has no branch or tag \"{ref}\"."},
    {R::no_folder, "not-there", errc::not_found, everywhere,
     "Repository {name} has no folder \"{folder}\"."},
    {R::not_a_commit, "not-there", errc::not_found, everywhere,
     "Repository {name} has no commit at \"{ref}\", but something else."},
    {R::commit_on_no_branch, "not-there", errc::not_found, everywhere,
     "Commit {commit} of {name} is on no branch and under no tag: name a branch or tag, or have one made for it."},
    {R::commit_not_newest, "not-there", errc::not_found, everywhere,
     "Commit {commit} of {name} is not the newest one of any branch or tag, and the git server can't tell whether it is "
     "an older one: name a branch or tag, or have one made for it."},
    {R::history_too_large, "not-there", errc::too_large, everywhere,
     "Commit {commit} of {name} is not looked for, as the history is too large: name a branch or tag, or have one made "
     "for it."},
    {R::too_many_refs, "bad-project", errc::too_large, everywhere,
     "Repository {name} has too many branches that begin alike."},
    {R::sha256_repository, "bad-project", errc::refused, everywhere,
     "Repository {name} has SHA-256 object names, which are not supported."},
    {R::site_unreachable, "site-unreachable", errc::unreachable, here,
     "{site} can't be reached: {why}. Try again later."},
    {R::site_fault, "site-fault", errc::protocol_error, everywhere,
     "{site}: {why}."},
    {R::large_files, "bad-project", errc::refused, everywhere,
     "The large files (Git LFS) of {repository} can't be fetched: {why}. {advice}"},
    {R::no_plain_project, "no-project", errc::not_found, everywhere,
     "There is no project {name} with a folder \"worlds\" on this server."},
    {R::no_template, "no-project", errc::not_found, everywhere,
     "There is no project \"{name}\" on this server."},
    {R::no_websites, "website", errc::refused, here,
     "This simulation server runs no projects of websites."},
    {R::no_website_key, "server-fault", errc::refused, here,
     "This simulation server has no key for {host}: its operator must file one before users of that website can start "
     "simulations."},
    {R::unreadable_website_key, "server-fault", errc::refused, here,
     "Unknown host: {host}. This server can't read the key that it has for it. "
     "If its folder of keys was replaced while it ran, its operator can restart it."},
    {R::website_refuses, "website", errc::refused, here,
     "Failed to download project: {words}"},
    {R::website_without_reason, "website", errc::refused, here,
     "Failed to download project: the website gives no reason."},
    {R::website_status, "website", errc::protocol_error, everywhere,
     "Failed to download project: {host} answered with status {status}."},
    {R::website_unreachable, "website", errc::unreachable, here,
     "Failed to download project from {host}: {words}."},

    {R::project_too_large, "bad-project", errc::too_large, everywhere,
     "The project is larger than {max} MB."},
    {R::file_too_large, "bad-project", errc::too_large, everywhere,
     "{file} of the project is larger than 64 MB."},
    {R::too_many_files, "bad-project", errc::too_large, everywhere,
     "The project has more than {max} files."},
    {R::path_too_long, "bad-project", errc::too_large, everywhere,
     "The project has a file whose path is too long."},
    {R::too_many_long_paths, "bad-project", errc::too_large, everywhere,
     "The project has too many files with long paths."},
    {R::folders_too_deep, "bad-project", errc::too_large, everywhere,
     "The project has folders that are nested too deeply."},
    {R::forbidden_name, "bad-project", errc::protocol_error, everywhere,
     "The project has a file with a forbidden name: \"{name}\"."},
    {R::forbidden_folder, "bad-project", errc::invalid_url, everywhere,
     "The folder \"{name}\" has a forbidden name."},
    {R::impossible_folder, "bad-project", errc::invalid_url, everywhere,
     "\"{name}\" can't be a folder."},
    {R::bad_zip, "bad-project", errc::protocol_error, everywhere,
     "Bad ZIP file: {words}."},
    {R::zip_with_link, "bad-project", errc::protocol_error, everywhere,
     "The project has a link, which is not allowed: \"{path}\"."},
    {R::zip_with_device, "bad-project", errc::protocol_error, everywhere,
     "The project has a device or pipe, which is not allowed: \"{path}\"."},
    {R::zip_encrypted, "bad-project", errc::protocol_error, everywhere,
     "The project has an encrypted file, which is not allowed: \"{path}\"."},
    {R::zip_compression, "bad-project", errc::protocol_error, everywhere,
     "The project has a file with an unusual compression, which is not allowed: \"{path}\"."},
    {R::zip_with_file_twice, "bad-project", errc::protocol_error, everywhere,
     "The project has two files with one name, which is not allowed: \"{path}\"."},
    {R::zip_with_file_as_folder, "bad-project", errc::protocol_error, everywhere,
     "The project has a file and a folder with one name, which is not allowed: \"{path}\"."},
    {R::archive_bomb, "bad-project", errc::too_large, everywhere,
     "The project's archive grows to more than {max} MB, which is suspicious."},
    {R::fetch_too_slow, "bad-project", errc::timed_out, everywhere,
     "The project took too long to unpack."},
    {R::repository_files, "bad-project", errc::too_large, everywhere,
     "The repository has too many files."},
    {R::repository_objects, "bad-project", errc::too_large, everywhere,
     "The repository has objects that are too large."},
    {R::repository_folders, "bad-project", errc::too_large, everywhere,
     "The repository has too many folders."},
    {R::repository_folder_files, "bad-project", errc::too_large, everywhere,
     "The repository has a folder with too many files."},
    {R::parent_files, "bad-project", errc::too_large, everywhere,
     "The files of the folders above the project are too large."},
    {R::needs_more_memory, "bad-project", errc::too_large, everywhere,
     "The project needs more memory than this server has for all that it fetches ({max} MB). Its operator can raise "
     "\"fetchMemory\"."},
    {R::needs_more_room, "bad-project", errc::too_large, everywhere,
     "The project needs more room than this server has for all that it fetches ({max} MB). Its operator can raise "
     "\"fetchDisk\"."},
    {R::no_world, "no-world", errc::not_found, everywhere,
     "{file} does not exist.", pythons},
    {R::wrong_labels_line, "bad-project", errc::invalid_argument, everywhere,
     "Wrong line in webots.yml: \"{line}\". Expected labels: and at most {max} words of letters, digits, \".\", \"_\", "
     "\"-\" and \"+\", separated by blanks."},
    {R::wrong_compose_line, "bad-project", errc::invalid_argument, everywhere,
     "Wrong line in webots.yml: \"{line}\". Expected dockerCompose:{kind}:<folder>, for instance "
     "webots-project/controllers/"},
    {R::no_version, "bad-project", errc::invalid_argument, everywhere,
     "The first line of the world names no version of Webots. Expected, for instance: #VRML_SIM R2025a utf8"},
    {R::bad_world_name, "bad-project", errc::invalid_argument, everywhere,
     "The name of the world file has characters that containers can't be told: {file}. Use letters, digits, - _ . and "
     "spaces."},
    {R::no_competition_dockerfile, "bad-project", errc::not_found, everywhere,
     "A competition needs a Dockerfile in its folder controllers, and the project has none."},
    {R::image_not_fetched, "image", errc::not_found, here,
     "The image {image} can't be fetched: {words}"},
    {R::image_with_triggers, "bad-project", errc::invalid_argument, everywhere,
     "The image {image} can't be used on this server: it adds instructions to builds that start from it (ONBUILD). Start "
     "from another one."},
    {R::dockerfile_line, "bad-project", errc::invalid_argument, everywhere,
     "Line {line} of {file} can't be used on this server: {words}"},
    {R::no_such_image, "image", errc::start_failed, here,
     "Image version {version} not available on Cyberbotics' dockerHub. Please, add the appropriate Dockerfile to your "
     "project.", pythons},
    {R::lacks_labels, "lacks", errc::refused, here,
     "This simulation server can't run the project: it lacks what webots.yml asks for: {labels}. Please start it on "
     "another one."},
    {R::nobody_has_label, "site-lacks", errc::refused, everywhere,
     "no simulation server of this site can run this: none has the label {labels}."},
    {R::nobody_has_labels, "site-lacks", errc::refused, everywhere,
     "no simulation server of this site can run this: none has all of the labels {labels}."},

    {R::fetches_wait, "fetch-waits", errc::unavailable, here,
     "The project has to wait: this server fetches too many large ones. Try again in a minute."},
    {R::not_stored, "server-fault", errc::unavailable, here,
     "This server can't store the project: {words}."},
    {R::disk_full, "disk-full", errc::unavailable, here,
     "This server can't store the project: {words}."},
    {R::no_room_for_repository, "server-fault", errc::unavailable, here,
     "This server can't store the project: there is no room for a repository."},
    {R::not_copied, "server-fault", errc::unavailable, here,
     "This server can't copy the project: {words}."},
    {R::not_fetched, "server-fault", errc::unavailable, here,
     "This server can't fetch the project: {words}."},
    {R::copy_damaged, "again", errc::unavailable, here,
     "The copy of the project that this server keeps is damaged. Start it again."},
    {R::not_read, "again", errc::unavailable, here,
     "This server can't read what it has fetched. Start it again."},
    {R::no_cache, "server-fault", errc::unavailable, here,
     "This server can't store projects; its operator finds the reason in its log."},
    {R::no_docker_template, "server-fault", errc::not_found, here,
     "Missing {file} in {folder}", pythons},
    {R::no_compose_services, "server-fault", errc::start_failed, here,
     "This server's {file} has no services that can be understood. Its operator has to indent them, one below the other, "
     "below \"services:\"."},
    {R::bad_docker_setting, "server-fault", errc::invalid_argument, everywhere,
     "This server's docker settings have an unusable value: {value}"},
    {R::not_put_back, "server-fault", errc::unavailable, here,
     "The file can't be brought to where the simulation runs: {words}."},
    {R::node_without_address, "server-fault", errc::start_failed, here,
     "The simulation runs on {node}, but this server knows no address of it."},

    {R::not_started, "not-started", errc::start_failed, here,
     "Unable to start Webots: {why}", pythons},
    {R::ended_early, "ended-early", errc::start_failed, here,
     "Unable to start Webots: {how} before the world was loaded."},
    {R::ended_early_saying, "ended-early", errc::start_failed, here,
     "Unable to start Webots: {how} before the world was loaded: {words}"},
    {R::not_loaded, "too-slow", errc::start_failed, here,
     "Webots did not load the world within {seconds} s."},
    {R::no_port, "too-slow", errc::start_failed, here,
     "Webots loaded the world but opened no port within {seconds} s."},
    {R::quit, "quit", errc::start_failed, here,
     "Webots has quit."},
    {R::crashed, "crashed", errc::start_failed, here,
     "Webots has quit unexpectedly: {how}."},
    {R::display_ended, "crashed", errc::start_failed, here,
     "The virtual display of the simulation has ended unexpectedly. Please start the simulation again."},
    {R::time_limit, "time-limit", errc::start_failed, here,
     "The simulation reached its time limit of {seconds} s."},
    {R::memory_overrun, "overrun", errc::start_failed, everywhere,
     "The simulation used more than {max} MB of memory, which is the limit of a simulation on this server. Its operator "
     "can raise \"simulationMemory\"."},
    {R::job_memory_overrun, "overrun", errc::start_failed, everywhere,
     "The simulation used more than {max} MB of memory, which is the limit of a simulation on this server. Its operator "
     "can raise \"memory\" of \"launcher\"."},
    {R::process_overrun, "overrun", errc::start_failed, everywhere,
     "The simulation started more than {max} processes and threads at once, which is the limit of a simulation on this "
     "server. Its operator can raise \"simulationProcesses\"."},
    {R::disk_overrun, "overrun", errc::start_failed, everywhere,
     "The simulation filled its folder with more than {max} MB, or with very many files, which is the limit of a "
     "simulation on this server. Its operator can raise \"simulationDisk\"."},
    {R::build_overrun, "overrun", errc::start_failed, everywhere,
     "The steps that build the project made images of more than {max} MB together, which is the limit of a simulation on "
     "this server. Its operator can raise \"simulationDisk\"."},
    {R::ended_by_operator, "ended-by-operator", errc::refused, everywhere,
     "The operator has ended this simulation."},
    {R::has_ended, "ended", errc::not_found, everywhere,
     "This simulation has ended. Please start it again."},
    {R::job_time_limit, "cluster", errc::start_failed, here,
     "The simulation was ended by Slurm: its job has reached its time limit."},
    {R::job_preempted, "cluster", errc::start_failed, here,
     "The simulation was ended by Slurm, which needs its node for a more important job."},
    {R::node_failed, "cluster", errc::start_failed, here,
     "The simulation has ended: its node of the cluster has failed."},
    {R::job_memory, "cluster", errc::start_failed, here,
     "The simulation was ended: it needed more memory than its job may have. Its operator can raise \"memory\" of "
     "\"launcher\"."},
    {R::job_cancelled, "cluster", errc::start_failed, here,
     "The simulation was ended: its job was cancelled."},
    {R::job_cancelled_early, "cluster", errc::start_failed, here,
     "The simulation was cancelled while it waited for a node of the cluster."},
    {R::job_refused, "cluster", errc::start_failed, here,
     "Slurm does not start the simulation: {words}."},
    {R::job_invalid, "cluster", errc::start_failed, here,
     "Slurm does not start the simulation: invalid {words}."},
    {R::node_without_project, "server-fault", errc::start_failed, here,
     "The node of the cluster does not see the simulation's project: the folder \"stateDir\" of the simulation server "
     "must be shared with all nodes, or projects be copied to them (\"copyTo\" of \"launcher\")."},
    {R::job_project_not_copied, "server-fault", errc::start_failed, here,
     "The simulation's project can't be copied to its node of the cluster. Please tell the operator."},
    {R::job_project_not_copied_saying, "server-fault", errc::start_failed, here,
     "The simulation's project can't be copied to its node of the cluster: {words}. Please tell the operator."},

    {R::nothing_asked, "again", errc::timed_out, everywhere,
     "No simulation was asked for in time: please start again."},
    {R::too_many_silent, "again", errc::timed_out, everywhere,
     "Too many connections wait here for their start: please start again."},
    {R::wrong_message, "wrong-message", errc::invalid_argument, everywhere,
     "Wrong message: {words}."},
    {R::wrong_mode, "wrong-message", errc::invalid_argument, everywhere,
     "Unsupported client mode: {mode}. Expected w3d, x3d or mjpeg."},
    {R::second_start, "wrong-message", errc::refused, everywhere,
     "This connection has started a simulation already: open another one."},
    {R::no_start_to_reset, "wrong-message", errc::refused, everywhere,
     "No simulation was started: there is no controller to reset."},
    {R::no_start_to_extend, "wrong-message", errc::refused, everywhere,
     "No simulation was started: there is none to extend."},
    {R::still_fetching, "still-fetching", errc::refused, everywhere,
     "The project is still being fetched: there is no controller to reset."},
    {R::no_file, "no-file", errc::not_found, everywhere,
     "The project has no file {file}."},
    {R::project_gone, "ended", errc::not_found, everywhere,
     "The project is not here any more."},
    {R::not_extended, "not-extended", errc::refused, everywhere,
     "The time of this simulation can't be extended any more."},
    {R::not_editable, "not-editable", errc::refused, everywhere,
     "Programs can't be changed on this server: its operator has not allowed it (\"allowEdit\")."},
    {R::saved_too_often, "not-saved", errc::refused, everywhere,
     "That was saved too often in a short time. Please wait a few seconds, and save again."},
    {R::program_too_large, "not-saved", errc::too_large, everywhere,
     "A program may have {max} bytes at most. Please make it shorter, or divide it."},
    {R::program_no_text, "not-saved", errc::invalid_argument, everywhere,
     "Only text can be saved, without control characters."},
    {R::too_many_programs, "not-saved", errc::too_large, everywhere,
     "A simulation may have {max} programs at most. Please put the text into one that is there."},
    {R::no_compiler, "no-compiler", errc::refused, everywhere,
     "This server can't compile {controller}."},
    {R::not_compiled, "not-compiled", errc::invalid_argument, everywhere,
     "{controller} does not compile: look at the messages of the compiler."},
    {R::compiled_too_long, "compiled-too-long", errc::timed_out, everywhere,
     "{controller} was not compiled within {seconds} seconds. Please make it smaller."},

    {R::no_machine, "no-machine", errc::unavailable, full,
     "no simulation server available at the moment.", pythons},
    {R::no_machine_to_relay, "no-machine", errc::unavailable, full,
     "No simulation server available at the moment."},
    {R::no_room_for_world, "no-machine", errc::too_large, full,
     "no simulation server has room for this world at the moment."},
    {R::too_many_starts, "too-fast", errc::unavailable, full,
     "too many sessions are asked for from your network. Please try again in a moment."},
    {R::too_many_wait, "too-fast", errc::unavailable, full,
     "Too many wait here from your network already. Please try again in a moment."},
    {R::cannot_list, "no-list", errc::unavailable, here,
     "The worlds of this address can't be listed here. Write the address of one of them."},
    {R::too_many_lists, "busy-lists", errc::unavailable, here,
     "Too many lists of worlds are being made. Please try again in a moment."},
    {R::page_says_too_much, "wrong-message", errc::refused, everywhere,
     "This page sends too much: please start again."},
    {R::fetch_at_relay, "wrong-message", errc::refused, everywhere,
     "A project can be fetched for later on a simulation server only."},
    {R::nothing_to_relay, "wrong-message", errc::refused, everywhere,
     "The first message has to ask for a simulation."},
}};
// clang-format on

constexpr bool is_in_order()
{
    for (std::size_t i = 0; i < table.size(); ++i)
        if (table[i].which != static_cast<Refused>(i))
            return false;
    return true;
}
static_assert(is_in_order(), "rows stand in the order of Refused, each of which has one");

std::string_view value_of(RefusalArguments arguments, std::string_view name)
{
    auto const* const found = std::find_if(arguments.begin(), arguments.end(),
                                           [name](auto const& argument) { return argument.first == name; });
    assert(found != arguments.end());
    return found == arguments.end() ? std::string_view() : found->second;
}

/// `sentence` with the values; what braces a value has itself stay.
std::string filled_in(std::string_view sentence, RefusalArguments arguments)
{
    std::string text;
    for (;;) {
        auto const open = sentence.find('{');
        text += sentence.substr(0, open);
        if (open == std::string_view::npos)
            return text;
        auto const close = sentence.find('}', open);
        text += value_of(arguments, sentence.substr(open + 1, close - open - 1));
        sentence.remove_prefix(close + 1);
    }
}

} // namespace

RefusalRow const& row_of(Refused which) noexcept
{
    return table[static_cast<std::size_t>(which)];
}

Failure refused(Refused which, RefusalArguments arguments)
{
    return refused(make_error_code(row_of(which).kind), which, arguments);
}

Failure refused(boost::system::error_code kind, Refused which, RefusalArguments arguments)
{
    auto const& row = row_of(which);
    FailureInfo info;
    info.code = row.code;
    for (auto const& [name, value] : arguments)
        info.arguments.emplace_back(name, value);
    return Failure(kind, filled_in(row.sentence, arguments), std::move(info));
}

std::optional<StartRefusal> where_refused(Failure const& failure) noexcept
{
    auto const* const info = failure.info();
    if (!info)
        return std::nullopt;
    auto const* const row = std::find_if(table.begin(), table.end(), [&](RefusalRow const& each) {
        return each.code == info->code && failure == each.kind;
    });
    return row == table.end() ? std::nullopt : std::optional(row->where);
}

std::string_view code_of_system(Failure const& failure) noexcept
{
    if (failure.code() == boost::system::errc::no_space_on_device)
        return row_of(Refused::disk_full).code;
    bool const is_of_system = failure.code().failed() && failure.code().category() != webots_cloud_category();
    return is_of_system ? row_of(Refused::not_stored).code : std::string_view();
}

RefusalRow const* pythons_refusal(std::string_view sentence) noexcept
{
    auto const* const row = std::find_if(table.begin(), table.end(), [&](RefusalRow const& each) {
        auto const form = each.sentence;
        auto const last = form.rfind('}');
        return each.is_pythons && sentence.starts_with(form.substr(0, form.find('{'))) &&
               (last == std::string_view::npos || sentence.ends_with(form.substr(last + 1)));
    });
    return row == table.end() ? nullptr : row;
}

} // namespace webots_cloud::core
