#include "sandbox_check.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace webots_cloud::core {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 5> possible{{
    {"file", "read files of the server"},
    {"port", "connect to services of this machine"},
    {"process", "signal the server"},
    {"write", "change files of the system"},
    {"kernel", "change settings of the kernel"},
}};
constexpr std::string_view tried = "tried";

} // namespace

std::vector<std::string> try_forbidden_things(std::filesystem::path const& guard,
                                              std::filesystem::path const& file, std::uint16_t port,
                                              int process)
{
    return {guard.native(), "--try", file.native(), std::to_string(port), std::to_string(process)};
}

result<> judge_sandbox(std::string_view printed)
{
    auto const words = split(trim(printed), ' ');
    if (words.empty() || words.front() != tried)
        return Failure(errc::protocol_error,
                       concat("a program in it says \"", printable(trim(printed), 200), "\""));
    std::string all;
    for (auto const& [word, text] : possible)
        if (std::find(words.begin() + 1, words.end(), word) != words.end())
            all.append(all.empty() ? "" : " and ").append(text);
    if (!all.empty())
        return Failure(errc::refused, concat("a simulation could ", all));
    return {};
}

} // namespace webots_cloud::core
