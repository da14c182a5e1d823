#include "process_table.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <charconv>
#include <filesystem>
#include <string>

#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t max_read = std::size_t{1} << 20;

std::string folder_of(pid_t id)
{
    return concat("/proc/", std::to_string(id));
}

std::uint64_t number_after(std::string_view text, std::string_view before)
{
    std::uint64_t number = 0;
    auto const found = text.find(before);
    if (found != std::string_view::npos)
        std::from_chars(text.data() + found + before.size(), text.data() + text.size(), number);
    return number;
}

/// NSpid: the number here, and one more for each PID namespace below ours.
bool counts_in_inner_namespace(std::string_view status)
{
    constexpr std::string_view key = "\nNSpid:\t";
    auto const found = status.find(key);
    if (found == std::string_view::npos)
        return false;
    auto const numbers = status.substr(found + key.size());
    return numbers.substr(0, numbers.find('\n')).find('\t') != std::string_view::npos;
}

/// By the name of a server. One whose folder was renamed runs the program of its name.
bool is_posing_as_server(Process const& process)
{
    if (!parse_server(process.arguments))
        return false;
    std::error_code failed;
    fs::path const called = process.arguments.front();
    fs::path const program = process.program;
    bool const has_name = process.is_moved && program.filename() == called.filename();
    return is_posing(process, (has_name ? program : fs::weakly_canonical(called, failed)).native());
}

} // namespace

std::vector<Process> all_processes()
{
    std::vector<Process> processes;
    std::error_code failed;
    for (fs::directory_iterator each("/proc", failed), end; !failed && each != end; each.increment(failed)) {
        auto const name = each->path().filename().string();
        pid_t id = 0;
        auto const [stop, bad] = std::from_chars(name.data(), name.data() + name.size(), id);
        if (bad != std::errc() || stop != name.data() + name.size())
            continue;
        auto process = read_process(id);
        if (!process || process->arguments.empty())
            continue;
        if (is_posing_as_server(*process))
            process->arguments = {process->is_inner ? "a program in a sandbox or container"
                                                    : process->program};
        processes.push_back(std::move(*process));
    }
    return processes;
}

std::optional<Process> read_process(pid_t id)
{
    struct stat owner;
    auto const text = read_regular_file(folder_of(id) + "/stat", max_read);
    auto const began = text ? parse_beginning(*text) : std::nullopt;
    if (!began || ::stat(folder_of(id).c_str(), &owner) != 0)
        return std::nullopt;
    Process process;
    process.id = id;
    process.user = owner.st_uid;
    process.began = *began;
    std::error_code hidden;
    process.program = fs::read_symlink(folder_of(id) + "/exe", hidden).string();
    if (auto const status = read_regular_file(folder_of(id) + "/status", max_read))
        process.is_inner = counts_in_inner_namespace(*status);
    auto const line = read_regular_file(folder_of(id) + "/cmdline", max_read);
    if (line && !line->empty())
        for (auto const word : core::split(std::string_view(*line).substr(0, line->size() - 1), '\0'))
            process.arguments.emplace_back(word);
    process.is_moved = parse_server(process.arguments) && !fs::exists(process.arguments.front(), hidden);
    return process;
}

bool are_hidden()
{
    return !read_process(1);
}

bool is_alive(Process const& process)
{
    auto const now = read_process(process.id);
    return now && now->began == process.began;
}

WallTime beginning_of(Process const& process)
{
    auto const text = read_regular_file("/proc/stat", max_read);
    auto const booted = text ? number_after(*text, "\nbtime ") : 0;
    auto const ticks = static_cast<std::uint64_t>(::sysconf(_SC_CLK_TCK));
    return WallTime(std::chrono::seconds(booted + process.began / ticks));
}

std::vector<std::uint64_t> sockets_of(Process const& process)
{
    std::vector<std::uint64_t> sockets;
    std::error_code failed;
    for (fs::directory_iterator each(folder_of(process.id) + "/fd", failed), end; !failed && each != end;
         each.increment(failed)) {
        std::error_code gone;
        auto const target = fs::read_symlink(each->path(), gone).string();
        if (target.starts_with("socket:["))
            sockets.push_back(number_after(target, "["));
    }
    return sockets;
}

} // namespace webots_cloud::site
