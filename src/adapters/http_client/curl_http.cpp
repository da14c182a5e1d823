// Blocking requests for project sources, on threads that may wait. libcurl asks back here while it works:
// that is where limits, deadlines and the wish to stop take effect. Where redirects may lead is decided by
// the caller.
#include "curl_http.hpp"

#include "adapters/files/regular_file.hpp"
#include "adapters/tls/openssl_files.hpp"
#include "adapters/tls/tls_trust.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

#include <curl/curl.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr int max_redirects = 3;
constexpr std::uint64_t max_other_answer = 64 * 1024; // of error pages, whose text is not used
/// Of what surrounds the pieces of a body (lengths, extensions), for each byte of it, and besides.
constexpr std::uint64_t max_framing_ratio = 8; // a piece of one byte has five
constexpr std::uint64_t max_framing = 1 << 20;

constexpr std::uint64_t max_header_lines =
    4'000; // newer releases of libcurl give up after 5,000, in other words

bool is_set(std::atomic<bool> const* flag)
{
    return flag && flag->load(std::memory_order_relaxed);
}

/// One attempt: what libcurl's callbacks need to know.
struct Exchange
{
    CurlRequest const& request;
    CurlLimits const& limits;
    CURL* curl = nullptr;
    std::uint64_t received = 0;
    std::uint64_t on_the_wire = 0; ///< With what surrounds the pieces of the body.
    std::uint64_t header_bytes = 0;
    std::uint64_t header_lines = 0;
    bool heard_enough = false; ///< Of an answer whose status says it all.
    bool stopped_by_sink = false;
    result<> outcome{};
    std::string url{}; ///< The request's, or where it was redirected to.

    bool may_contact(std::optional<core::IpAddress> const& address)
    {
        if (address && request.may_contact(url, *address))
            return true;
        refused_address = address ? address->text() : "no address of IP";
        return false;
    }

    std::string refused_address{};

    bool must_stop()
    {
        if (outcome.has_error())
            return true;
        if (is_set(limits.aborted) || is_set(limits.abandoned))
            outcome = Failure(boost::asio::error::operation_aborted);
        else if (std::chrono::steady_clock::now() > limits.deadline)
            outcome = Failure(errc::timed_out, concat(request.peer, " took too long"));
        return outcome.has_error();
    }
};

std::size_t on_body(char* bytes, std::size_t, std::size_t count, void* user)
{
    auto& exchange = *static_cast<Exchange*>(user);
    long status = 0;
    curl_easy_getinfo(exchange.curl, CURLINFO_RESPONSE_CODE, &status);
    exchange.received += count;
    if (status != 200) { // the text of an error page is not used
        exchange.heard_enough = exchange.received > max_other_answer;
        return exchange.heard_enough || exchange.must_stop() ? 0 : count;
    }
    if (exchange.received > exchange.limits.bytes)
        exchange.outcome =
            Failure(errc::too_large, concat("the answer of ", exchange.request.peer, " is larger than ",
                                            std::to_string(exchange.limits.bytes >> 20), " MB"));
    else if (!exchange.must_stop()) {
        exchange.outcome = exchange.request.sink(std::string_view(bytes, count));
        exchange.stopped_by_sink = exchange.outcome.has_error();
    }
    return exchange.outcome ? count : 0;
}

/// libcurl keeps every line of headers and trailers until the next request, and has no limit of its own for
/// trailers; interim answers (1xx) come here too.
std::size_t on_header(char*, std::size_t, std::size_t count, void* user)
{
    auto& exchange = *static_cast<Exchange*>(user);
    exchange.header_bytes += count;
    if (exchange.header_bytes > exchange.limits.header_bytes || ++exchange.header_lines > max_header_lines)
        exchange.outcome =
            Failure(errc::too_large, concat("the answer of ", exchange.request.peer, " has more than ",
                                            std::to_string(exchange.limits.header_bytes >> 10), " kB or ",
                                            std::to_string(max_header_lines), " lines of headers"));
    return exchange.outcome && !exchange.must_stop() ? count : 0;
}

/// Sees what libcurl leaves out of a body that comes in pieces, and for which it has no limit.
int on_data(CURL*, curl_infotype type, char*, std::size_t count, void* user)
{
    auto& exchange = *static_cast<Exchange*>(user);
    if (type == CURLINFO_DATA_IN)
        exchange.on_the_wire += count;
    if (exchange.on_the_wire > max_framing_ratio * exchange.received + max_framing && exchange.outcome)
        exchange.outcome =
            Failure(errc::too_large, concat("the answer of ", exchange.request.peer,
                                            " is hardly anything but what separates its pieces"));
    return 0;
}

int on_progress(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t)
{
    return static_cast<Exchange*>(user)->must_stop() ? 1 : 0;
}

