#include "process_tree.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <charconv>

namespace webots_cloud::adapters {
namespace {

void add_children(pid_t parent, std::size_t max, ProcessTree& tree)
{
    ProcBuffer buffer;
    auto const id = std::to_string(parent);
    auto list = read_start("/proc/" + id + "/task/" + id + "/children", buffer);
    if (list.size() == buffer.size()) { // cut off, and the last number perhaps in the middle
        tree.is_whole = false;
        list = list.substr(0, list.rfind(' '));
    }
    while (auto const child = next_number(list)) {
        if (tree.processes.size() == max) {
            tree.is_whole = false;
            return;
        }
        tree.processes.push_back(static_cast<pid_t>(child));
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
    tree.processes.push_back(root);
    for (std::size_t i = 0; i < tree.processes.size(); ++i)
        add_children(tree.processes[i], max, tree);
    return tree;
}

} // namespace webots_cloud::adapters
