// The folder `log` of a site, and our own files in it. Simulations run as we do, and may have put anything in
// the place of one of them: a pipe would make us wait for ever, and a link make us overwrite what it leads
// to.
#pragma once

#include "kinds.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace webots_cloud::site {

/// Whatever is in the place of a file that has no other name is renamed, and standard error says so.
/// Errors: `unavailable`: it can't be renamed.
result<> set_aside_unless_file(std::filesystem::path const& path);
/// The same for a folder, or a link to one.
result<> set_aside_unless_folder(std::filesystem::path const& path);

/// Makes the folder and says who may write there, if we may not.
/// Errors: `unavailable`, with the remedy.
result<> open_log_folder();

/// Waits until nobody else starts or stops servers here. Holds until the program ends.
/// Errors: as `open_log_folder`.
result<> lock_site();

/// The process that the file of a kind names; nothing where it names none. `is_alive` is another question.
std::optional<pid_t> noted_process(Kind kind);

/// Errors: `unavailable`: the server is found without it.
result<> note_process(Kind kind, pid_t process);
void forget_process(Kind kind);

/// Writes a new file as a whole, or none.   Errors: `unavailable`, the reason alone.
result<> write_new_file(std::filesystem::path const& path, std::string_view text, mode_t mode);

/// Opens `log/<kind>/console.log` for writing, empty.   Errors: `unavailable`.
result<int> open_console(Kind kind);

/// Why the last starts of simulations failed, three at most, as a simulation server has logged it:
/// `23:59:58 This server can't copy the project: ...`. `since`: as its log writes moments; what is older is
/// of a server before.
std::vector<std::string> failed_starts(std::string_view log, std::string_view since);

/// The same of its log.
std::vector<std::string> failed_starts(std::filesystem::path const& log_dir, WallTime since);

/// Why a server has ended, of what it wrote to its console: the last line that begins with its name, without
/// that and without a full stop; empty: there is none.
std::string reason_of_end(Kind kind, std::string_view console);

/// The same of `log/<kind>/console.log`.
std::string reason_of_end(Kind kind);

/// The last ten lines of the logs of a server, each log with its name, as far as there are any.
std::string last_words(Kind kind, std::filesystem::path const& log_dir);

} // namespace webots_cloud::site
