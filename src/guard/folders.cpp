// The simulation's folders belong to a user whom the server can't become, so a guard measures, fills, takes
// back and removes them. Their content is hostile: everything is opened relative to a folder, and no link is
// followed.
#include "folders.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace webots_cloud::guard {
namespace {

constexpr int deepest_taken = 32;                 // a descriptor is open for each
constexpr int deepest_measured = 64;              // as the server's own measurement,
constexpr unsigned long long max_files = 250'000; // and so is this
constexpr unsigned long long block = 512;         // in which stat(2) counts
constexpr int as_folder = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

/// What lies in a folder, but for `.` and `..`. Closes the folder.
class Listing
{
public:
    explicit Listing(int folder) : folder_(folder), entries_(folder < 0 ? nullptr : fdopendir(folder))
    {
        if (!entries_ && folder >= 0)
            close(folder);
    }
    Listing(Listing const&) = delete;
    ~Listing()
    {
        if (entries_)
            closedir(entries_);
    }

    explicit operator bool() const { return entries_ != nullptr; }
    int folder() const { return folder_; }

    /// Null: that was all.
    char const* next()
    {
        while (dirent const* const entry = readdir(entries_))
            if (std::strcmp(entry->d_name, ".") != 0 && std::strcmp(entry->d_name, "..") != 0)
                return entry->d_name;
        return nullptr;
    }

private:
    int folder_;
    DIR* entries_;
};

/// Takes folders back from the deepest up: one that is ours already has nothing in it that is not.
class Taking
{
public:
    explicit Taking(int top) : top_(top) {}

    bool run()
    {
        bool complete = true;
        do {
            moved_ = false;
            complete = take(openat(top_, ".", as_folder), 0);
        } while (moved_ && complete);
        return complete;
    }

private:
    /// Closes the folder.
    bool take(int folder, int depth)
    {
        Listing listing(folder);
        bool complete = static_cast<bool>(listing);
        while (char const* const name = complete ? listing.next() : nullptr) {
            struct stat status;
            if (fstatat(folder, name, &status, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISDIR(status.st_mode) ||
                status.st_uid == 0)
                continue;
            complete = depth == deepest_taken ? move_up(folder, name)
                                              : take(openat(folder, name, as_folder), depth + 1);
        }
        // The uppermost one last of all: what has been moved into it is not ours yet.
        return complete && ((depth == 0 && moved_) || fchown(folder, 0, 0) == 0);
    }

    bool move_up(int folder, char const* name)
    {
        char other[64];
        do
            std::snprintf(other, sizeof other, ".deep-%lu", number_++);
        while (faccessat(top_, other, F_OK, AT_SYMLINK_NOFOLLOW) == 0);
        moved_ = true;
        return renameat(folder, name, top_, other) == 0;
    }

    int top_;
    bool moved_ = false;
    unsigned long number_ = 0;
};

/// Removes a folder. What is too deep is moved into the uppermost one first.
class Removing
{
public:
    explicit Removing(int top) : top_(top) {}

    /// What is in the uppermost folder.
    bool run()
    {
        do {
            moved_ = false;
            empty(openat(top_, ".", as_folder), 0);
        } while (moved_);
        return error_ == 0;
    }

    int error() const { return error_; }

private:
    /// Closes the folder.
    void empty(int folder, int depth)
    {
        fchmod(folder, S_IRWXU);
        Listing listing(folder);
        if (!listing)
            return fail();
        while (char const* const name = listing.next()) {
            if (unlinkat(folder, name, 0) == 0)
                continue;
            if (errno != EISDIR)
                fail();
            else if (depth == deepest_taken)
                move_up(folder, name);
            else
                remove(folder, name, depth);
        }
    }

    void remove(int folder, char const* name, int depth)
    {
        fchmodat(folder, name, S_IRWXU, 0); // a folder, as unlink has said, and nobody else is at work here
        empty(openat(folder, name, as_folder), depth + 1);
        if (unlinkat(folder, name, AT_REMOVEDIR) != 0)
            fail();
    }

    void move_up(int folder, char const* name)
    {
        char other[64];
        do
            std::snprintf(other, sizeof other, ".deep-%lu", number_++);
        while (faccessat(top_, other, F_OK, AT_SYMLINK_NOFOLLOW) == 0);
        fchmodat(folder, name, S_IRWXU, 0);
        if (renameat(folder, name, top_, other) == 0)
            moved_ = true;
        else
            fail();
    }

    void fail() { error_ = error_ == 0 ? errno : error_; }

