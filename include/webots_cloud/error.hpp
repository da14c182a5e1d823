// How every operation of this library fails: a code that a caller can act on, and a sentence for a person.
#pragma once

#include <webots_cloud/export.hpp>

#include <boost/system/error_code.hpp>
#include <boost/system/result.hpp>
#include <boost/system/system_error.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What a caller can do something about. Codes of other libraries pass through unchanged beside these.
enum class errc
{
    invalid_argument = 1, ///< A parameter is unusable; `detail` names it.
    invalid_config,       ///< A configuration file is unusable; `detail` names file, key, found and wanted.
    invalid_url,          ///< The address of a world, a server or a host can't be understood.
    refused,              ///< The operator's policy forbids it (repository, host, draining).
    unavailable,          ///< Nothing is free at the moment: no server, port or slot. Try again later.
    not_found,            ///< The repository, branch, folder or file does not exist.
    unreachable,          ///< The peer can't be reached: name, connection or TLS failed.
    timed_out,            ///< The deadline passed before the peer answered.
    too_large,            ///< A message, file or project exceeds its limit.
    protocol_error,       ///< The peer's answer makes no sense.
    start_failed,         ///< The simulator could not be started, or ended before it was ready.
    closed                ///< The other side has gone; nothing more can be sent or received.
};

/// The category of `errc`; its name is "webots_cloud".
boost::system::error_category const& webots_cloud_category() noexcept;

boost::system::error_code make_error_code(errc code) noexcept;

/// What a sentence says, for programs: which refusal it is, and what varies in it. The sentence itself is for
/// people, and may change.
struct FailureInfo
{
    FailureInfo() = default;

    std::string_view code; ///< Such as "no-repository" (docs/messages.md); it lives as long as the program.
    std::vector<std::pair<std::string_view, std::string>> arguments; ///< By name; the names live as long.
};

/// An error code and what a person should know about it.
///
/// Made implicitly from an `errc` or any `error_code`; compares equal to a code whatever its detail says.
class Failure
{
public:
    Failure() = default;
    Failure(errc code, std::string detail = {}) : code_(make_error_code(code)), detail_(std::move(detail)) {}
    Failure(boost::system::error_code code, std::string detail = {}) : code_(code), detail_(std::move(detail))
    {}
    Failure(boost::system::error_code code, std::string detail, FailureInfo info)
        : code_(code), detail_(std::move(detail)), info_(std::make_shared<FailureInfo const>(std::move(info)))
    {}

    boost::system::error_code code() const noexcept { return code_; }

    /// The sentence given when the failure was made, possibly empty.
    std::string const& detail() const& noexcept { return detail_; }
    // result<T>::error() returns by value in Boost 1.81: a reference into that temporary would dangle.
    std::string detail() && noexcept { return std::move(detail_); }

    /// `detail()`, or the message of the code where there is none: never empty.
    std::string message() const { return detail_.empty() ? code_.message() : detail_; }

    /// What the sentence says; null for a failure that no visitor is to be told of, or whose sentence has no
    /// code. Valid as long as this failure or a copy of it.
    FailureInfo const* info() const noexcept { return info_.get(); }

    /// The same failure, said with `context` and ": " in front; without `info()`, as the sentence is another.
    Failure within(std::string_view context) const
    {
        return Failure(code_, std::string(context).append(": ").append(message()));
    }

    friend bool operator==(Failure const& failure, errc code) noexcept
    {
        return failure.code_ == make_error_code(code);
    }
    friend bool operator==(Failure const& left, Failure const& right) noexcept
    {
        return left.code_ == right.code_;
    }

private:
    boost::system::error_code code_;
    std::string detail_;
    std::shared_ptr<FailureInfo const> info_;
};

/// Found by argument-dependent lookup when `.value()` is called on a failed result.
[[noreturn]] inline void throw_exception_from_error(Failure const& failure, boost::source_location const&)
{
    throw boost::system::system_error(failure.code(), failure.message());
}

/// A value, or why there is none.
template<class T = void>
using result = boost::system::result<T, Failure>;

} // namespace webots_cloud

// Doxygen 1.9 can't place a specialisation of another namespace's template.
//! @cond
template<>
struct boost::system::is_error_code_enum<webots_cloud::errc> : std::true_type
{};
//! @endcond
