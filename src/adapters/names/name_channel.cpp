// c-ares tells which sockets and moments it waits for, and here Asio waits for them. What answers are good
// for is decided by name_resolver.cpp (addresses) and core/discovery/named_machines (lists of machines).
#include "name_channel.hpp"

#include "core/text.hpp"
#include "service_answer.hpp"

#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include <arpa/nameser.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/stat.h>

#define CARES_NO_DEPRECATED // what replaces ares_search is newer than Debian 12's
#include <ares.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <map>
#include <span>
#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

constexpr auto resolv_conf = "/etc/resolv.conf";
constexpr auto resolv_conf_is_good_for = std::chrono::seconds(1); // looked at no more often
constexpr int first_timeout_ms = 2000;
constexpr int tries = 3;

Failure unanswered(std::string const& name, int status)
{
    bool const is_said = status == ARES_ENOTFOUND || status == ARES_ENODATA;
    return Failure(
        is_said ? errc::not_found : errc::unreachable,
        concat("the name ", core::printable(name, 255), " can't be resolved: ", ::ares_strerror(status)));
}

/// Another one after each change.
std::string version_of(char const* file)
{
    struct stat facts
    {};
    if (::stat(file, &facts) != 0)
        return {};
    return concat(std::to_string(facts.st_ino), " ", std::to_string(facts.st_size), " ",
                  std::to_string(facts.st_mtim.tv_sec), ".", std::to_string(facts.st_mtim.tv_nsec));
}

NamedAddresses addresses_of(ares_addrinfo const& found)
{
    NamedAddresses named;
    auto ttl = std::chrono::seconds::max();
    for (auto const* node = found.nodes; node; node = node->ai_next) {
        if (node->ai_family == AF_INET) {
            sockaddr_in address{};
            std::memcpy(&address, node->ai_addr, sizeof address);
            named.addresses.emplace_back(asio::ip::address_v4(ntohl(address.sin_addr.s_addr)));
        } else if (node->ai_family == AF_INET6) {
            sockaddr_in6 address{};
            std::memcpy(&address, node->ai_addr, sizeof address);
            asio::ip::address_v6::bytes_type bytes;
            std::memcpy(bytes.data(), &address.sin6_addr, bytes.size());
            named.addresses.emplace_back(asio::ip::address_v6(bytes, address.sin6_scope_id));
        } else {
            continue;
        }
        ttl = std::min(ttl, std::chrono::seconds(node->ai_ttl));
    }
    named.ttl = named.addresses.empty() ? Duration::zero() : Duration(ttl);
    return named;
}

/// There is nobody to ask. The servers are those of the configuration, which a program may have made.
Failure unasked(std::string const& name, std::string const& servers)
{
    return {errc::unreachable,
            concat("the name ", core::printable(name, 255), " can't be resolved: ",
                   servers.empty() ? ::ares_strerror(ARES_ENOTINITIALIZED)
                                   : concat("expected numeric addresses of name servers, found ", servers))};
}

/// What c-ares brings back with an answer.
template<class Answer>
struct Asked
{
    asio::any_io_executor executor;
    std::string name;
    std::function<void(result<Answer>)> answer;

    /// Not from within c-ares, which must not be destroyed meanwhile.
    void tell(result<Answer> what)
    {
        asio::post(executor, [answer = std::move(answer), what = std::move(what)] { answer(what); });
    }
};

bool is_ending(int status)
{
    return status == ARES_EDESTRUCTION || status == ARES_ECANCELLED;
}

void take_addresses(void* argument, int status, int, ares_addrinfo* found)
{
    std::unique_ptr<Asked<NamedAddresses>> const asked(static_cast<Asked<NamedAddresses>*>(argument));
    if (status == ARES_SUCCESS && found)
        asked->tell(addresses_of(*found));
    else if (!is_ending(status))
        asked->tell(unanswered(asked->name, status));
    if (found)
        ::ares_freeaddrinfo(found);
}