std::optional<core::IpAddress> address_of(sockaddr const& address)
{
    core::IpAddress::Bytes bytes{};
    if (address.sa_family == AF_INET6) {
        std::memcpy(bytes.data(), &reinterpret_cast<sockaddr_in6 const&>(address).sin6_addr, bytes.size());
        return core::IpAddress(bytes);
    }
    if (address.sa_family != AF_INET)
        return std::nullopt;
    constexpr std::size_t v4_at = 12;
    bytes[v4_at - 2] = bytes[v4_at - 1] = 0xff; // as IPv6 has it
    auto const& v4 = reinterpret_cast<sockaddr_in const&>(address).sin_addr;
    std::memcpy(bytes.data() + v4_at, &v4, sizeof v4);
    return core::IpAddress(bytes);
}

curl_socket_t on_socket(void* user, curlsocktype, curl_sockaddr* address)
{
    if (!static_cast<Exchange*>(user)->may_contact(address_of(address->addr)))
        return CURL_SOCKET_BAD;
    return ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

/// Of connections that were open already, too.
int on_connection(void* user, char* address, char*, int, int)
{
    bool const may = static_cast<Exchange*>(user)->may_contact(core::IpAddress::parse(address));
    return may ? CURL_PREREQFUNC_OK : CURL_PREREQFUNC_ABORT;
}

/// Called for each TLS connection before it begins; `user` is the text of the PEM file.
CURLcode on_tls(CURL*, void* context, void* user)
{
    bool const trusted =
        trust_certificates(static_cast<SSL_CTX*>(context), *static_cast<std::string const*>(user));
    return trusted ? CURLE_OK : CURLE_SSL_CACERT_BADFILE;
}

/// Empty where it can't be read: then its certificates are not trusted, which is found out soon enough.
std::string text_of(std::filesystem::path const& pem_file)
{
    if (pem_file.empty())
        return {};
    auto const text = read_regular_file(pem_file, max_pem_file);
    return text ? *text : std::string();
}

Failure failure_of(CURLcode code, char const* words)
{
    std::string const detail = *words ? words : curl_easy_strerror(code);
    if (code == CURLE_OPERATION_TIMEDOUT)
        return {errc::timed_out, detail};
    if (code == CURLE_GOT_NOTHING || code == CURLE_PARTIAL_FILE)
        return {errc::unreachable, concat("the connection was cut (", detail, ")")};
    if (code == CURLE_WEIRD_SERVER_REPLY)
        return {errc::protocol_error, detail};
    return {errc::unreachable, detail};
}

} // namespace

/// A libcurl handle with its connections.
class CurlHttp::Handle
{
public:
    /// `authorities`: the text of a PEM file, or empty.   Lifetime: outlives the handle.
    explicit Handle(std::string const& authorities) : curl_(curl_easy_init()), authorities_(authorities) {}
    Handle(Handle const&) = delete;
    ~Handle()
    {
        curl_slist_free_all(headers_);
        curl_easy_cleanup(curl_);
    }

    /// What `send` tells besides the status.
    struct Particulars
    {
        std::string redirected; ///< The address that the answer points to, or empty.
        bool stopped_by_sink = false;
    };

    /// `is_away`: without the request's headers.
    result<int> send(CurlRequest const& request, CurlLimits const& limits, std::string const& url,
                     bool is_away, Particulars& particulars);

private:
    void prepare(CurlRequest const& request, CurlLimits const& limits, std::string const& url, bool is_away);

    CURL* curl_;
    std::string const& authorities_;
    curl_slist* headers_ = nullptr;
    std::array<char, CURL_ERROR_SIZE> words_{};
};

void CurlHttp::Handle::prepare(CurlRequest const& request, CurlLimits const& limits, std::string const& url,
                               bool is_away)
{
    curl_easy_reset(curl_); // keeps the connections
    curl_slist_free_all(headers_);
    headers_ = nullptr;
    if (!is_away)
        for (auto const& line : request.headers)
            headers_ = curl_slist_append(headers_, line.c_str());
    if (!request.body.empty()) {
        headers_ = curl_slist_append(headers_, "Expect:"); // no round trip before the body
        curl_easy_setopt(curl_, CURLOPT_POSTFIELDS, request.body.data());
        curl_easy_setopt(curl_, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
    }
    curl_easy_setopt(curl_, CURLOPT_HTTPHEADER, headers_);
    curl_easy_setopt(curl_, CURLOPT_URL, url.c_str());
    curl_easy_setopt(curl_, CURLOPT_USERAGENT, request.agent.c_str());
    curl_easy_setopt(curl_, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl_, CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2)); // or newer
    if (!authorities_.empty()) { // libcurl's own option would replace the system's authorities
        curl_easy_setopt(curl_, CURLOPT_SSL_CTX_FUNCTION, on_tls);
        curl_easy_setopt(curl_, CURLOPT_SSL_CTX_DATA, &authorities_);
    }
    // `CurlHttp::send` follows redirects, and asks first whether it may.
    curl_easy_setopt(curl_, CURLOPT_FOLLOWLOCATION, 0L);
    // No signals: other threads are at work. No passwords of the server's user: whom we ask is a stranger.
    curl_easy_setopt(curl_, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl_, CURLOPT_NETRC, static_cast<long>(CURL_NETRC_IGNORED));
    curl_easy_setopt(curl_, CURLOPT_CONNECTTIMEOUT, 20L);
    curl_easy_setopt(curl_, CURLOPT_BUFFERSIZE, 256L * 1024);
    if (limits.low_speed.bytes > 0) {
        auto const seconds = std::chrono::duration_cast<std::chrono::seconds>(limits.low_speed.time).count();
        curl_easy_setopt(curl_, CURLOPT_LOW_SPEED_LIMIT, static_cast<long>(limits.low_speed.bytes));
        curl_easy_setopt(curl_, CURLOPT_LOW_SPEED_TIME, static_cast<long>(seconds));
    }
    words_[0] = '\0';
    curl_easy_setopt(curl_, CURLOPT_ERRORBUFFER, words_.data());
}

