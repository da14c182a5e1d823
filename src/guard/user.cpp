// Gives a project to another user and makes the way to it passable, before any program of that user runs.
// Links are not followed, and files with a second name are left alone: either could lead out of the project.
#include "user.hpp"

#include <fcntl.h>
#include <ftw.h>
#include <grp.h>
#include <sys/fsuid.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace webots_cloud::guard {
namespace {

constexpr int descriptors_for_walk = 32;         // for nftw: deeper folders take turns
constexpr std::size_t max_authority = 64 * 1024; // bytes

User const* receiver = nullptr; // of the files that nftw finds: it passes nothing on

int give(char const* path, struct stat const* status, int type, FTW*)
{
    // A file with another name elsewhere would change hands there, too.
    if (type == FTW_F && S_ISREG(status->st_mode) && status->st_nlink > 1)
        return FTW_CONTINUE;
    // What only root may look into stays so: the server's part of a project. Others have none, but may give
    // everything this mode (umask).
    bool const is_closed =
        !receiver->is_subordinate && type == FTW_D && (status->st_mode & (S_IRWXG | S_IRWXO)) == 0;
    if (is_closed && std::strcmp(path, receiver->folder) != 0)
        return FTW_SKIP_SUBTREE;
    return lchown(path, receiver->user, receiver->groups[0]) == 0 ? FTW_CONTINUE : FTW_STOP;
}

/// A number that is not root's.
bool read_number(char const*& text, unsigned& number)
{
    char* end = nullptr;
    errno = 0;
    unsigned long const value = std::strtoul(text, &end, 10);
    if (end == text || errno != 0 || value == 0 || value >= 0xFFFFFFFFUL)
        return false;
    text = end;
    number = static_cast<unsigned>(value);
    return true;
}

bool read_groups(char const* text, User& user)
{
    for (user.group_count = 0; user.group_count < User::max_groups;) {
        if (!read_number(text, user.groups[user.group_count++]))
            return false;
        if (*text == '\0')
            return true;
        if (*text++ != ',')
            return false;
    }
    return false;
}

void copy_authority(User const& user, int home)
{
    int const source = open(user.authority, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    std::vector<char> text(max_authority);
    ssize_t const size = source < 0 ? -1 : read(source, text.data(), text.size());
    if (source >= 0)
        close(source);
    if (size <= 0)
        return; // no password
    int const copy = openat(home, "Xauthority", O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (copy < 0)
        return;
    bool const is_whole = write(copy, text.data(), static_cast<std::size_t>(size)) == size &&
                          fchown(copy, user.user, user.groups[0]) == 0;
    close(copy);
    if (!is_whole)
        unlinkat(home, "Xauthority", 0);
}

/// While it exists, files are looked up with the rights of the user.
class AsUser
{
public:
    explicit AsUser(User const& user)
    {
        setgroups(static_cast<std::size_t>(user.group_count), user.groups);
        setfsgid(user.groups[0]);
        setfsuid(user.user);
    }
    AsUser(AsUser const&) = delete;
    ~AsUser()
    {
        setfsuid(0);
        setfsgid(0);
    }
};

/// The uppermost folder on the way to `path` that the user may not search; empty: there is none.
std::string find_barrier(User const& user, std::string const& path)
{
    AsUser const lookup(user);
    struct stat status;
    for (auto slash = path.find('/', 1); slash != std::string::npos; slash = path.find('/', slash + 1)) {
        auto const folder = path.substr(0, slash);
        if (stat((folder + "/.").c_str(), &status) != 0 && errno == EACCES)
            return folder;
    }
    return {};
}

/// Something that has to be seen at its own path although a folder above it is covered.
struct Shown
{
    std::string path;
    std::string barrier;
    int opened = -1;
    bool is_folder = false;
};

/// Hides what is in a folder under an empty one in memory, through which everybody may go.
bool cover(std::string const& folder)
{
    return mount("tmpfs", folder.c_str(), "tmpfs", MS_NOSUID | MS_NODEV,
                 "mode=0711,size=256k,nr_inodes=2k") == 0;
}

/// Mounts it where it was, below the cover of the folder above it.
bool place(Shown const& shown)
{
    for (auto slash = shown.path.find('/', shown.barrier.size() + 1); slash != std::string::npos;
         slash = shown.path.find('/', slash + 1))
        mkdir(shown.path.substr(0, slash).c_str(), 0711);
    if (shown.is_folder)
        mkdir(shown.path.c_str(), 0711);
    else
        close(open(shown.path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
    auto const source = "/proc/self/fd/" + std::to_string(shown.opened);
    return mount(source.c_str(), shown.path.c_str(), nullptr, MS_BIND | MS_REC, nullptr) == 0;
}

} // namespace

bool take_user(int& argc, char**& argv, User& user)
{
    if (argc == 0 || std::strcmp(argv[0], "--user") != 0)
        return true;
    if (argc < 6)
        return false;
    char const* number = argv[1];
    if (!read_number(number, user.user) || *number != '\0' || !read_groups(argv[2], user))
        return false;
    user.is_other = true;
    user.folder = argv[3];
    user.home = argv[4];
    user.authority = argv[5];
    argc -= 6;
    argv += 6;
    char** const visible = argv;
    user.visible = visible;
    for (; argc > 1 && std::strcmp(argv[0], "--visible") == 0; argc -= 2, argv += 2)
        visible[user.visible_count++] = argv[1];
    return true;
}

bool hand_over(User const& user)
{
    if (*user.folder == '\0')
        return true;
    if (mkdir(user.home, 0700) != 0) // nor if the project has it: it could be a link
        return false;
    int const home = open(user.home, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (home < 0)
        return false;
    if (*user.authority != '\0')
        copy_authority(user, home);
    bool const given = fchown(home, user.user, user.groups[0]) == 0;
    close(home);
    receiver = &user;
    return given && nftw(user.folder, give, descriptors_for_walk, FTW_PHYS | FTW_ACTIONRETVAL) == 0 &&
           chmod(user.folder, 0700) == 0;
}

bool show_to(User const& user)
{
    std::vector<Shown> all;
    auto const look_at = [&](char const* path) {
        if (*path == '\0')
            return;
        Shown shown;
        shown.path = path;
        shown.barrier = find_barrier(user, shown.path);
        struct stat status;
        if (shown.barrier.empty() || stat(path, &status) != 0)
            return;
        shown.is_folder = S_ISDIR(status.st_mode);
        shown.opened = open(path, O_PATH | O_CLOEXEC);
        all.push_back(shown);
    };
    // First everything is opened, as long as there is a way to it; then the ways are covered; then it is put
    // back in place, where the user can get to it.
    look_at(user.folder);
    for (int i = 0; i < user.visible_count; ++i)
        look_at(user.visible[i]);
    if (all.empty())
        return true;
    char here[PATH_MAX];
    bool const is_known = getcwd(here, sizeof here) != nullptr;
    std::vector<std::string> covered;
    bool complete = true;
    // A folder that hides several of them is covered once.
    for (auto const& shown : all) {
        bool is_new = true;
        for (auto const& each : covered)
            is_new = is_new && each != shown.barrier;
        if (!is_new)
            continue;
        covered.push_back(shown.barrier);
        complete = cover(shown.barrier) && complete;
    }
    mode_t const mask = umask(0); // else the user may not search what is made on the way
    for (auto const& shown : all) {
        complete = complete && place(shown);
        close(shown.opened);
    }
    umask(mask);
    // What was made on the way is nobody's to change.
    for (auto const& folder : covered)
        mount(nullptr, folder.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY | MS_NOSUID | MS_NODEV,
              nullptr);
    // Where we are is below the covers, and so would be all that `..` leads to.
    return complete && is_known && chdir(here) == 0;
}

bool hide(char const* folder)
{
    return mount("tmpfs", folder, "tmpfs", MS_NOSUID | MS_NODEV | MS_RDONLY, "mode=0000,size=4k") == 0;
}

bool become(User const& user)
{
    return setgroups(static_cast<std::size_t>(user.group_count), user.groups) == 0 &&
           setresgid(user.groups[0], user.groups[0], user.groups[0]) == 0 &&
           setresuid(user.user, user.user, user.user) == 0 && setuid(0) != 0;
}

} // namespace webots_cloud::guard
