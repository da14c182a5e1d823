// Slows down those who guess passwords, tokens or codes.
#pragma once

#include "token_buckets.hpp"

#include <cstddef>
#include <string_view>

namespace webots_cloud::core {

/// Wrong ones: how many at once, and how many a second in the long run.
struct Guesses
{
    std::size_t burst;
    double a_second;
};

/// Of a password or token that few people have, of one client and of all together.
inline constexpr Guesses passwords_of_client{10, 0.1};
inline constexpr Guesses passwords_of_all{50, 0.5};

/// Counts wrong guesses of each client, and of all together, since an attacker may have many addresses. Who
/// has used them up may not even try: otherwise the right one would be found as fast as ever. Where all
/// together have, a client that has guessed nothing wrong for an hour still may, once: so nobody shuts
/// strangers out, and each of many addresses gains one guess.
class GuessLimit
{
public:
    GuessLimit(Guesses of_client, Guesses of_all)
        : clients_(of_client.burst, of_client.a_second), all_(of_all.burst, of_all.a_second, 1)
    {}

    bool may_try(std::string_view client, TimePoint now) const
    {
        return clients_.has_token(client, now) &&
               (all_.has_token(everybody_, now) || (!client.empty() && strangers_.has_token(client, now)));
    }

    void count_wrong(std::string_view client, TimePoint now)
    {
        (void)clients_.take(client, now);
        (void)all_.take(everybody_, now);
        (void)strangers_.take(client, now);
    }

private:
    static constexpr std::string_view everybody_ = "all";

    TokenBuckets clients_;
    TokenBuckets all_;
    TokenBuckets strangers_{1, 1.0 / 3600};
};

} // namespace webots_cloud::core
