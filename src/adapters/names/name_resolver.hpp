// Resolves the names of other servers.
#pragma once

#include "name_channel.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace webots_cloud::adapters {

/// Asks for the addresses of a name, and calls `answer` when they are known: once, or never.
using NameLookup =
    std::function<void(std::string const& name, std::function<void(result<Addresses>)> answer)>;

/// How patient a NameResolver is.
struct NameResolverParams
{
    NameResolverParams() = default;

    std::size_t max_lookups = 1024; ///< At once; whoever asks for one more name is told so.
    /// How long addresses are taken as they are: a server that moves is found again soon, and a caller that
    /// needs many connections to it asks once.
    Duration good_for = std::chrono::seconds(5);
    /// A lookup that has taken so long is slow: whoever asks gets the last known addresses.
    Duration slow_after = std::chrono::seconds(2);
    Duration first_pause = std::chrono::seconds(5); ///< Until a slow name is looked up again; doubles up to
    Duration max_pause = std::chrono::minutes(1);
    /// How long the last addresses of a name are used when its lookup is slow. A name that is said not to
    /// exist has none.
    Duration memory = std::chrono::hours(1);
};

/// Looks names up side by side: a name whose servers do not answer does not delay others.
///
/// A name is looked up once at a time for all who ask, and once in a few seconds. One that hung before is
/// left alone for a while; whoever asks for it meanwhile gets its last addresses, or is told at once.
/// Thread-safety: one executor.
class NameResolver
{
public:
    /// With a NameChannel.
    explicit NameResolver(boost::asio::any_io_executor const& executor);
    NameResolver(boost::asio::any_io_executor executor, NameLookup lookup, NameResolverParams params);
    ~NameResolver();

    /// Cancellation: terminal.   Errors: `not_found`, by the word of a name server; `unreachable`, also when
    /// there is no answer at `deadline`; `operation_aborted`.
    boost::asio::awaitable<result<Addresses>> resolve(std::string name, TimePoint deadline);

private:
    struct Question;
    struct Home;

    /// What is known of a name from earlier lookups.
    struct Record
    {
        Addresses addresses;
        TimePoint answered;   ///< When these were.
        bool is_slow = false; ///< The last lookup was.
        Duration pause{};     ///< Before the next one of a slow name.
        TimePoint next;       ///< When that may be.
        TimePoint asked;
    };

    Record& record_of(std::string const& name);
    bool has_addresses(Record const& record) const;
    void forget_old_records();
    std::shared_ptr<Question> begin(std::string const& name);
    void turn_slow(std::string const& name, Question& question);
    void take_answer(std::string const& name, result<Addresses> answer);

    boost::asio::any_io_executor executor_;
    NameLookup lookup_;
    NameResolverParams params_;
    std::map<std::string, std::shared_ptr<Question>> questions_; ///< Being looked up.
    std::map<std::string, Record> records_;
    std::shared_ptr<Home> home_;
};

} // namespace webots_cloud::adapters
