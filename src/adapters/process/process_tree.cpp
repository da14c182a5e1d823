#include "process_tree.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <memory>

namespace webots_cloud::adapters {
namespace {

constexpr nlink_t links_of_folder = 2;      // besides one for each folder in it
constexpr std::size_t threads_for_each = 4; // of the processes that are looked at, on average

void add_children(std::string const& thread, std::size_t max, ProcessTree& tree)
{
    int const list = ::open((thread + "/children").c_str(), O_RDONLY | O_CLOEXEC);
    if (list < 0)
        return; // it has ended
    ProcBuffer buffer;
    std::size_t held = 0; // of the last read: a number that goes on in the next one
    while (tree.is_whole) {
        auto const size = ::read(list, buffer.data() + held, buffer.size() - held);
        std::string_view const text(buffer.data(),
                                    held + static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
        auto numbers = size > 0 ? text.substr(0, text.rfind(' ') + 1) : text;
        auto const rest = text.substr(numbers.size());
        while (auto const child = next_number(numbers)) {
            tree.is_whole = tree.processes.size() < max;
            if (!tree.is_whole)
                break;
            tree.processes.push_back(static_cast<pid_t>(child));
        }
        if (size <= 0)
            break;
        held = rest.copy(buffer.data(), rest.size());
    }
    ::close(list);
}

/// Children are those of the thread that started them.
void add_children_of_threads(pid_t process, std::size_t max, std::size_t& threads, ProcessTree& tree)
{
    auto const id = std::to_string(process);
    auto const tasks = "/proc/" + id + "/task";
    add_children(tasks + "/" + id, max, tree);
    struct stat status
    {};
    // Most processes have one thread, which the number of folders tells without reading them.
    if (::stat(tasks.c_str(), &status) != 0 || status.st_nlink <= links_of_folder + 1)
        return;
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(::opendir(tasks.c_str()), &::closedir);
    while (auto const* const entry = listing ? ::readdir(listing.get()) : nullptr) {
        if (entry->d_name[0] == '.' || id == entry->d_name)
            continue;
        if (++threads > threads_for_each * max) {
            tree.is_whole = false;
            return;
        }
        add_children(tasks + "/" + entry->d_name, max, tree);
    }
}

} // namespace

std::string_view read_start(std::string const& path, ProcBuffer& buffer)
{
    int const file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return {};
    auto const size = ::read(file, buffer.data(), buffer.size());
    ::close(file);
    return {buffer.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
}

long long next_number(std::string_view& list)
{
    long long value = 0;
    auto const start = list.find_first_not_of(' ');
    list.remove_prefix(start == std::string_view::npos ? list.size() : start);
    auto const end = std::from_chars(list.data(), list.data() + list.size(), value).ptr;
    list.remove_prefix(static_cast<std::size_t>(end - list.data()));
    return value;
}

ProcessTree process_tree(pid_t root, std::size_t max)
{
    ProcessTree tree;
    std::size_t threads = 0;
    tree.processes.push_back(root);
    for (std::size_t i = 0; i < tree.processes.size(); ++i)
        add_children_of_threads(tree.processes[i], max, threads, tree);
    return tree;
}

} // namespace webots_cloud::adapters
