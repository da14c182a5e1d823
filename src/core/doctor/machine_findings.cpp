#include "machine_findings.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::uint64_t almost_nothing = 64 << 20; // bytes: no log and no project fits
constexpr std::uint64_t few_files = 1000;          // a project has hundreds

} // namespace

Finding judge_folder(std::string_view subject, std::string_view key, FolderReading const& reading,
                     std::uint64_t wanted)
{
    auto const path = reading.path.string();
    if (!reading.problem.empty())
        return {
            Verdict::fault, subject, concat("nothing can be written to ", path, ": ", reading.problem),
            concat("Let the user who runs the server write there, or name another folder with ", key, ".")};
    auto const space = concat(gigabytes(reading.free), " of ", gigabytes(reading.total), " free");
    auto const where = concat(path, reading.exists ? "" : " (made at the start)");
    if (reading.free < almost_nothing)
        return {Verdict::fault, subject, concat(where, ": the disk is full, ", space),
                concat("Remove files, or name a folder on another disk with ", key, ".")};
    if (reading.total_files > 0 && reading.free_files < few_files)
        return {Verdict::fault, subject,
                concat(where, ": the file system takes only ", std::to_string(reading.free_files),
                       " more files (inodes), whatever their size"),
                concat("Remove files, or name a folder on another disk with ", key, ".")};
    if (reading.free < wanted)
        return {Verdict::warning, subject,
                concat(where, ": ", space, ", and the server may want ", gigabytes(wanted)),
                concat("Make room there, or name a folder on another disk with ", key, ".")};
    return {Verdict::ok, subject, concat(where, ": ", space)};
}

Finding judge_memory(std::uint64_t available, std::uint64_t total, std::uint64_t wanted)
{
    auto const left = concat(gigabytes(available), " of ", gigabytes(total), " are available");
    if (available < wanted)
        return {Verdict::warning, "memory", concat(left, ", and the server may want ", gigabytes(wanted)),
                "End other programs, or give this machine more memory."};
    return {Verdict::ok, "memory", left};
}

Finding judge_clock(bool is_synchronised)
{
    if (is_synchronised)
        return {Verdict::ok, "clock", "it is kept right by a time server"};
    return {Verdict::warning, "clock", "no time server keeps it right, as far as the kernel knows",
            "Install systemd-timesyncd or chrony: certificates and tickets are refused where clocks differ."};
}

Finding judge_lost_log(std::string_view path)
{
    return {Verdict::fault, lost_log_subject,
            concat("the server writes to a file that is not at ", path,
                   " any more: it, or its folder, was removed or replaced while the server ran"),
            "Restart the server, or move back what was there at its start."};
}

Finding judge_open_files(std::uint64_t limit, std::uint64_t wanted)
{
    auto const found = concat("at most ", std::to_string(limit), " at a time");
    if (limit < wanted)
        return {Verdict::warning, "open files",
                concat(found, ", and this configuration may want ", std::to_string(wanted)),
                "Raise the limit: LimitNOFILE= in the unit, or ulimit -n."};
    return {Verdict::ok, "open files", found};
}

} // namespace webots_cloud::core
