// Checks in the order in which they can refuse: the name of the host, the page that a WebSocket comes from,
// and for the monitor the client's address and password, with a limit on guesses. What passes goes to the
// service behind.
// Decisions: core/access/site_access, core/access/asked_name, core/access/password_guesses.
#include <webots_cloud/access_control.hpp>

#include "core/access/asked_name.hpp"
#include "core/access/ip_address.hpp"
#include "core/access/password_guesses.hpp"
#include "core/access/site_access.hpp"
#include "core/base64.hpp"
#include "core/pages/http_pages.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/text.hpp"
#include "error_page.hpp"

#include <array>

namespace webots_cloud {

using core::concat;

namespace {

constexpr std::string_view bearer = "Bearer ";
constexpr std::string_view session_path = "/session"; // of the session server
constexpr std::string_view from_disk = " (opened from disk, or in a sandboxed frame)";
constexpr std::size_t max_shown = 200; // bytes of an origin
constexpr std::string_view guessed_types = "X-Content-Type-Options: nosniff\r\n";

/// `machines`: the reach of the widest of them.
core::SiteAccess site_of(AccessConfig const& config, GuardedServer const& server, core::Reach machines)
{
    auto reach = core::reach_of(server.name);
    if (reach == core::Reach::this_machine)
        reach = machines;
    auto names = server.machine_names;
    names.insert(names.end(), config.host_names.begin(), config.host_names.end());
    names.push_back(server.name);
    return {reach, names, config.allowed_origins ? &*config.allowed_origins : nullptr};
}

std::string page_headers(AccessConfig config, GuardedServer const& server, core::Reach machines)
{
    if (config.frame_ancestors)
        config.allowed_origins = config.frame_ancestors;
    return concat(guessed_types, "Content-Security-Policy: frame-ancestors ",
                  site_of(config, server, machines).frame_ancestors(), "\r\n");
}

bool is_page(std::string_view path) noexcept
{
    return path.starts_with("/viewer") || path.starts_with("/class") || path == "/monitor";
}

bool is_monitoring(std::string_view path) noexcept
{
    return path == "/monitor" || path == "/metrics";
}

/// A sentence for the person who looks at the page (protocol 2.1), which the page may read.
HttpResponse page_refused(std::string_view origin)
{
    HttpResponse response(200, std::string(core::html_type),
                          concat("Error: pages of ", core::printable(origin, max_shown),
                                 origin == "null" ? from_disk : "",
                                 " may not use this server. Its operator can add \"",
                                 core::printable(origin, max_shown), "\" to \"allowedOrigins\"."));
    response.headers.emplace_back("Access-Control-Allow-Origin", "*");
    return response;
}

/// Through a session server that does not pass passwords on a browser need not ask for one, nor forget the
/// session server's own.
HttpResponse password_kept_back()
{
    return HttpResponse(403, std::string(core::html_type),
                        "The monitor of this server asks for a password, which the session server in front "
                        "passes on to trusted machines only: its operator can add \"trusted\": true to this "
                        "machine in \"simulationServers\".");
}

HttpResponse password_wanted(IncomingRequest const& request)
{
    if (!request.header(core::untrusted_header).empty())
        return password_kept_back();
    HttpResponse response(401, std::string(core::html_type),
                          "The monitor of this server asks for a password (user: operator).");
    response.headers.emplace_back("WWW-Authenticate", "Basic realm=\"monitor\", charset=\"UTF-8\"");
    return response;
}

HttpResponse too_many_guesses()
{
    HttpResponse response(429, std::string(core::html_type),
                          "Too many wrong passwords were tried. Please try again in a minute.");
    response.headers.emplace_back("Retry-After", "60");
    response.fixed_headers = guessed_types;
    return response;
}

HttpResponse origin_refused()
{
    return HttpResponse(403, std::string(core::html_type),
                        "Pages of this site may not use this server. Its operator can add the site to "
                        "\"allowedOrigins\".");
}

HttpResponse foreign_page_refused()
{
    HttpResponse response(403, std::string(core::html_type),
                          "The operator's requests are not taken from pages of other sites.");
    response.fixed_headers = guessed_types;
    return response;
}

HttpResponse address_refused()
{
    return HttpResponse(403, std::string(core::html_type),
                        "The monitor of this server is not for your address.");
}

} // namespace

struct AccessControl::Impl final : FleetObserver
{
    Impl(AccessConfig wanted, GuardedServer guarded, Endpoint& behind, Clock& time, Logger logger,
         OperatorTokenCheck check)
        : endpoint(behind), clock(time), log(std::move(logger))
    {
        set(std::move(wanted), std::move(guarded), std::move(check));
    }