void take_services(void* argument, int status, int, unsigned char* answer, int size)
{
    std::unique_ptr<Asked<NameAnswer>> const asked(static_cast<Asked<NameAnswer>*>(argument));
    if (status == ARES_SUCCESS)
        asked->tell(services_of(asked->name, {answer, static_cast<std::size_t>(std::max(size, 0))}));
    else if (!is_ending(status))
        asked->tell(unanswered(asked->name, status));
}

/// Whatever `/etc/hosts` says, as browsers take it (RFC 6761, section 6.3): a file without one of the two
/// addresses would keep the servers of a machine apart.
bool is_loopback(std::string_view name)
{
    return name == "localhost" || name.ends_with(".localhost");
}

NamedAddresses loopback()
{
    NamedAddresses both;
    both.addresses = {asio::ip::address_v6::loopback(), asio::ip::address_v4::loopback()};
    return both;
}

} // namespace

/// A channel of c-ares: its sockets and its timer on our executor.
struct NameChannel::Library : std::enable_shared_from_this<Library>
{
    /// One of c-ares' sockets, which it closes itself.
    struct Socket
    {
        Socket(asio::any_io_executor const& executor, int descriptor) : waiting(executor, descriptor) {}

        asio::posix::stream_descriptor waiting;
        std::array<bool, 2> wanted{};  ///< To be told when it can be read; when it can be written.
        std::array<bool, 2> awaited{}; ///< That is being waited for.
    };

    explicit Library(asio::any_io_executor const& executor) : executor(executor), timer(executor) {}
    ~Library()
    {
        if (channel)
            ::ares_destroy(channel);
    }
    Library(Library const&) = delete;
    Library& operator=(Library const&) = delete;

    bool open(std::string const& servers)
    {
        static int const ready = ::ares_library_init(ARES_LIB_INIT_ALL);
        if (ready != ARES_SUCCESS)
            return false;
        ares_options options{};
        options.sock_state_cb = on_socket;
        options.sock_state_cb_data = this;
        options.timeout = first_timeout_ms;
        options.tries = tries;
        int const given = ARES_OPT_SOCK_STATE_CB | ARES_OPT_TIMEOUTMS | ARES_OPT_TRIES;
        if (::ares_init_options(&channel, &options, given) != ARES_SUCCESS) {
            channel = nullptr;
            return false;
        }
        return servers.empty() || ::ares_set_servers_ports_csv(channel, servers.c_str()) == ARES_SUCCESS;
    }

    bool is_idle() const
    {
        timeval unused{};
        return !channel || !::ares_timeout(channel, nullptr, &unused);
    }

    static void on_socket(void* self, ares_socket_t descriptor, int readable, int writable)
    {
        static_cast<Library*>(self)->want(descriptor, {readable != 0, writable != 0});
    }

    void want(int descriptor, std::array<bool, 2> wanted)
    {
        auto& socket = sockets[descriptor];
        if (!wanted[0] && !wanted[1]) { // c-ares is about to close it
            if (socket)
                socket->waiting.release();
            sockets.erase(descriptor);
            return;
        }
        if (!socket)
            socket = std::make_shared<Socket>(executor, descriptor);
        socket->wanted = wanted;
        wait_for(socket, descriptor);
    }

    void wait_for(std::shared_ptr<Socket> const& socket, int descriptor)
    {
        using Waits = asio::posix::stream_descriptor;
        for (std::size_t kind : {0U, 1U}) {
            if (!socket->wanted.at(kind) || std::exchange(socket->awaited.at(kind), true))
                continue;
            socket->waiting.async_wait(
                kind == 0 ? Waits::wait_read : Waits::wait_write,
                [weak = weak_from_this(), socket, descriptor, kind](boost::system::error_code failed) {
                    socket->awaited.at(kind) = false;
                    if (auto const self = weak.lock(); self && failed != asio::error::operation_aborted)
                        self->be_ready(socket, descriptor, kind);
                });
        }
    }

