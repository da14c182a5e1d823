// Has machines keep simulations ready for the seats of classes (protocol section 13.20).
#pragma once

#include "async/task_group.hpp"
#include "core/classes/class_staging.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Has a connection to each machine that has something ready for classes, for as long as it has.
///
/// Lifetime: the site must outlive it.   Thread-safety: one executor.
class ClassStager
{
public:
    explicit ClassStager(SiteContext const& site) : site_(site) {}

    /// Cancellation: terminal; then nothing is staged any more.
    boost::asio::awaitable<result<>> run();

    /// To be called about once a second: these are the seats that classes have not used. Returns as
    /// core::ClassStaging::ready.
    std::vector<int> update(std::vector<core::StagingWish> classes);

private:
    struct Link
    {
        bool is_open = false; ///< Its task runs.
        std::unique_ptr<Channel> channel;
        std::vector<core::StagingWish> said;
        TimePoint said_at{};
        TimePoint next_try{};
    };

    std::vector<core::StagingMachine> machines() const;
    void speak(std::string const& machine, Link& link);
    void say(Link& link, std::vector<core::StagingWish> wishes);
    boost::asio::awaitable<void> keep(std::string machine, WebSocketRequest request);
    boost::asio::awaitable<std::string> converse(std::string machine, WebSocketRequest request);

    SiteContext const& site_;
    core::ClassStaging staging_;
    std::map<std::string, Link> links_;     ///< By machine.
    std::optional<async::TaskGroup> tasks_; ///< While `run` is awaited.
};

} // namespace webots_cloud
