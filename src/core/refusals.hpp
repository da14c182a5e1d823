// What people are told when a start is refused, a simulation ends, or a request can't be done: each sentence
// is a row of the table in refusals.cpp, with the code that programs know it by. Whoever finds a fault names
// the row and says what varies in it. Browsers get the code beside the sentence (protocol section 4.1.6), and
// pages have a text for each code: `refusal.<code>` in src/web/view/texts. To change a sentence, change its
// row, and the documents that quote it (docs/recipes.md, "A failure").
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::core {

/// Which row.
enum class Refused : std::uint8_t
{
    // This server.
    server_drains,
    server_stops,
    no_place,
    client_has_enough,
    world_has_enough,
    no_ticket,
    unknown_ticket,
    expired_ticket,
    used_ticket,
    too_many_tickets,
    no_way_through_gateway,

    // The address of the world, and whose it is.
    foreign_site,
    address_too_long,
    address_malformed,
    address_too_short,
    address_of_folder,
    address_without_folder,
    address_without_blob,
    address_without_worlds, ///< Python servers say no more; we do.
    address_not_in_worlds,
    address_without_world,
    address_owner,
    address_repository,
    address_name,
    outside_allowed,
    outside_sandbox, ///< The same, where a sandbox could take them.
    not_shared,
    too_busy,
    blocked,

    // The project, where it comes from.
    no_repository,
    no_commit,
    no_ref,
    no_folder,
    not_a_commit,
    commit_on_no_branch,
    commit_not_newest,
    history_too_large,
    too_many_refs,
    sha256_repository,
    site_unreachable,
    site_fault,
    large_files,
    no_plain_project,
    no_template,
    no_websites,
    no_website_key,
    unreadable_website_key,
    website_refuses,
    website_without_reason,
    website_status,
    website_unreachable,

    // What is in it.
    project_too_large,
    file_too_large,
    too_many_files,
    path_too_long,
    too_many_long_paths,
    folders_too_deep,
    forbidden_name,
    forbidden_folder,
    impossible_folder,
    bad_zip,
    zip_with_link,
    zip_with_device,
    zip_encrypted,
    zip_compression,
    zip_with_file_twice,
    zip_with_file_as_folder,
    archive_bomb,
    fetch_too_slow,
    repository_files,
    repository_objects,
    repository_folders,
    repository_folder_files,
    parent_files,
    needs_more_memory,
    needs_more_room,
    no_world,
    wrong_labels_line,
    wrong_compose_line,
    no_version,
    bad_world_name,
    no_competition_dockerfile,
    image_not_fetched,
    image_with_triggers,
    dockerfile_line,
    no_such_image,
    lacks_labels,
    nobody_has_label,
    nobody_has_labels,

    // What this server can't do at the moment.
    fetches_wait,
    not_stored,
    disk_full,
    no_room_for_repository,
    not_copied,
    not_fetched,
    copy_damaged,
    not_read,
    no_cache,
    no_docker_template,
    no_compose_services,
    bad_docker_setting,
    not_put_back,
    node_without_address,

    // The simulator.
    not_started,
    ended_early, ///< Without a word.
    ended_early_saying,
    not_loaded,
    no_port,
    quit,
    crashed,
    display_ended,
    time_limit,
    memory_overrun,
    job_memory_overrun,
    process_overrun,
    disk_overrun,
    build_overrun,
    ended_by_operator,
    has_ended,
    job_time_limit,
    job_preempted,
    node_failed,
    job_memory,
    job_cancelled,
    job_cancelled_early,
    job_refused,
    job_invalid,
    node_without_project,
    job_project_not_copied, ///< Without a word.
    job_project_not_copied_saying,

    // Requests of a page.
    nothing_asked,
    too_many_silent,
    wrong_message,
    wrong_mode,
    second_start,
    no_start_to_reset,
    no_start_to_extend,
    still_fetching,
    no_file,
    project_gone,
    not_extended,
    not_editable,
    saved_too_often,
    program_too_large,
    program_no_text,
    too_many_programs,
    no_compiler,
    not_compiled,
    compiled_too_long,

    // Session servers.
    no_machine,
    no_machine_to_relay,
    no_room_for_world,
    too_many_starts,
    too_many_wait,
    cannot_list,
    too_many_lists,
    page_says_too_much,
    fetch_at_relay,
    nothing_to_relay,

    count ///< Not a row.
};

/// Where a start that was refused here would be refused as well.
enum class StartRefusal
{
    everywhere, ///< The project or the request is at fault.
    here,       ///< Another machine may take it: right for a limit on one client, too.
    /// Nobody gets a place here now. A browser that a session server relays waits in its line, if there is
    /// one, and never reads the sentence.
    full
};

struct RefusalRow
{
    Refused which;
    std::string_view code; ///< On the wire. Rows that mean the same to a visitor share it.
    errc kind;
    StartRefusal where;
    std::string_view sentence; ///< With `{name}` for each argument.
    /// Python servers say it as well, so a session server that relays knows it without a code, and it has to
    /// stay as it is.
    bool is_pythons = false;
};

RefusalRow const& row_of(Refused which) noexcept;

/// What varies in a sentence, by name.
using RefusalArguments = std::initializer_list<std::pair<std::string_view, std::string_view>>;

/// The row's sentence, with its code and kind. Precondition: each `{name}` of the sentence has its argument.
/// An argument may be none of these: then only programs are told.
Failure refused(Refused which, RefusalArguments arguments = {});

/// The same with another kind: of a system call that has failed, for instance.
Failure refused(boost::system::error_code kind, Refused which, RefusalArguments arguments = {});

/// Where a start with this failure would be refused as well, if its row says so: nothing for failures without
/// one, and for those of another kind than their row.
std::optional<StartRefusal> where_refused(Failure const& failure) noexcept;

/// The code of a failure of the operating system, which has no row; empty: it is none.
std::string_view code_of_system(Failure const& failure) noexcept;

/// What a Python server, which knows no codes, says with this sentence. Nothing: it is none of the sentences
/// that it shares with us.
RefusalRow const* pythons_refusal(std::string_view sentence) noexcept;

} // namespace webots_cloud::core
