#include "passed_headers.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

template<class Table>
bool is_passed(Table const& table, std::string_view name, UpstreamKind upstream) noexcept
{
    return std::any_of(table.begin(), table.end(), [name, upstream](PassedHeader const& header) {
        return header.name.size() == name.size() && upstream >= header.least &&
               equal_ignoring_case(header.name, name);
    });
}

} // namespace

bool is_request_header_passed(std::string_view name, UpstreamKind upstream) noexcept
{
    return is_passed(passed_request_headers, name, upstream);
}

bool is_answer_header_passed(std::string_view name, UpstreamKind upstream) noexcept
{
    return is_passed(passed_answer_headers, name, upstream);
}

} // namespace webots_cloud::core