    void be_ready(std::shared_ptr<Socket> const& socket, int descriptor, std::size_t kind)
    {
        auto const is_open = [&] {
            auto const found = sockets.find(descriptor);
            return found != sockets.end() && found->second == socket;
        };
        if (!is_open())
            return;
        if (socket->wanted.at(kind))
            ::ares_process_fd(channel, kind == 0 ? descriptor : ARES_SOCKET_BAD,
                              kind == 0 ? ARES_SOCKET_BAD : descriptor);
        // c-ares may have closed it meanwhile, and its number may be another socket's.
        if (is_open())
            wait_for(socket, descriptor);
        wait_for_timeout();
    }

    void wait_for_timeout()
    {
        timeval wait{};
        if (!::ares_timeout(channel, nullptr, &wait)) {
            timer.cancel();
            return;
        }
        timer.expires_after(std::chrono::seconds(wait.tv_sec) + std::chrono::microseconds(wait.tv_usec));
        timer.async_wait([weak = weak_from_this()](boost::system::error_code failed) {
            auto const self = weak.lock();
            if (!self || failed)
                return;
            ::ares_process_fd(self->channel, ARES_SOCKET_BAD, ARES_SOCKET_BAD);
            self->wait_for_timeout();
        });
    }

    asio::any_io_executor executor;
    asio::steady_timer timer;
    std::map<int, std::shared_ptr<Socket>> sockets;
    ares_channel channel = nullptr;
};

NameChannel::NameChannel(asio::any_io_executor executor, std::string servers)
    : executor_(std::move(executor)), servers_(std::move(servers))
{}

NameChannel::~NameChannel() = default;

std::shared_ptr<NameChannel::Library> const& NameChannel::library()
{
    std::erase_if(outdated_, [](auto const& old) { return old->is_idle(); });
    auto const now = std::chrono::steady_clock::now();
    if (library_ && now - looked_at_ < resolv_conf_is_good_for)
        return library_;
    looked_at_ = now;
    auto version = version_of(resolv_conf);
    if (library_ && version == version_)
        return library_;
    // Questions that are under way end on the old channel: c-ares reads the file once for each channel.
    if (library_)
        outdated_.push_back(std::move(library_));
    version_ = std::move(version);
    library_ = std::make_shared<Library>(executor_);
    if (!library_->open(servers_))
        library_.reset();
    return library_;
}

void NameChannel::ask_addresses(std::string const& name, bool sorted,
                                std::function<void(result<NamedAddresses>)> answer)
{
    using Question = Asked<NamedAddresses>;
    auto asked = std::make_unique<Question>(Question{executor_, name, std::move(answer)});
    boost::system::error_code not_numeric;
    NamedAddresses numeric;
    numeric.addresses.push_back(asio::ip::make_address(name, not_numeric));
    if (!not_numeric) // c-ares 1.18 would ask name servers for it
        return asked->tell(std::move(numeric));
    if (is_loopback(name))
        return asked->tell(loopback());
    auto const& asking = library();
    if (!asking)
        return asked->tell(unasked(name, servers_));
    ares_addrinfo_hints hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = sorted ? 0 : ARES_AI_NOSORT;
    ::ares_getaddrinfo(asking->channel, name.c_str(), nullptr, &hints, take_addresses, asked.release());
    asking->wait_for_timeout();
}

void NameChannel::ask_services(std::string const& name, std::function<void(result<NameAnswer>)> answer)
{
    using Question = Asked<NameAnswer>;
    auto asked = std::make_unique<Question>(Question{executor_, name, std::move(answer)});
    auto const& asking = library();
    if (!asking)
        return asked->tell(unasked(name, servers_));
    ::ares_search(asking->channel, name.c_str(), ns_c_in, ns_t_srv, take_services, asked.release());
    asking->wait_for_timeout();
}

} // namespace webots_cloud::adapters