    void set(AccessConfig wanted, GuardedServer guarded, OperatorTokenCheck check)
    {
        config = std::move(wanted);
        server = std::move(guarded);
        is_operator_token = std::move(check);
        find_site();
        monitors = core::IpNetworks(config.monitor_addresses);
        monitor_authorization =
            config.monitor_password.empty()
                ? std::string()
                : concat("Basic ", core::base64(concat("operator:", config.monitor_password)));
    }

    void put(FleetMachine const& machine, FleetMachine const* was, std::optional<std::string_view>) override
    {
        if (was)
            return;
        ++machines_like(machine);
        machines_changed();
    }

    void remove(FleetMachine const& machine) override
    {
        --machines_like(machine);
        machines_changed();
    }

    /// How many of the same reach there are.
    std::size_t& machines_like(FleetMachine const& machine)
    {
        std::string_view const address = machine.spec.address;
        auto const reach = core::reach_of(address.substr(0, address.find('/')));
        return machines_of_reach[static_cast<std::size_t>(reach)];
    }

    /// The widest that any machine has.
    core::Reach widest_reach() const
    {
        using enum core::Reach;
        for (auto const reach : {everybody, private_network})
            if (machines_of_reach[static_cast<std::size_t>(reach)] != 0)
                return reach;
        return this_machine;
    }

    void find_site()
    {
        reach_of_machines = widest_reach();
        site = site_of(config, server, reach_of_machines);
        headers_of_pages = page_headers(config, server, reach_of_machines);
    }

    void machines_changed()
    {
        if (widest_reach() != reach_of_machines)
            find_site();
    }

    result<bool> is_operators(IncomingRequest const& request);
    bool is_of_foreign_page(IncomingRequest const& request) const;
    bool is_of_refused_page(IncomingRequest const& request) const;
    void log_origin(IncomingRequest const& request, std::string_view what);
    void note_lost_port(IncomingRequest const& request);
    Answer answer(IncomingRequest const& request);
    Answer answer_of_endpoint(IncomingRequest const& request);
    std::optional<HttpResponse> refuse(IncomingRequest const& request);
    std::optional<HttpResponse> refuse_monitor(IncomingRequest const& request);
    result<bool> is_right(IncomingRequest const& request, GuessLimit& guesses, std::string_view what,
                          bool is_equal);

    AccessConfig config;
    GuardedServer server;
    OperatorTokenCheck is_operator_token;
    Endpoint& endpoint;
    Clock& clock;
    Logger log;
    std::array<std::size_t, 3> machines_of_reach{}; ///< How many there are, by core::Reach.
    core::Reach reach_of_machines = core::Reach::this_machine;
    core::SiteAccess site;
    std::string headers_of_pages;      ///< With line ends. Answers refer to it.
    std::string monitor_authorization; ///< Empty: no password is asked for.
    core::IpNetworks monitors;         ///< Addresses that need no password.
    GuessLimit passwords{core::passwords_of_client, core::passwords_of_all};
    GuessLimit tokens{core::passwords_of_client, core::passwords_of_all};
};

AccessControl::AccessControl(AccessConfig config, GuardedServer server, Endpoint& endpoint, Clock& clock,
                             Logger log, OperatorTokenCheck is_operator_token)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(server), endpoint, clock, std::move(log),
                                   std::move(is_operator_token)))
{}

AccessControl::~AccessControl() = default;

