// Pictures that the test says.
#pragma once

#include <webots_cloud/transport/picture_taker.hpp>

#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Every simulator shows what the test says.
class FixedPictureTaker final : public PictureTaker
{
public:
    boost::asio::awaitable<result<std::string>> take(Upstream simulator) override
    {
        asked.push_back(std::move(simulator));
        co_return picture;
    }

    result<std::string> picture = Failure(errc::timed_out);
    std::vector<Upstream> asked; ///< In order.
};

} // namespace webots_cloud::testing
