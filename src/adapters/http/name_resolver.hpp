// Resolves the names of other servers.
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
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

using Addresses = std::vector<boost::asio::ip::address>;

/// Resolves a name; may block for any time, and does not throw.   Errors: `unreachable`.
/// Thread-safety: any thread.
using NameLookup = std::function<result<Addresses>(std::string const& name)>;

/// The machine's own configuration (`/etc/hosts`, DNS, mDNS and so on), by the C library's
/// `getaddrinfo`.
result<Addresses> look_up(std::string const& name);

/// How a NameResolver shares out its threads.
struct NameResolverParams
{
    NameResolverParams() = default;

    std::size_t threads = 64;      ///< For names that are answered soon, as far as anybody knows.
    std::size_t slow_threads = 16; ///< More of them, for names that were slow the last time.
    /// A lookup that has taken so long is slow, and another may start beside it, up to four times as many
    /// threads in all.
    Duration slow_after = std::chrono::seconds(2);
    Duration first_pause = std::chrono::seconds(5); ///< Until a slow name is looked up again; doubles up to
    Duration max_pause = std::chrono::minutes(1);
    /// How long the last addresses of a name are used when its lookup is slow. A name that is said not to
    /// exist has none.
    Duration memory = std::chrono::hours(1);
};

/// Looks names up, each on a thread of its own: a name whose servers do not answer does not delay others.
///
/// A name is looked up once at a time for all who ask; beyond the most threads, names wait for their turn.
/// However many names hang, others wait for `slow_after` at most, and only the first time: a name that hung
/// before waits for one of a few threads that are for such names alone, and is left alone in between. Whoever
/// asks for it meanwhile gets its last addresses, or is told at once. A lookup can't be ended, so the
/// destructor leaves those that hang to themselves.   Thread-safety: one executor.
class NameResolver
{
public:
    explicit NameResolver(boost::asio::any_io_executor executor, NameLookup lookup = look_up,
                          NameResolverParams params = {});
    ~NameResolver();

    /// Cancellation: terminal.   Errors: `unreachable`, also when there is no answer at `deadline`;
    /// `operation_aborted`.
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
    void start_lookups();
    bool start_next(std::deque<std::string>& waiting);
    bool is_asked(std::string const& name, Question const& question) const;
    void turn_slow(std::string const& name, Question& question);
    void take_answer(std::string const& name, result<Addresses> answer);
    static void answer(std::string const& name, NameLookup const& lookup, std::shared_ptr<Home> const& home);

    boost::asio::any_io_executor executor_;
    NameLookup lookup_;
    NameResolverParams params_;
    std::size_t prompt_ = 0;                                     ///< Lookups under way that are not slow.
    std::size_t slow_ = 0;                                       ///< Those that are.
    std::map<std::string, std::shared_ptr<Question>> questions_; ///< Being looked up, or waiting for that.
    std::deque<std::string> waiting_;                            ///< For a thread.
    std::deque<std::string> slow_waiting_;                       ///< The same of names that were slow.
    std::map<std::string, Record> records_;
    std::shared_ptr<Home> home_;
};

} // namespace webots_cloud::adapters
