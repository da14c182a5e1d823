#include "start_refusal.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <initializer_list>

namespace webots_cloud::core {
namespace {

bool is_one_of(Failure const& failure, std::initializer_list<errc> codes)
{
    return std::any_of(codes.begin(), codes.end(), [&](errc code) { return failure == code; });
}

/// Codes that are not ours come from this machine's system: its disk is full, or it has no files left.
bool is_of_the_system(Failure const& failure)
{
    return failure.code().category() != webots_cloud_category();
}

} // namespace

StartRefusal refusal_at(StartStep step, Failure const& failure)
{
    if (auto const known = where_refused(failure); known && step != StartStep::website) {
        // A machine that has no port left after a fetch is not full: others have taken its ports.
        bool const is_late = *known == StartRefusal::full && step != StartStep::admission;
        return is_late ? StartRefusal::here : *known;
    }
    auto const here_if = [](bool is_here) { return is_here ? StartRefusal::here : StartRefusal::everywhere; };
    switch (step) {
    case StartStep::admission:
        return failure == errc::unavailable ? StartRefusal::full : here_if(failure != errc::invalid_url);
    case StartStep::repository:
        // `refused` comes from a server of large files. Another machine may reach what this one can't reach,
        // or have it in its cache.
        return here_if(is_of_the_system(failure) ||
                       is_one_of(failure, {errc::unavailable, errc::unreachable}));
    case StartStep::website:
        // Which templates and keys there are is a matter of this machine's operator.
        return here_if(is_of_the_system(failure) || is_one_of(failure, {errc::unavailable, errc::unreachable,
                                                                        errc::refused, errc::not_found}));
    case StartStep::launch:
        return here_if(!is_one_of(failure, {errc::invalid_argument, errc::too_large}));
    }
    return StartRefusal::everywhere;
}

std::string_view refusal_message(StartRefusal refusal) noexcept
{
    switch (refusal) {
    case StartRefusal::everywhere:
        return {};
    case StartRefusal::here:
        return "refusal: machine";
    case StartRefusal::full:
        return "refusal: full";
    }
    return {};
}

std::string needs_message(std::vector<std::string> const& labels)
{
    return concat("refusal: needs ", join({labels.begin(), labels.end()}, " "));
}

} // namespace webots_cloud::core
