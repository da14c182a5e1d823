#include "own_folder.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr mode_t ours = S_IRWXU;
constexpr mode_t of_others = S_IRWXG | S_IRWXO;

Failure system_failure(fs::path const& path)
{
    boost::system::error_code const error(errno, boost::system::system_category());
    return {error, concat(path.string(), ": ", error.message())};
}

/// O_PATH: also where its mode forbids us to look into it.
FileDescriptor find_folder(int parent, char const* name)
{
    return FileDescriptor(::openat(parent, name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

/// Opens what a descriptor of O_PATH stands for.
result<FileDescriptor> open_found(int found, fs::path const& path, std::vector<std::string>& notices)
{
    auto const link = concat("/proc/self/fd/", std::to_string(found));
    struct stat status;
    if (::fstat(found, &status) != 0)
        return system_failure(path);
    if ((status.st_mode & (ours | of_others)) != ours) {
        if (::chmod(link.c_str(), ours) != 0)
            return system_failure(path);
        if ((status.st_mode & ours) != ours || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
            notices.push_back(concat(path.string(), " had the mode ",
                                     (status.st_mode & ours) != ours ? "of a folder that we can't use"
                                                                     : "of a folder that others may write to",
                                     ": now it is ours alone."));
    }
    FileDescriptor opened(::open(link.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!opened)
        return system_failure(path);
    return opened;
}

} // namespace

result<std::string> set_aside(int parent, char const* name, fs::path const& path)
{
    auto const other = concat(name, ".set-aside-", make_token().substr(0, 8));
    if (::renameat(parent, name, parent, other.c_str()) != 0)
        return system_failure(path);
    return concat(path.string(), " was not what it has to be, and is now ", other, " beside it.");
}

result<FileDescriptor> open_own_folder(int parent, fs::path const& path, Foreign foreign,
                                       std::vector<std::string>& notices)
{
    auto const name = path.filename();
    for (bool first = true;; first = false) {
        if (::mkdirat(parent, name.c_str(), ours) != 0 && errno != EEXIST)
            return system_failure(path);
        auto const found = find_folder(parent, name.c_str());
        if (!found && errno != ENOTDIR && errno != ELOOP)
            return system_failure(path);
        struct stat status;
        bool const is_folder = found && ::fstat(found.get(), &status) == 0;
        if (is_folder && status.st_uid == ::geteuid())
            return open_found(found.get(), path, notices);
        if (is_folder && foreign == Foreign::refuse)
            return Failure(errc::invalid_argument, concat(path.string(), ": it belongs to another user"));
        if (!first)
            return Failure(errc::invalid_argument,
                           concat(path.string(), ": somebody replaces it again and again"));
        auto moved = set_aside(parent, name.c_str(), path);
        if (!moved)
            return moved.error();
        notices.push_back(std::move(*moved));
    }
}

result<std::vector<std::string>> make_own_folder(std::filesystem::path const& path)
{
    constexpr auto trial = ".room";
    constexpr std::size_t block = 4096; // what a file takes at least
    std::error_code failed;
    std::filesystem::create_directories(path.parent_path(), failed);
    FileDescriptor const parent(::open(path.parent_path().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!parent)
        return system_failure(path.parent_path());
    std::vector<std::string> notices;
    auto const own = open_own_folder(parent.get(), path, Foreign::refuse, notices);
    if (!own)
        return own.error();
    ::unlinkat(own->get(), trial, 0);
    FileDescriptor const file(
        ::openat(own->get(), trial, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    std::string const text(block, ' ');
    if (file)
        errno = ENOSPC; // where only a part is written, nothing else is said
    bool const is_written = file && ::write(file.get(), text.data(), block) == static_cast<ssize_t>(block);
    auto const failure = system_failure(path);
    if (file)
        ::unlinkat(own->get(), trial, 0);
    if (!is_written)
        return failure;
    return notices;
}

} // namespace webots_cloud::adapters