void AccessControl::apply(AccessConfig config, GuardedServer server, OperatorTokenCheck is_operator_token)
{
    impl_->set(std::move(config), std::move(server), std::move(is_operator_token));
}

void AccessControl::follow(Fleet& fleet)
{
    fleet.add_observer(*impl_);
}

/// Whether a password or token that came with a request is the right one, as a comparison in constant time
/// found. Errors: `unavailable`: too many were wrong, so that not even the right one counts.
result<bool> AccessControl::Impl::is_right(IncomingRequest const& request, GuessLimit& guesses,
                                           std::string_view what, bool is_equal)
{
    auto const now = clock.now();
    if (!guesses.may_try(request.quota_key, now))
        return Failure(errc::unavailable);
    if (!is_equal) {
        guesses.count_wrong(request.quota_key, now);
        log.warning(LogCause("wrong password", request.client),
                    concat("A wrong ", what, core::of_client(request.client)));
    }
    return is_equal;
}

/// Errors: as is_right().
result<bool> AccessControl::Impl::is_operators(IncomingRequest const& request)
{
    auto const authorization = request.header("Authorization");
    if (!is_operator_token || !authorization.starts_with(bearer) || !site.knows_host(request.header("Host")))
        return false;
    return is_right(request, tokens, "token of the operator",
                    is_operator_token(authorization.substr(bearer.size())));
}

/// Whether a page of another site has sent an operator's request. Browsers name the page; programs name none.
bool AccessControl::Impl::is_of_foreign_page(IncomingRequest const& request) const
{
    auto const origin = request.header("Origin");
    if (site.is_own_page(origin, request.header("Host")))
        return false;
    // A token proves that the page was given it. So its page may be at another port, as behind proxies that
    // name another host. Over the socket, which people forward to their own machine, nothing is proved.
    return request.is_operator || !site.has_own_name(origin);
}

std::optional<HttpResponse> AccessControl::Impl::refuse_monitor(IncomingRequest const& request)
{
    if (monitor_authorization.empty() && monitors.empty())
        return std::nullopt;
    if (auto const client = core::IpAddress::parse(request.client); client && monitors.contains(*client))
        return std::nullopt;
    if (monitor_authorization.empty())
        return address_refused();
    auto const given = request.header("Authorization");
    if (given.empty()) // a browser that has not asked yet
        return password_wanted(request);
    auto const right = is_right(request, passwords, "password of the monitor",
                                core::equal_in_constant_time(given, monitor_authorization));
    if (!right)
        return too_many_guesses();
    return *right ? std::nullopt : std::optional(password_wanted(request));
}

/// Whether it comes from a page that could not open the WebSockets that it needs next. Programs and old pages
/// name none.
bool AccessControl::Impl::is_of_refused_page(IncomingRequest const& request) const
{
    auto const origin = request.header("Origin");
    return !origin.empty() && !site.accepts_origin(origin, request.header("Host"));
}

void AccessControl::Impl::log_origin(IncomingRequest const& request, std::string_view what)
{
    auto const origin = core::printable(request.header("Origin"), max_shown);
    log.warning(LogCause("origin", request.client),
                concat("Refused ", what, " of a page of ", origin, origin == "null" ? from_disk : "",
                       ": to let it in, add \"", origin, "\" to \"allowedOrigins\""));
}

/// Warns of a proxy whose browsers are told an address that they can't reach.
void AccessControl::Impl::note_lost_port(IncomingRequest const& request)
{
    auto const origin = request.header("Origin");
    auto const host = request.header("Host");
    auto const port = core::port_left_out(origin, host);
    if (port.empty() || !request.header("X-Forwarded-Port").empty())
        return;
    log.warning(
        LogCause("port of the proxy"),
        concat("A page of ", core::printable(origin, max_shown), " has asked for ",
               core::printable(host, max_shown),
               " without its port: if the page is ours, its browser is sent to another port. Have the "
               "proxy in front send \"Host\" as it came (in nginx $http_host), or X-Forwarded-Port"));
}

