#include "git_lfs_problem.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/system/errc.hpp>

namespace webots_cloud::core {
namespace {

constexpr std::string_view send_again = "Its author can send it there (git lfs push --all origin)";
constexpr std::string_view not_public =
    "The repository must be public, also its LFS objects, and its owner's quota not used up.";
constexpr std::string_view later = "Try again later.";
constexpr std::string_view out_of_order = "Its LFS server may be out of order.";

std::string_view without_final_stop(std::string_view words) noexcept
{
    return words.substr(0, words.find_last_not_of('.') + 1);
}

} // namespace

Failure LfsProblems::failed(boost::system::error_code code, std::string_view why,
                            std::string_view advice) const
{
    return refused(code, Refused::large_files,
                   {{"repository", repository}, {"why", why}, {"advice", advice}});
}

Failure LfsProblems::explain(Failure const& failure) const
{
    auto const words = failure.message();
    if (failure.code() == boost::system::errc::operation_canceled)
        return failure;
    if (failure == errc::unreachable || failure == errc::timed_out)
        return failed(failure.code(), without_final_stop(words), later);
    if (failure == errc::refused)
        return failed(failure.code(), concat("the LFS server ", words),
                      "Only hosts of the Internet, and the forge itself, are asked for files.");
    return failed(failure.code(), without_final_stop(words), out_of_order);
}

Failure LfsProblems::about_batch(int status) const
{
    auto const says = concat("the LFS server answers with status ", std::to_string(status));
    switch (status) {
    case 401:
    case 403:
        return failed(errc::refused, says, not_public);
    case 404:
    case 405:
    case 410:
    case 501:
        return failed(
            errc::not_found, concat(forge, " has no LFS server for it"),
            "Commit them as ordinary files, or keep the repository where there is one; what .lfsconfig "
            "names is not asked.");
    case 429:
        return failed(errc::unreachable, says, "It is asked too often: try again later.");
    case 507:
    case 509:
        return failed(errc::refused, says, "Its owner's LFS quota is used up.");
    default:
        return failed(status >= 500 ? errc::unreachable : errc::protocol_error, says,
                      status >= 500 ? later : out_of_order);
    }
}

Failure LfsProblems::about_object(std::string_view path, int status, std::string_view words) const
{
    auto const said = words.empty() ? std::string() : concat(" (it says: ", without_final_stop(words), ")");
    if (status == 0 || status == 404 || status == 410)
        return failed(errc::not_found, concat("the LFS server does not have ", path, said),
                      concat(send_again, "; what .lfsconfig names is not asked."));
    auto const answers =
        concat("the LFS server answers with status ", std::to_string(status), " for ", path, said);
    if (status == 401 || status == 403)
        return failed(errc::refused, answers, not_public);
    if (status == 507 || status == 509)
        return failed(errc::refused, answers, "Its owner's LFS quota is used up.");
    if (status == 429 || status >= 500)
        return failed(errc::unreachable, answers, later);
    return failed(errc::protocol_error, answers, out_of_order);
}

Failure LfsProblems::about_content(std::string_view path) const
{
    return failed(errc::protocol_error, concat("the LFS server sends something else for ", path),
                  concat(send_again, "."));
}

Failure LfsProblems::about_extension(std::string_view path) const
{
    return failed(errc::refused,
                  concat(path, " has to pass through a program that its author names (an LFS extension)"),
                  "Such programs are never run here: its author can commit the file without.");
}

} // namespace webots_cloud::core
