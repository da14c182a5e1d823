// Reads, from the files of proc(5), what memory processes share or keep in files without a name, each piece
// once. Simulations may forge names and mounts, so nothing here asks a file system that one of them could
// have made. process_usage.cpp decides when such a look is worth its time.
#include "shared_memory.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "core/text.hpp"
#include "process_tree.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <linux/kcmp.h>
#include <linux/openat2.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <sys/syscall.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <tuple>

namespace webots_cloud::adapters {
namespace {

// Of one look, all processes together. What is beyond counts as not looked at.
constexpr std::size_t max_descriptors = 65'536;
constexpr std::size_t max_text = std::size_t{32} << 20; // of the kernel's tables
constexpr std::size_t max_namespaces = 64;

constexpr std::uint64_t block_size = 512; // of `stat`
constexpr std::uint64_t unknown = ~std::uint64_t{0};
constexpr std::string_view deleted = " (deleted)";

std::string proc_path(pid_t process, std::string_view name)
{
    return core::concat("/proc/", std::to_string(process), "/", name);
}

/// The number behind `key` in a table of the kernel's, in bytes. 0: it is not in there.
std::uint64_t kilobytes_of(std::string_view text, std::string_view key)
{
    auto const found = text.find(key);
    if (found == std::string_view::npos)
        return 0;
    text.remove_prefix(found + key.size());
    return static_cast<std::uint64_t>(next_number(text)) << 10;
}

/// Never asks a file system that a simulation could have made, and that need not answer.
bool look(int folder, char const* path, int flags, struct statx& status)
{
    return ::statx(folder, path, flags | AT_STATX_DONT_SYNC,
                   STATX_TYPE | STATX_NLINK | STATX_INO | STATX_BLOCKS, &status) == 0;
}

dev_t device_of(struct statx const& status)
{
    return makedev(status.stx_dev_major, status.stx_dev_minor);
}

/// Where the kernel keeps all memory that is shared and has no name, whoever uses it.
dev_t nameless_device()
{
    static dev_t const device = [] {
        FileDescriptor const file(::memfd_create("webots_cloud", MFD_CLOEXEC));
        struct statx status
        {};
        return file && look(file.get(), "", AT_EMPTY_PATH, status) ? device_of(status) : dev_t{0};
    }();
    return device;
}

/// Removes the next word of a line.
std::string_view next_word(std::string_view& line)
{
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    auto const word = line.substr(0, line.find(' '));
    line.remove_prefix(word.size());
    return word;
}

/// `<major>:<minor>`. 0: it is malformed.
dev_t parse_device(std::string_view text, int base)
{
    unsigned major_number = 0;
    unsigned minor_number = 0;
    auto const* const end = text.data() + text.size();
    auto const [colon, error] = std::from_chars(text.data(), end, major_number, base);
    if (error != std::errc() || colon == end || *colon != ':')
        return 0;
    std::from_chars(colon + 1, end, minor_number, base);
    return makedev(major_number, minor_number);
}

/// Some characters of paths are octal numbers in tables of mounts.
std::string unescaped(std::string_view path)
{
    constexpr std::size_t digits = 3;
    std::string text;
    for (std::size_t i = 0; i < path.size(); ++i) {
        unsigned value = 0;
        auto const* const number = path.data() + i + 1;
        if (path[i] == '\\' && i + digits < path.size() &&
            std::from_chars(number, number + digits, value, 8).ptr == number + digits) {
            text.push_back(static_cast<char>(value));
            i += digits;
        } else {
            text.push_back(path[i]);
        }
    }
    return text;
}

/// A folder that a process sees. Nobody is asked on the way: in file systems of its own that could wait for
/// ever. What is mounted somewhere is known to the kernel.
FileDescriptor open_seen(pid_t process, std::string const& path)
{
    FileDescriptor const root(::open(proc_path(process, "root").c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    open_how how{};
    how.flags = O_PATH | O_CLOEXEC;
    how.resolve = RESOLVE_NO_SYMLINKS | RESOLVE_CACHED;
    auto const relative = core::concat(".", path);
    auto folder = ::syscall(SYS_openat2, root.get(), relative.c_str(), &how, sizeof how);
    if (folder < 0 && errno == EINVAL) { // before Linux 5.12
        how.resolve = RESOLVE_NO_SYMLINKS;
        folder = ::syscall(SYS_openat2, root.get(), relative.c_str(), &how, sizeof how);
    }
    return FileDescriptor(static_cast<int>(folder));
}

struct Mount
{
    dev_t device = 0;
    std::string_view path; ///< As in the table.
    bool is_in_memory = false;
};

/// A line of `mountinfo`, see proc(5).
Mount parse_mount(std::string_view line)
{
    Mount mount;
    next_word(line);
    next_word(line);
    mount.device = parse_device(next_word(line), 10);
    next_word(line);
    mount.path = next_word(line);
    auto const end = line.find(" - ");
    if (end != std::string_view::npos) {
        line.remove_prefix(end + 3);
        mount.is_in_memory = next_word(line) == "tmpfs";
    }
    return mount;
}

/// A line of `maps` or `smaps` that says where something is mapped.
struct Mapping
{
    std::string_view range;
    dev_t device = 0;
    std::uint64_t inode = 0; ///< 0: it is no such line, or nothing is behind it.
    std::string_view name;
};

Mapping parse_mapping(std::string_view line)
{
    Mapping mapping;
    mapping.range = next_word(line);
    if (mapping.range.find('-') == std::string_view::npos || mapping.range.ends_with(':'))
        return mapping;
    next_word(line);
    next_word(line);
    mapping.device = parse_device(next_word(line), 16);
    auto const number = next_word(line);
    std::from_chars(number.data(), number.data() + number.size(), mapping.inode);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    mapping.name = line;
    return mapping;
}

/// As the links in `map_files` are called.
std::string link_of(std::string_view range)
{
    std::array<std::uint64_t, 2> ends{};
    auto const* const end = range.data() + range.size();
    auto const dash = std::from_chars(range.data(), end, ends[0], 16).ptr;
    std::from_chars(std::min(dash + 1, end), end, ends[1], 16);
    std::array<char, 40> text{};
    auto const first = std::to_chars(text.data(), text.data() + text.size(), ends[0], 16).ptr;
    *first = '-';
    auto const last = std::to_chars(first + 1, text.data() + text.size(), ends[1], 16).ptr;
    return {text.data(), last};
}

/// Adds up what is memory, and counts each piece once, however many processes use it.
class SharedMemoryLook
{
public:
    SharedMemoryLook()
    {
        struct statx status
        {};
        if (look(AT_FDCWD, "/proc/self/ns/mnt", 0, status))
            namespaces_.insert(status.stx_ino);
        read_lines("/proc/self/mountinfo", [this](std::string_view line) {
            if (auto const mount = parse_mount(line); mount.is_in_memory)
                ours_.insert(mount.device);
        });
    }

    void add_file_systems(pid_t process);
    void add_open_files(pid_t process);
    void add_mappings(pid_t process);

    SharedMemory result() const { return result_; }

private:
    /// Shared memory has numbers of another kind than files in memory.
    using Number = std::tuple<dev_t, std::uint64_t, bool>;

    static bool is_segment(std::string_view name) { return name.starts_with("/SYSV"); }

    template<class Use>
    void read_lines(std::string const& path, Use use)
    {
        std::ifstream file(path);
        for (std::string line; result_.is_whole && std::getline(file, line);) {
            text_ += line.size() + 1;
            if (text_ > max_text)
                result_.is_whole = false;
            else
                use(std::string_view(line));
        }
    }

    /// Whether something is memory, and in none of the file systems that count as a whole.
    bool counts(dev_t device, bool has_name) const
    {
        return device != 0 && (device == nameless_device() || (!has_name && ours_.contains(device)));
    }

    void add_file_system(pid_t process, Mount const& mount);
    void add_table(std::string const& folder);
    void add_shares(pid_t process);

    std::set<std::uint64_t> namespaces_; ///< Of mounts, that we have been in, our own first.
    std::set<dev_t> ours_;               ///< File systems in memory that we see: the machine's.
    std::set<dev_t> theirs_;
    std::set<Number> known_; ///< Whose size has been added.
    std::size_t descriptors_ = 0;
    std::size_t text_ = 0;
    SharedMemory result_;
};

void SharedMemoryLook::add_file_system(pid_t process, Mount const& mount)
{
    auto const folder = open_seen(process, unescaped(mount.path));
    struct statx status
    {};
    struct statfs system
    {};
    // Another one may have been mounted over it.
    if (!folder || !look(folder.get(), "", AT_EMPTY_PATH, status) || device_of(status) != mount.device ||
        ::fstatfs(folder.get(), &system) != 0)
        return;
    theirs_.insert(mount.device);
    result_.bytes += (system.f_blocks - system.f_bfree) * static_cast<std::uint64_t>(system.f_bsize);
    result_.is_whole = result_.is_whole && system.f_blocks > 0; // else the kernel does not count it
}

void SharedMemoryLook::add_file_systems(pid_t process)
{
    struct statx status
    {};
    if (!look(AT_FDCWD, proc_path(process, "ns/mnt").c_str(), 0, status) ||
        !namespaces_.insert(status.stx_ino).second)
        return;
    if (namespaces_.size() > max_namespaces) {
        result_.is_whole = false;
        return;
    }
    read_lines(proc_path(process, "mountinfo"), [this, process](std::string_view line) {
        auto const mount = parse_mount(line);
        if (mount.is_in_memory && !ours_.contains(mount.device) && !theirs_.contains(mount.device))
            add_file_system(process, mount);
    });
}

/// A process that has given up being traced hides what is open from us, unless we are root. So do our guards,
/// which is why that shows nothing.
void SharedMemoryLook::add_table(std::string const& folder)
{
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(::opendir(folder.c_str()), &::closedir);
    if (!listing)
        return;
    int const number = ::dirfd(listing.get());
    std::array<char, PATH_MAX> target{};
    while (auto const* const entry = ::readdir(listing.get())) {
        if (entry->d_name[0] == '.')
            continue;
        if (++descriptors_ > max_descriptors) {
            result_.is_whole = false;
            return;
        }
        auto const size = ::readlinkat(number, entry->d_name, target.data(), target.size());
        bool const is_too_long = size < 0 && errno == ENAMETOOLONG;
        std::string_view const name(target.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
        struct statx file
        {};
        if ((is_too_long || name.ends_with(deleted)) && look(number, entry->d_name, 0, file) &&
            S_ISREG(file.stx_mode) && counts(device_of(file), file.stx_nlink > 0) &&
            known_.emplace(device_of(file), file.stx_ino, false).second)
            result_.bytes += file.stx_blocks * block_size;
    }
}

void SharedMemoryLook::add_open_files(pid_t process)
{
    add_table(proc_path(process, "fd"));
    auto const tasks = proc_path(process, "task");
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(::opendir(tasks.c_str()), &::closedir);
    while (auto const* const entry = listing && result_.is_whole ? ::readdir(listing.get()) : nullptr) {
        pid_t thread = 0;
        std::string_view const name(entry->d_name);
        std::from_chars(name.data(), name.data() + name.size(), thread);
        // A thread can have files that its process has not (`unshare`).
        if (thread > 0 && thread != process && ::syscall(SYS_kcmp, process, thread, KCMP_FILES, 0, 0) != 0)
            add_table(core::concat(tasks, "/", name, "/fd"));
    }
}

void SharedMemoryLook::add_mappings(pid_t process)
{
    bool has_unknown = false;
    auto const links = proc_path(process, "map_files/");
    read_lines(proc_path(process, "maps"), [&](std::string_view line) {
        auto const mapping = parse_mapping(line);
        Number const number(mapping.device, mapping.inode, is_segment(mapping.name));
        if (mapping.inode == 0 || !counts(mapping.device, !mapping.name.ends_with(deleted)) ||
            known_.contains(number))
            return;
        struct statx file
        {};
        // Only root may follow these. They show all of what is behind a mapping, of which a process may have
        // mapped a single page by now.
        if (!look(AT_FDCWD, (links + link_of(mapping.range)).c_str(), 0, file)) {
            has_unknown = true;
            return;
        }
        known_.insert(number);
        result_.bytes += file.stx_blocks * block_size;
    });
    if (has_unknown)
        add_shares(process);
}

/// Adds what a process has touched of its mappings, of which nothing else is known.
void SharedMemoryLook::add_shares(pid_t process)
{
    bool is_wanted = false;
    read_lines(proc_path(process, "smaps"), [&](std::string_view line) {
        if (auto const mapping = parse_mapping(line); !mapping.range.ends_with(':'))
            is_wanted = mapping.inode != 0 && counts(mapping.device, !mapping.name.ends_with(deleted)) &&
                        !known_.contains({mapping.device, mapping.inode, is_segment(mapping.name)});
        else if (is_wanted)
            result_.bytes += mapping.range == "Pss:" ? kilobytes_of(line, "Pss:") : 0;
    });
}

} // namespace

std::uint64_t machine_shared_memory()
{
    ProcBuffer buffer;
    auto const text = read_start("/proc/meminfo", buffer);
    constexpr std::string_view shared = "\nShmem:";
    if (text.find(shared) == std::string_view::npos)
        return unknown;
    auto const total = kilobytes_of(text, "\nSwapTotal:");
    return kilobytes_of(text, shared) + total - std::min(total, kilobytes_of(text, "\nSwapFree:"));
}

SharedMemory shared_memory(std::vector<pid_t> const& processes)
{
    // In this order: what is in file systems counts with them as a whole, what is open by its file, and only
    // the rest by what is mapped of it, of which less is known.
    SharedMemoryLook all;
    for (auto const process : processes)
        all.add_file_systems(process);
    for (auto const process : processes)
        all.add_open_files(process);
    for (auto const process : processes)
        all.add_mappings(process);
    return all.result();
}

} // namespace webots_cloud::adapters
