// Files are opened without following links, and written under another name first, so that a full disk or
// somebody else's link leaves nothing half done.
#include "log_folder.hpp"

#include "adapters/host/accounts.hpp"
#include "app/daemon.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <iostream>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr auto log_folder = "log";
constexpr auto lock_file = "log/.server.lock";
constexpr std::size_t last_lines = 10;
constexpr std::size_t max_shown = std::size_t{16} << 20;
constexpr std::size_t max_reason = 2000;

fs::path console_file(Kind kind)
{
    return fs::path("log") / word_of(kind) / "console.log";
}

std::string error_text()
{
    return std::error_code(errno, std::generic_category()).message();
}

std::string user_name(uid_t user)
{
    auto name = adapters::find_user_name(user);
    return name.empty() ? std::to_string(user) : name;
}

result<> set_aside(fs::path const& path)
{
    auto const aside = concat(path.string(), ".set-aside-", std::to_string(::getpid()));
    if (::rename(path.c_str(), aside.c_str()) != 0)
        return Failure(
            errc::unavailable,
            concat(path.string(), " is not what it has to be, and can't be moved away. Remove it."));
    std::cerr << app::terminal_text(concat(path.string(), " was not what it has to be, and is now ", aside))
              << std::endl;
    return {};
}

bool may_write(char const* path)
{
    return ::faccessat(AT_FDCWD, path, W_OK, AT_EACCESS) == 0;
}

/// The folder, or the lock in it, can't be written.
Failure told_by_owner(std::string const& path)
{
    auto const us = user_name(::geteuid());
    struct stat found
    {};
    ::stat(path.c_str(), &found);
    std::error_code ignored;
    if (found.st_uid == ::geteuid())
        return {errc::unavailable, concat("Nothing can be written to ", fs::current_path(ignored).string(),
                                          "/log: is the disk read-only?")};
    auto const owner = user_name(found.st_uid);
    return {errc::unavailable,
            concat(path == log_folder ? "The folder " : "The file ", path, " belongs to ", owner,
                   ", who has started servers here. Run this as ", owner,
                   "; or let them run ./server.sh stop, and then: sudo chown -R ", us, ": log")};
}

/// Without what is not whole of the first.
std::string last_lines_of(std::string_view text)
{
    auto const lines = core::split(text.ends_with('\n') ? text.substr(0, text.size() - 1) : text, '\n');
    std::string last;
    for (auto i = lines.size() > last_lines ? lines.size() - last_lines : 0; i < lines.size(); ++i)
        last += concat(lines[i], "\n");
    return last;
}

} // namespace

result<> set_aside_unless_file(fs::path const& path)
{
    struct stat found;
    if (::lstat(path.c_str(), &found) != 0 || (S_ISREG(found.st_mode) && found.st_nlink == 1))
        return {};
    return set_aside(path);
}

result<> set_aside_unless_folder(fs::path const& path)
{
    struct stat found;
    if (::lstat(path.c_str(), &found) != 0 || (::stat(path.c_str(), &found) == 0 && S_ISDIR(found.st_mode)))
        return {};
    return set_aside(path);
}

result<> open_log_folder()
{
    if (auto const usable = set_aside_unless_folder(log_folder); !usable)
        return usable;
    if (::mkdir(log_folder, 0777) != 0 && errno != EEXIST) {
        std::error_code ignored;
        return Failure(errc::unavailable,
                       concat("The folder log can't be made in ", fs::current_path(ignored).string(),
                              ": may ", user_name(::geteuid()), " write there?"));
    }
    if (!may_write(log_folder))
        return told_by_owner(log_folder);
    return {};
}