std::optional<HttpResponse> AccessControl::Impl::refuse(IncomingRequest const& request)
{
    // A stranger can have a name lead to this machine, and browsers would take a page of that name for one of
    // ours (DNS rebinding).
    if (site.checks_hosts() && !site.knows_host(request.header("Host"))) {
        log.warning(LogCause("host", request.client),
                    concat("Refused a request to the name \"", core::printable(request.header("Host"), 200),
                           "\": if this machine is called so, add it to \"hostNames\""));
        return HttpResponse(421, std::string(core::html_type),
                            "This server has another name. Its operator can add this one to \"hostNames\".");
    }
    // A client that knows the token of a simulation may use it, from any page, as with a port of its own; and
    // so it is with the key of a monitor's page.
    if (request.upgrade && !core::is_path_of_key(request.path) &&
        !site.accepts_origin(request.header("Origin"), request.header("Host"))) {
        log_origin(request, "a WebSocket");
        return origin_refused();
    }
    if (request.upgrade && request.is_from_proxy)
        note_lost_port(request);
    if (request.path == session_path) { // the busiest one
        if (!server.starts_here || !site.checks_origins() || !is_of_refused_page(request))
            return std::nullopt;
        log_origin(request, "a start");
        return page_refused(request.header("Origin"));
    }
    return is_monitoring(request.path) ? refuse_monitor(request) : std::nullopt;
}

Answer AccessControl::respond(IncomingRequest const& request)
{
    auto answer = impl_->answer(request);
    if (auto* const response = std::get_if<HttpResponse>(&answer))
        dress_for_people(*response, request);
    return answer;
}

Answer AccessControl::Impl::answer(IncomingRequest const& request)
{
    // It came over the operator's socket. Whoever may open that is the operator; but people forward it to a
    // port of their own machine, which any page there could use.
    if (request.is_operator && !is_of_foreign_page(request))
        return endpoint.respond(request);
    if (request.is_operator)
        return foreign_page_refused();
    if (auto refusal = refuse(request)) {
        refusal->fixed_headers = guessed_types;
        return std::move(*refusal);
    }
    if (request.path.starts_with("/api/")) {
        auto const is_known = is_operators(request);
        if (!is_known)
            return too_many_guesses();
        // A wrong token is no refusal yet: some paths below /api/ are for others, too.
        if (*is_known) {
            if (is_of_foreign_page(request))
                return foreign_page_refused();
            auto operators = request;
            operators.is_operator = true;
            return endpoint.respond(operators);
        }
    }
    return answer_of_endpoint(request);
}

/// Headers for those that have none of their own. Apart from `answer`, since a function that returns one
/// variable makes it where its caller wants it: no answer is moved.
Answer AccessControl::Impl::answer_of_endpoint(IncomingRequest const& request)
{
    auto answer = endpoint.respond(request);
    if (auto* const response = std::get_if<HttpResponse>(&answer);
        response && response->fixed_headers.empty())
        response->fixed_headers = is_page(request.path) ? std::string_view(headers_of_pages) : guessed_types;
    return answer;
}

std::uint64_t AccessControl::max_body(IncomingRequest const& request)
{
    return impl_->endpoint.max_body(request);
}

boost::asio::awaitable<HttpResponse> AccessControl::respond_to_body(IncomingRequest const& request)
{
    if (request.is_operator && impl_->is_of_foreign_page(request))
        co_return foreign_page_refused();
    if (!request.is_operator) {
        if (auto refusal = impl_->refuse(request))
            co_return std::move(*refusal);
        if (impl_->is_of_refused_page(request)) {
            impl_->log_origin(request, "a request");
            co_return origin_refused();
        }
    }
    co_return co_await impl_->endpoint.respond_to_body(request);
}

boost::asio::awaitable<void> AccessControl::serve_websocket(ChannelInfo info, Channel& channel)
{
    return impl_->endpoint.serve_websocket(std::move(info), channel);
}

void AccessControl::stopping()
{
    impl_->endpoint.stopping();
}

void AccessControl::dress(HttpResponse& refusal, IncomingRequest const& request)
{
    dress_for_people(refusal, request);
}

} // namespace webots_cloud
