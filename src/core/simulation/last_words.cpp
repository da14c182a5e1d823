#include "last_words.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <iterator>

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_line_length = 400;

/// What errors of Webots, Qt, the dynamic linker, Python, shells, Docker and compilers have in common.
constexpr std::string_view signs[] = {
    "error",     "fatal",         "cannot",   "can't",     "could not", "couldn't", "unable",    "failed",
    "failure",   "invalid",       "no such",  "not found", "denied",    "refused",  "exception", "missing",
    "terminate", "not supported", "segfault", "abort",     " fault"}; // and no default

bool speaks_of_an_error(std::string_view line)
{
    auto const lower = lower_case(line);
    return std::any_of(std::begin(signs), std::end(signs),
                       [&](std::string_view sign) { return lower.find(sign) != std::string::npos; });
}

} // namespace

void LastWords::add(std::string_view line)
{
    line = trim(line).substr(0, max_line_length);
    if (line.empty())
        return;
    bool const is_error = speaks_of_an_error(line);
    if (is_error_ && !is_error)
        return;
    is_error_ = is_error;
    text_ = line;
}

std::string last_words(std::string_view output)
{
    LastWords words;
    for (auto const line : split(output, '\n'))
        words.add(line);
    return words.text();
}

} // namespace webots_cloud::core
