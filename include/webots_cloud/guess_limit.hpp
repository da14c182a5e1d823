// How often somebody may be wrong about a password, a token or a code.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <memory>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Wrong ones: how many at once, and how many a second in the long run. Either 0: no limit.
struct Guesses
{
    Guesses() = default;
    constexpr Guesses(std::size_t burst, double a_second) : burst(burst), a_second(a_second) {}

    std::size_t burst = 0;
    double a_second = 0;
};

/// Counts wrong guesses of each client, and of all together, since an attacker may have many addresses. Who
/// has used them up may not even try: otherwise the right one would be found as fast as ever. Where all
/// together have, a client that has guessed nothing wrong for an hour still may, once: so nobody shuts
/// strangers out, and each of many addresses gains one guess.
///
/// Clients are told apart by `IncomingRequest::quota_key`. One with a public address of IPv6 also counts as
/// part of the /56 and the /48 that it is in, which may be all its own. The empty key belongs to no client,
/// and counts among all.
/// Thread-safety: one thread at a time.
class GuessLimit
{
public:
    GuessLimit(Guesses of_client, Guesses of_all);
    GuessLimit(GuessLimit const&) = delete;
    GuessLimit& operator=(GuessLimit const&) = delete;
    ~GuessLimit();

    bool may_try(std::string_view client, TimePoint now) const;

    /// To be called before anybody else's guess is looked at.
    void count_wrong(std::string_view client, TimePoint now);

private:
    struct Impl;

    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
