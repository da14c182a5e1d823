// Asks name servers, by c-ares.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/name_answer.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/address.hpp>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

using Addresses = std::vector<boost::asio::ip::address>;

/// The addresses of a name.
struct NamedAddresses
{
    NamedAddresses() = default;

    Addresses addresses;
    Duration ttl{}; ///< How long they are good for, by the name server's word; of `/etc/hosts`: 0.
};

/// Names as this machine knows them: `/etc/hosts` and DNS, in the order of `/etc/nsswitch.conf`, with the
/// servers and the search list of `/etc/resolv.conf`; `localhost`, and what is below it, is both addresses of
/// the loopback. When that file changes, questions asked a second later
/// go by it. Other modules of `nsswitch.conf`, such as mDNS, are not asked.
///
/// An answer that is too large for UDP is asked for by TCP. A server is asked three times at most, and waited
/// for 2, 4 and 8 seconds. Answers come from the executor, never while a function is called, and none comes
/// once this is destroyed.   Errors: `not_found`, by the word of a server; `unreachable`.
/// Thread-safety: one executor.
class NameChannel
{
public:
    /// `servers`: instead of those of `/etc/resolv.conf`, as in `127.0.0.1:5353,[::1]:53`. Empty: those.
    explicit NameChannel(boost::asio::any_io_executor executor, std::string servers = "");
    ~NameChannel();

    /// `sorted`: those first that are the most likely to be reached from here (RFC 6724).
    void ask_addresses(std::string const& name, bool sorted,
                       std::function<void(result<NamedAddresses>)> answer);
    void ask_services(std::string const& name, std::function<void(result<NameAnswer>)> answer);

private:
    struct Library;

    /// Null: none could be made.
    std::shared_ptr<Library> const& library();

    boost::asio::any_io_executor executor_;
    std::string servers_;
    std::shared_ptr<Library> library_;
    std::vector<std::shared_ptr<Library>> outdated_; ///< They still wait for answers.
    std::string version_;                            ///< Of `/etc/resolv.conf`, as `library_` has read it.
    TimePoint looked_at_;                            ///< When that was compared the last time.
};

} // namespace webots_cloud::adapters
