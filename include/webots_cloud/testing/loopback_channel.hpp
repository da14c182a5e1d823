// A WebSocket whose browser is the test.
#pragma once

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Messages of the service are in `sent`; the functions below are the actions of the browser.
class LoopbackChannel final : public Channel
{
public:
    explicit LoopbackChannel(boost::asio::any_io_executor executor);
    ~LoopbackChannel() override;

    void browser_says(std::string text);
    void browser_leaves(std::uint16_t code = 0); ///< It closes the connection.
    void browser_is_lost();                      ///< Its connection breaks without a close frame.

    result<> send(std::string text) override;
    boost::asio::awaitable<result<std::string>> receive() override;
    void close(std::uint16_t code = 0, std::string reason = {}) override;
    std::size_t queued() noexcept override { return unread; }
    std::uint16_t farewell() const noexcept override;

    /// True when `sent` has a message that starts with `text`.
    bool was_told(std::string_view text) const;

    std::vector<std::string> sent;
    std::size_t unread = 0;                  ///< What `queued` says.
    std::optional<std::uint16_t> close_code; ///< Set when the service has closed it.

private:
    struct Inbox;
    std::unique_ptr<Inbox> inbox_;
};

} // namespace webots_cloud::testing
