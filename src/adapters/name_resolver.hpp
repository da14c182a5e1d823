// Names of other servers and their addresses.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

using Addresses = std::vector<boost::asio::ip::address>;

/// What knows names; blocks for as long as it takes, and does not throw.   Errors: `unreachable`.
/// Thread-safety: any thread.
using NameLookup = std::function<result<Addresses>(std::string const& name)>;

/// As this computer is configured (`/etc/hosts`, DNS, mDNS and whatever else there is): the C library's
/// `getaddrinfo`.
result<Addresses> look_up(std::string const& name);

/// Looks names up, each on a thread of its own: a name whose servers do not answer delays no other.
///
/// A name is looked up once at a time for all who ask; beyond the most threads, names wait for their turn. A
/// lookup can't be ended, so the destructor leaves those that hang to themselves.   Thread-safety: one
/// executor.
class NameResolver
{
public:
    explicit NameResolver(boost::asio::any_io_executor executor, NameLookup lookup = look_up,
                          std::size_t most_threads = 64);
    ~NameResolver();

    /// Cancellation: terminal.   Errors: `unreachable`, also when there is no answer at `deadline`;
    /// `operation_aborted`.
    boost::asio::awaitable<result<Addresses>> resolve(std::string name, TimePoint deadline);

private:
    struct Question;
    struct Home;

    void start_lookups();
    void take_answer(std::string const& name, result<Addresses> answer);
    static void answer(std::string const& name, NameLookup const& lookup, std::shared_ptr<Home> const& home);

    boost::asio::any_io_executor executor_;
    NameLookup lookup_;
    std::size_t free_threads_;
    std::map<std::string, std::shared_ptr<Question>> questions_; ///< Being looked up, or waiting for that.
    std::deque<std::string> waiting_;                            ///< For a thread.
    std::shared_ptr<Home> home_;
};

} // namespace webots_cloud::adapters