result<int> CurlHttp::Handle::send(CurlRequest const& request, CurlLimits const& limits,
                                   std::string const& url, bool is_away, Particulars& particulars)
{
    prepare(request, limits, url, is_away);
    Exchange exchange{.request = request, .limits = limits, .curl = curl_, .url = url};
    curl_easy_setopt(curl_, CURLOPT_WRITEFUNCTION, on_body);
    curl_easy_setopt(curl_, CURLOPT_WRITEDATA, &exchange);
    curl_easy_setopt(curl_, CURLOPT_HEADERFUNCTION, on_header);
    curl_easy_setopt(curl_, CURLOPT_HEADERDATA, &exchange);
    curl_easy_setopt(curl_, CURLOPT_DEBUGFUNCTION, on_data);
    curl_easy_setopt(curl_, CURLOPT_DEBUGDATA, &exchange);
    curl_easy_setopt(curl_, CURLOPT_VERBOSE, 1L); // or that is not called
    curl_easy_setopt(curl_, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl_, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(curl_, CURLOPT_XFERINFODATA, &exchange);
    if (request.may_contact) {
        curl_easy_setopt(curl_, CURLOPT_OPENSOCKETFUNCTION, on_socket);
        curl_easy_setopt(curl_, CURLOPT_OPENSOCKETDATA, &exchange);
        curl_easy_setopt(curl_, CURLOPT_PREREQFUNCTION, on_connection);
        curl_easy_setopt(curl_, CURLOPT_PREREQDATA, &exchange);
    }
    auto const code = curl_easy_perform(curl_);
    particulars.stopped_by_sink = exchange.stopped_by_sink;
    // What has stopped it is the better reason: of a limit or a deadline libcurl knows only that a callback
    // said no.
    if (exchange.outcome.has_error())
        return exchange.outcome.error();
    if (code != CURLE_OK && !exchange.refused_address.empty())
        return Failure(errc::refused, concat("leads to ", exchange.refused_address));
    if (code != CURLE_OK && !exchange.heard_enough)
        return failure_of(code, words_.data());
    long status = 0;
    curl_easy_getinfo(curl_, CURLINFO_RESPONSE_CODE, &status);
    char* target = nullptr;
    curl_easy_getinfo(curl_, CURLINFO_REDIRECT_URL, &target);
    particulars.redirected = target ? target : "";
    char* address = nullptr;
    curl_easy_getinfo(curl_, CURLINFO_PRIMARY_IP, &address);
    if (request.answered_by && address)
        *request.answered_by = core::IpAddress::parse(address);
    return static_cast<int>(status);
}

CurlHttp::CurlHttp(HttpClientConfig config)
    : config_(std::move(config)), authorities_(text_of(config_.authorities))
{
    static auto const initialized = curl_global_init(CURL_GLOBAL_DEFAULT);
    (void)initialized;
}

CurlHttp::~CurlHttp() = default;

std::unique_ptr<CurlHttp::Handle> CurlHttp::take()
{
    std::lock_guard const lock(mutex_);
    if (idle_.empty())
        return std::make_unique<Handle>(authorities_);
    auto handle = std::move(idle_.back());
    idle_.pop_back();
    return handle;
}

void CurlHttp::give_back(std::unique_ptr<Handle> handle)
{
    std::lock_guard const lock(mutex_);
    idle_.push_back(std::move(handle));
}

result<int> CurlHttp::send(CurlRequest const& request, CurlLimits const& limits)
{
    auto handle = take();
    auto url = request.url;
    bool is_away = false;
    result<int> status = 0;
    Handle::Particulars particulars;
    for (int attempt = 0; attempt <= max_redirects; ++attempt) {
        particulars = {};
        status = handle->send(request, limits, url, is_away, particulars);
        auto const& redirected = particulars.redirected;
        if (!status || redirected.empty())
            break;
        // What remains after the last attempt, if that is redirected, too.
        status = Failure(errc::protocol_error, concat(request.peer, " redirects in circles"));
        if (!redirected.starts_with(request.base + "/")) {
            auto const followed = request.may_redirect
                                      ? request.may_redirect(redirected)
                                      : result<>(Failure(errc::protocol_error,
                                                         concat(request.peer, " redirects to another host")));
            if (!followed) {
                status = followed.error();
                break;
            }
            is_away = true; // from now on, wherever it leads
        }
        url = redirected;
    }
    give_back(std::move(handle));
    if (!status && !particulars.stopped_by_sink && request.explain)
        return request.explain(status.error());
    return status;
}

} // namespace webots_cloud::adapters