    int top_;
    int error_ = 0;
    bool moved_ = false;
    unsigned long number_ = 0;
};

/// Closes the folder.
void count(int folder, int depth, Measured& all)
{
    Listing listing(folder);
    while (char const* const name = listing && !all.is_done() ? listing.next() : nullptr) {
        struct stat status;
        if (fstatat(folder, name, &status, AT_SYMLINK_NOFOLLOW) != 0)
            continue; // removed meanwhile
        all.bytes += static_cast<unsigned long long>(status.st_blocks) * block;
        all.too_many = ++all.files > max_files;
        if (!S_ISDIR(status.st_mode) || all.is_done())
            continue;
        if (depth == deepest_measured)
            all.too_many = true;
        else
            count(openat(folder, name, as_folder), depth + 1, all);
    }
}

int complain()
{
    std::printf("%s\n", std::strerror(errno));
    return 1;
}

/// What we make in a folder belongs to whom the folder belongs to.
void give_as(int folder, int made)
{
    struct stat status;
    if (fstat(folder, &status) == 0)
        (void)!fchown(made, status.st_uid, status.st_gid);
}

/// The folder of the file `name` below `root`, step by step and never through a link; -1: `errno`.
int folder_of(char const* root, std::string const& name, bool make)
{
    int folder = open(root, as_folder);
    std::size_t begin = 0;
    for (auto slash = name.find('/'); folder >= 0 && slash != std::string::npos;
         slash = name.find('/', begin)) {
        auto const step = name.substr(begin, slash - begin);
        begin = slash + 1;
        bool const is_new = make && mkdirat(folder, step.c_str(), 0755) == 0;
        int const next = openat(folder, step.c_str(), as_folder);
        if (is_new && next >= 0)
            give_as(folder, next);
        int const error = errno;
        close(folder);
        errno = error;
        folder = next;
    }
    return folder;
}

bool copy_bytes(int from, int to)
{
    char bytes[64 * 1024];
    ssize_t size = 0;
    while ((size = read(from, bytes, sizeof bytes)) > 0)
        for (ssize_t written = 0; written < size;) {
            ssize_t const count = write(to, bytes + written, static_cast<std::size_t>(size - written));
            if (count < 0)
                return false;
            written += count;
        }
    return size == 0;
}

/// No step of it leads anywhere but down.
bool leads_down(std::string const& name)
{
    auto const whole = "/" + name + "/";
    for (char const* const bad : {"//", "/./", "/../"})
        if (whole.find(bad) != std::string::npos)
            return false;
    return true;
}

} // namespace

bool take_back(char const* folder)
{
    int const top = open(folder, as_folder);
    bool const taken = top >= 0 && Taking(top).run();
    int const error = errno;
    if (top >= 0)
        close(top);
    errno = error;
    return taken;
}

Measured measured(char const* folder, unsigned long long enough)
{
    Measured all;
    all.enough = enough;
    count(open(folder, as_folder), 0, all);
    return all;
}

bool remove_folder(int parent, char const* name)
{
    int const top = openat(parent, name, as_folder);
    if (top < 0)
        return false;
    Removing removing(top);
    bool const is_empty = removing.run();
    close(top);
    if (is_empty)
        return unlinkat(parent, name, AT_REMOVEDIR) == 0;
    errno = removing.error();
    return false;
}

int measure(char const* folder, char const* enough)
{
    auto const all = measured(folder, std::strtoull(enough, nullptr, 10));
    struct statvfs disk
    {};
    statvfs(folder, &disk);
    std::printf("%llu %d %llu\n", all.bytes, all.too_many ? 1 : 0,
                static_cast<unsigned long long>(disk.f_bavail) * disk.f_frsize);
    return 0;
}

int put(char const* from, char const* to, char const* name)
{
    constexpr auto beside = ".webots_cloud-reset"; // who reads the file meanwhile sees the old or the new one
    std::string const path = name;
    if (!leads_down(path)) {
        errno = EINVAL;
        return complain();
    }
    auto const last = path.substr(path.rfind('/') + 1); // npos + 1 is 0
    int const source = folder_of(from, path, false);
    int const pristine =
        source < 0 ? -1 : openat(source, last.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    struct stat status;
    if (pristine < 0 || fstat(pristine, &status) != 0)
        return complain();
    int const target = folder_of(to, path, true);
    if (target < 0)
        return complain();
    // Of an attempt that was cut short.
    unlinkat(target, beside, 0);
    int const copy = openat(target, beside, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (copy < 0)
        return complain();
    bool const copied = copy_bytes(pristine, copy);
    give_as(target, copy);
    if (copied && fchmod(copy, status.st_mode & 0777) == 0 &&
        renameat(target, beside, target, last.c_str()) == 0)
        return 0;
    int const outcome = complain();
    unlinkat(target, beside, 0);
    return outcome;
}

} // namespace webots_cloud::guard