result<> lock_site()
{
    if (auto const usable = open_log_folder(); !usable)
        return usable;
    if (auto const usable = set_aside_unless_file(lock_file); !usable)
        return usable;
    int const lock = ::open(lock_file, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (lock < 0)
        return errno == ENOSPC ? Failure(errc::unavailable, concat(lock_file, ": ", error_text()))
                               : told_by_owner(lock_file);
    while (::flock(lock, LOCK_EX) != 0)
        if (errno != EINTR)
            return Failure(errc::unavailable, concat(lock_file, ": ", error_text()));
    return {};
}

std::optional<pid_t> noted_process(Kind kind)
{
    constexpr std::size_t max_number = 64;
    auto const text = read_regular_file(pid_file(kind), max_number);
    if (!text)
        return std::nullopt;
    auto const word = core::trim(*text);
    pid_t process = 0;
    auto const [end, failed] = std::from_chars(word.data(), word.data() + word.size(), process);
    return failed == std::errc() && end == word.data() + word.size() && process > 0 ? std::optional(process)
                                                                                    : std::nullopt;
}

result<> write_new_file(fs::path const& path, std::string_view text, mode_t mode)
{
    auto const beside = concat(path.string(), ".new");
    ::unlink(beside.c_str());
    int const file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
    if (file < 0)
        return Failure(errc::unavailable, error_text());
    bool written = ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    written = written && ::fchmod(file, mode) == 0; // whatever the umask is
    written = ::close(file) == 0 && written;
    if (written && ::rename(beside.c_str(), path.c_str()) == 0)
        return {};
    Failure failure(errc::unavailable, error_text());
    ::unlink(beside.c_str());
    return failure;
}

result<> note_process(Kind kind, pid_t process)
{
    auto const file = pid_file(kind);
    if (auto const usable = set_aside_unless_file(file); !usable)
        return usable;
    if (auto const written = write_new_file(file, concat(std::to_string(process), "\n"), 0644); !written)
        return Failure(errc::unavailable, concat("The number of the server can't be written to ", file, ": ",
                                                 written.error().message()));
    return {};
}

void forget_process(Kind kind)
{
    ::unlink(pid_file(kind).c_str());
}

result<int> open_console(Kind kind)
{
    auto const folder = concat("log/", word_of(kind));
    auto const file = folder + "/console.log";
    if (auto const usable = set_aside_unless_folder(folder); !usable)
        return usable.error();
    ::mkdir(folder.c_str(), 0777);
    if (auto const usable = set_aside_unless_file(file); !usable)
        return usable.error();
    int const console =
        ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (console < 0)
        return Failure(errc::unavailable, concat(file, " can't be written: ", error_text()));
    return console;
}

std::vector<std::string> failed_starts(std::string_view log, std::string_view since)
{
    constexpr std::string_view level = " [ERROR  ]  [";
    constexpr std::size_t most = 3;
    constexpr std::size_t day = std::string_view("2026-01-31 ").size();
    constexpr std::size_t moment = std::string_view("23:59:58").size();
    std::vector<std::string> found;
    for (auto const line : core::split(log, '\n')) {
        auto const begin = line.find(level);
        auto const end = line.find("] ", begin == line.npos ? begin : begin + level.size());
        if (begin == line.npos || end == line.npos || begin < day + moment || line.substr(0, begin) < since)
            continue;
        if (found.size() == most)
            found.erase(found.begin());
        found.push_back(core::printable(concat(line.substr(day, moment), " ", line.substr(end + 2))));
    }
    return found;
}

std::vector<std::string> failed_starts(fs::path const& log_dir, WallTime since)
{
    auto const text = read_regular_file(log_dir / word_of(Kind::simulation) / "output.log", max_shown);
    return text ? failed_starts(*text, core::local_time(since)) : std::vector<std::string>();
}

std::string reason_of_end(Kind kind, std::string_view console)
{
    auto const name = concat(program_of(kind), ": ");
    std::string reason;
    for (auto const line : core::split(console, '\n'))
        if (line.starts_with(name))
            reason = core::printable(line.substr(name.size()), max_reason);
    if (reason.ends_with('.'))
        reason.pop_back();
    return reason;
}

std::string reason_of_end(Kind kind)
{
    auto const text = read_regular_file(console_file(kind), max_shown);
    return text ? reason_of_end(kind, *text) : std::string();
}

std::string last_words(Kind kind, fs::path const& log_dir)
{
    std::string words;
    for (auto const& file : {log_dir / word_of(kind) / "output.log", console_file(kind)})
        if (auto const text = read_regular_file(file, max_shown); text && !text->empty())
            words += concat("--- ", file.string(), "\n", last_lines_of(*text));
    return words;
}

} // namespace webots_cloud::site
