// Has machines keep simulations ready for the seats of classes (protocol section 13.20).
#pragma once

#include "async/task_group.hpp"
#include "core/classes/class_staging.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

struct ClassStagerHooks
{
    ClassStagerHooks() = default;

    WebSocketClient* websockets = nullptr; ///< Null: nothing is staged.
    /// As SessionServiceHooks::make_ticket.
    std::function<std::string(std::string_view server)> make_ticket;
};

/// Has a connection to each machine that has something ready for classes, for as long as it has.
///
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class ClassStager
{
public:
    ClassStager(Fleet const& fleet, LoadMonitor const& monitor, Clock& clock, Logger log,
                ClassStagerHooks hooks)
        : fleet_(fleet), monitor_(monitor), clock_(clock), log_(std::move(log)), hooks_(std::move(hooks))
    {}

    /// Cancellation: terminal; then nothing is staged any more.
    boost::asio::awaitable<result<>> run();

    /// To be called about once a second: these are the seats that classes have not used. Returns as
    /// core::ClassStaging::ready.
    std::vector<int> update(std::vector<core::StagingWish> classes, bool tls);

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
    void speak(std::string const& machine, Link& link, bool tls);
    void say(Link& link, std::vector<core::StagingWish> wishes);
    boost::asio::awaitable<void> keep(std::string machine, WebSocketRequest request);
    boost::asio::awaitable<std::string> converse(std::string machine, WebSocketRequest request);

    Fleet const& fleet_;
    LoadMonitor const& monitor_;
    Clock& clock_;
    Logger log_;
    ClassStagerHooks hooks_;
    core::ClassStaging staging_;
    std::map<std::string, Link> links_;     ///< By machine.
    std::optional<async::TaskGroup> tasks_; ///< While `run` is awaited.
};

} // namespace webots_cloud
