#include "token_buckets.hpp"

#include <webots_cloud/guess_limit.hpp>

namespace webots_cloud {
namespace {

constexpr std::string_view everybody = "all";

} // namespace

struct GuessLimit::Impl
{
    core::TokenBuckets clients;
    core::TokenBuckets all;
    core::TokenBuckets strangers{1, 1.0 / 3600};
};

GuessLimit::GuessLimit(Guesses of_client, Guesses of_all)
    : impl_(std::make_unique<Impl>(Impl{core::TokenBuckets(of_client.burst, of_client.a_second),
                                        core::TokenBuckets(of_all.burst, of_all.a_second, 1)}))
{}

GuessLimit::~GuessLimit() = default;

bool GuessLimit::may_try(std::string_view client, TimePoint now) const
{
    return impl_->clients.has_token(client, now) &&
           (impl_->all.has_token(everybody, now) ||
            (!client.empty() && impl_->strangers.has_token(client, now)));
}

void GuessLimit::count_wrong(std::string_view client, TimePoint now)
{
    (void)impl_->clients.take(client, now);
    (void)impl_->all.take(everybody, now);
    (void)impl_->strangers.take(client, now);
}

} // namespace webots_cloud
