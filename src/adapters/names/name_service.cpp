#include "core/access/ip_address.hpp"
#include "core/text.hpp"
#include "name_channel.hpp"

#include <webots_cloud/adapters/names.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <memory>
#include <optional>
#include <utility>

namespace webots_cloud {

namespace asio = boost::asio;
using core::concat;

namespace {

/// An answer that somebody waits for.
template<class Answer>
struct Awaited
{
    Awaited(asio::any_io_executor const& executor, TimePoint deadline) : timer(executor, deadline) {}

    asio::steady_timer timer; ///< Is cancelled by the answer.
    std::optional<result<Answer>> answer;
};

template<class Answer>
asio::awaitable<result<Answer>> wait_for(std::shared_ptr<Awaited<Answer>> awaited, std::string name)
{
    auto const [cancelled] = co_await awaited->timer.async_wait(asio::as_tuple(asio::use_awaitable));
    if (awaited->answer)
        co_return std::move(*awaited->answer);
    if (cancelled)
        co_return Failure(asio::error::operation_aborted);
    co_return Failure(errc::unreachable, concat("the name ", core::printable(name, 255),
                                                " can't be resolved: no answer in time"));
}

/// Lookups that each have a deadline of their own: an answer that comes later finds nobody waiting.
class CaresNameService final : public NameService
{
public:
    CaresNameService(asio::any_io_executor executor, std::string servers)
        : executor_(executor), channel_(std::move(executor), std::move(servers))
    {}

    asio::awaitable<result<NameAnswer>> addresses(std::string name, TimePoint deadline) override
    {
        using Named = adapters::NamedAddresses;
        auto const awaited = std::make_shared<Awaited<Named>>(executor_, deadline);
        channel_.ask_addresses(name, false, [awaited](result<Named> answer) {
            awaited->answer = std::move(answer);
            awaited->timer.cancel();
        });
        auto const named = co_await wait_for(awaited, name);
        if (!named)
            co_return named.error();
        NameAnswer answer;
        for (auto const& address : named->addresses)
            answer.addresses.push_back(address.to_string());
        answer.ttl = named->ttl;
        if (answer.addresses.empty())
            co_return Failure(errc::not_found,
                              concat("the name ", core::printable(name, 255), " has no addresses"));
        co_return answer;
    }

    asio::awaitable<result<NameAnswer>> services(std::string name, TimePoint deadline) override
    {
        auto const awaited = std::make_shared<Awaited<NameAnswer>>(executor_, deadline);
        channel_.ask_services(name, [awaited](result<NameAnswer> answer) {
            awaited->answer = std::move(answer);
            awaited->timer.cancel();
        });
        auto answer = co_await wait_for(awaited, name);
        if (answer && answer->services.empty())
            co_return Failure(errc::not_found,
                              concat("the name ", core::printable(name, 255), " has no services"));
        co_return answer;
    }

private:
    asio::any_io_executor executor_;
    adapters::NameChannel channel_;
};

/// c-ares takes a colon for the beginning of a port.
std::string in_brackets(std::string const& server)
{
    auto const address = core::IpAddress::parse(server);
    return address && !address->is_v4() ? concat("[", server, "]") : server;
}

} // namespace

std::unique_ptr<NameService> make_name_service(asio::any_io_executor executor,
                                               std::vector<std::string> const& servers)
{
    std::string list;
    for (auto const& server : servers)
        list += concat(list.empty() ? "" : ",", in_brackets(server));
    return std::make_unique<CaresNameService>(std::move(executor), std::move(list));
}

} // namespace webots_cloud
