#include "deadline.hpp"

namespace webots_cloud::async {

Part expire(Clock& clock, TimePoint when)
{
    auto const waited = co_await clock.wait_until(when);
    if (!waited)
        co_return waited.error();
    co_return Failure(errc::timed_out);
}

} // namespace webots_cloud::async
