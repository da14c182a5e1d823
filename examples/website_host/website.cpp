// Answers requests to the website host: its pages, signing in and out, files that users save, and the
// archives that simulation servers ask for.
#include "website.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json.hpp>

#include <algorithm>
#include <chrono>
#include <optional>

namespace website_host {

namespace asio = boost::asio;
namespace json = boost::json;
using webots_cloud::Answer;
using webots_cloud::errc;
using webots_cloud::HttpResponse;
using webots_cloud::IncomingRequest;

namespace {

constexpr std::string_view download_path = "/ajax/download-project.php";
constexpr std::string_view upload_path = "/ajax/upload-file.php";
constexpr std::string_view sign_in_path = "/ajax/sign-in";
constexpr std::string_view sign_out_path = "/ajax/sign-out";

constexpr std::string_view cookie_attributes = "; Path=/; HttpOnly; SameSite=Strict";

constexpr std::uint64_t max_form = std::uint64_t{64} << 10;
constexpr std::uint64_t max_upload = std::uint64_t{2} << 20; // as PHP's upload_max_filesize
constexpr auto wrong_key_delay = std::chrono::seconds(1);    // who guesses keys is slow

// An address may be wrong 20 times at once, and once a minute from then on. All together have no limit: each
// of them waits for a second.
constexpr webots_cloud::Guesses guesses_of_address{20, 1.0 / 60};
constexpr webots_cloud::Guesses guesses_of_all{0, 0};

constexpr std::string_view too_many_guesses =
    "Error: Too many wrong passwords or keys came from your address. Please try again in a minute.";

bool is_script(std::string_view path)
{
    return path == download_path || path == upload_path || path == sign_in_path || path == sign_out_path;
}

/// Of a script.
HttpResponse answer(std::string text, int status = 200)
{
    HttpResponse response(status, "text/plain; charset=UTF-8", std::move(text));
    response.headers.emplace_back("X-Robots-Tag", "noindex");
    response.headers.emplace_back("Cache-Control", "no-store");
    return response;
}

/// The browser forgets who it is. Other browsers of the same user stay signed in.
HttpResponse signed_out()
{
    auto response = answer("OK");
    for (auto const* const name : {"email", "password"})
        response.headers.emplace_back("Set-Cookie",
                                      std::string(name) + "=; Max-Age=0" + std::string(cookie_attributes));
    return response;
}

/// The same time for every text of that length: it tells nothing of how much was right.
bool equal_in_constant_time(std::string_view left, std::string_view right)
{
    if (left.size() != right.size())
        return false;
    unsigned differences = 0;
    for (std::size_t i = 0; i < left.size(); ++i)
        differences |= static_cast<unsigned char>(left[i]) ^ static_cast<unsigned char>(right[i]);
    return differences == 0;
}

std::optional<std::string> cookie(IncomingRequest const& request, std::string_view name)
{
    auto rest = request.header("Cookie");
    while (!rest.empty()) {
        auto pair = rest.substr(0, rest.find(';'));
        rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
        pair.remove_prefix(std::min(pair.size(), pair.find_first_not_of(' ')));
        if (pair.starts_with(name) && pair.substr(name.size()).starts_with('='))
            return percent_decoded(pair.substr(name.size() + 1));
    }
    return std::nullopt;
}

std::string percent_encoded(std::string_view text)
{
    constexpr std::string_view digits = "0123456789ABCDEF";
    std::string result;
    for (char const c : text) {
        auto const byte = static_cast<unsigned char>(c);
        bool const is_plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        if (is_plain)
            result.push_back(c);
        else
            result.append({'%', digits[byte >> 4], digits[byte & 15]});
    }
    return result;
}

std::string const* field(Form const& form, std::string_view name)
{
    auto const found = form.find(name);
    return found == form.end() ? nullptr : &found->second;
}

/// What is wrong with the fields of `download-project.php` whatever they say, or empty.
std::string missing_in_download(Form const& form)
{
    for (auto const* const name : {"user1Id", "user1Authentication", "key", "project"})
        if (!field(form, name))
            return "Error: Missing " + std::string(name) + ".";
    return {};
}

/// The same of `upload-file.php`.
std::string missing_in_upload(IncomingRequest const& request, Form const& form)
{
    for (auto const* const name : {"email", "password"})
        if (!cookie(request, name))
            return "Error: Missing " + std::string(name) + " cookie.";
    for (auto const* const name : {"dirname", "filename", "content"})
        if (!field(form, name))
            return "Error: missing " + std::string(name) + ".";
    if (form.at("filename").find('/') != std::string::npos || !is_plain_name(form.at("filename")))
        return "Error: wrong filename.";
    return {};
}

asio::awaitable<HttpResponse> run(std::function<HttpResponse()> work)
{
    co_return work();
}

asio::awaitable<void> wait(std::chrono::steady_clock::duration time)
{
    asio::steady_timer timer(co_await asio::this_coro::executor, time);
    co_await timer.async_wait(asio::use_awaitable);
}

} // namespace

Website::Website(Configuration configuration, Page page, std::string key, asio::thread_pool& disk,
                 webots_cloud::Logger log)
    : configuration_(std::move(configuration)), page_(std::move(page)), key_(std::move(key)),
      guesses_(guesses_of_address, guesses_of_all), files_(configuration_.users_folder), disk_(disk),
      log_(std::move(log))
{
    for (auto const& user : configuration_.users)
        accounts_.push_back({user, webots_cloud::make_token()});
}

/// A page of another host can have its own name lead to our address, and would then be of our origin.
bool Website::is_ours(Request const& request) const
{
    auto host = request.header("Host");
    if (auto const colon = host.rfind(':');
        colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos)
        host = host.substr(0, colon);
    return std::any_of(
        configuration_.hosts.begin(), configuration_.hosts.end(),
        [&](std::string const& name) { return webots_cloud::equal_ignoring_case(name, host); });
}

/// Browsers send our cookies with the requests of every page of this host, whatever its port.
bool Website::comes_from_elsewhere(Request const& request) const
{
    auto const origin = request.header("Origin");
    auto const host = request.header("Host");
    return !origin.empty() && origin != "http://" + std::string(host) &&
           origin != "https://" + std::string(host);
}

Website::Account const* Website::account(std::string_view id, std::string_view token) const
{
    for (auto const& account : accounts_)
        if (std::to_string(account.user.id) == id && equal_in_constant_time(account.token, token))
            return &account;
    return nullptr;
}

Website::Account const* Website::signed_in(Request const& request) const
{
    auto const email = cookie(request, "email");
    auto const password = cookie(request, "password");
    for (auto const& account : accounts_)
        if (email == account.user.email && password && equal_in_constant_time(account.token, *password))
            return &account;
    return nullptr;
}

Answer Website::respond(Request const& request)
{
    if (!is_ours(request))
        return answer("This server has another name. Its operator can add this one to \"hosts\".\r\n", 421);
    if (request.upgrade)
        return answer("There are no WebSockets here.\r\n", 404);
    if (request.path == download_path)
        return answer(missing_in_download(Form()));
    if (request.path == upload_path)
        return answer(missing_in_upload(request, Form()));
    if (request.method != "GET" && request.method != "HEAD")
        return answer("Only GET is possible here.\r\n", 405);
    if (request.path == "/")
        return page_.html(configuration_.session_server);
    if (request.path == "/site.json")
        return site(request);
    if (auto body = page_.file(request.path)) {
        HttpResponse response(200, request.path.ends_with(".css") ? "text/css" : "text/javascript", {});
        response.headers.emplace_back("Cache-Control", "no-cache");
        response.shared = std::move(body);
        return response;
    }
    return answer("There is nothing here.\r\n", 404);
}

std::uint64_t Website::max_body(Request const& request)
{
    if (request.method != "POST" || !is_script(request.path) || !is_ours(request))
        return 0;
    return request.path == upload_path && signed_in(request) ? max_upload : max_form;
}

asio::awaitable<HttpResponse> Website::respond_to_body(Request const& request)
{
    auto form = parse_form(request.header("Content-Type"), request.body);
    if (!form)
        co_return answer("Error: " + form.error().message(), 400);
    auto response = co_await run_script(request, *std::move(form));
    note(request, response);
    co_return response;
}

asio::awaitable<HttpResponse> Website::run_script(Request const& request, Form form)
{
    if (request.path == download_path) {
        auto response = co_await download(std::string(request.quota_key), std::move(form));
        co_return response;
    }
    if (comes_from_elsewhere(request))
        co_return answer("Error: This page belongs to another website.", 403);
    if (request.path == upload_path) {
        auto response = co_await upload(request, std::move(form));
        co_return response;
    }
    if (request.path == sign_out_path)
        co_return signed_out();
    auto response = co_await sign_in(std::string(request.quota_key), std::move(form));
    co_return response;
}

/// Tells the operator what a script has answered.
void Website::note(Request const& request, Response const& response) const
{
    auto const said = response.content_type == "application/zip"
                          ? std::to_string(response.body.size()) + " bytes"
                          : response.body;
    log_.info(webots_cloud::LogCause(request.path, request.client),
              std::string(request.path) + " (" + std::string(request.client) + "): " + said);
}

asio::awaitable<void> Website::serve_websocket(webots_cloud::ChannelInfo, webots_cloud::Channel&)
{
    co_return;
}

/// `<project>/<folder>/...`: plain names, of a project that the page offers.
bool Website::is_folder_of_project(std::string_view dirname) const
{
    constexpr int max_depth = 8;
    auto const& projects = configuration_.projects;
    auto const project = dirname.substr(0, dirname.find('/'));
    if (std::none_of(projects.begin(), projects.end(), [&](Project const& p) { return p.name == project; }))
        return false;
    for (int depth = 0; depth < max_depth; ++depth) {
        auto const name = dirname.substr(0, dirname.find('/'));
        if (!is_plain_name(name))
            return false;
        if (name.size() == dirname.size())
            return true;
        dirname.remove_prefix(name.size() + 1);
    }
    return false;
}

/// What the page has to know.
HttpResponse Website::site(Request const& request) const
{
    json::object site;
    site["sessionServer"] = configuration_.session_server;
    site["hint"] = configuration_.hint;
    auto& projects = site["projects"].emplace_array();
    for (auto const& project : configuration_.projects)
        projects.push_back(json::object{{"name", project.name},
                                        {"world", project.world},
                                        {"controller", project.controller},
                                        {"title", project.title}});
    if (auto const* const account = signed_in(request))
        site["user"] = json::object{{"id", std::to_string(account->user.id)},
                                    {"name", account->user.name},
                                    {"authentication", account->token}};
    HttpResponse response(200, "application/json", json::serialize(site));
    response.headers.emplace_back("Cache-Control", "no-store");
    return response;
}

asio::awaitable<HttpResponse> Website::sign_in(std::string client, Form form)
{
    if (!guesses_.may_try(client, std::chrono::steady_clock::now()))
        co_return answer(std::string(too_many_guesses), 429);
    auto const* const email = field(form, "email");
    auto const* const password = field(form, "password");
    for (auto const& account : accounts_)
        if (email && password && *email == account.user.email &&
            equal_in_constant_time(account.user.password, *password)) {
            auto response = answer("OK");
            response.headers.emplace_back("Set-Cookie", "email=" + percent_encoded(*email) +
                                                            std::string(cookie_attributes));
            response.headers.emplace_back("Set-Cookie",
                                          "password=" + account.token + std::string(cookie_attributes));
            co_return response;
        }
    guesses_.count_wrong(client,
                         std::chrono::steady_clock::now()); // before others of that client are answered
    co_await wait(wrong_key_delay);
    co_return answer("Error: This e-mail address and this password do not belong together.", 403);
}

/// Protocol, 5.3.
asio::awaitable<HttpResponse> Website::download(std::string client, Form form)
{
    if (auto missing = missing_in_download(form); !missing.empty())
        co_return answer(std::move(missing));
    if (!guesses_.may_try(client, std::chrono::steady_clock::now()))
        co_return answer(std::string(too_many_guesses));
    if (!equal_in_constant_time(form.at("key"), key_)) {
        guesses_.count_wrong(client, std::chrono::steady_clock::now());
        co_await wait(wrong_key_delay);
        co_return answer("Error: Wrong key.");
    }
    auto const project = form.at("project");
    if (project.find("..") != std::string::npos ||
        !is_plain_name(project)) // with a slash, it is no plain name
        co_return answer("Error: Wrong project.");
    auto const* const owner = account(form.at("user1Id"), form.at("user1Authentication"));
    if (!owner) {
        co_await wait(wrong_key_delay);
        co_return answer("Error: Wrong user1Authentication: please sign in again.");
    }
    auto const user = owner->user.id;
    std::function<HttpResponse()> work = [this, user, project] {
        auto zip = files_.zip(user, project);
        if (!zip && zip.error() == errc::not_found)
            return answer("Error: no such directory: '" + UserFiles::name_of(user, project) + "'.");
        if (!zip)
            return answer("Error: " + zip.error().message());
        auto response = answer(*std::move(zip));
        response.content_type = "application/zip";
        response.headers.emplace_back("Content-disposition", "attachment; filename=" + project + ".zip");
        return response;
    };
    auto response = co_await on_disk(std::move(work));
    co_return response;
}

/// Protocol, 5.4.
asio::awaitable<HttpResponse> Website::upload(Request const& request, Form form) const
{
    if (auto missing = missing_in_upload(request, form); !missing.empty())
        co_return answer(std::move(missing));
    auto const dirname = form.at("dirname");
    if (!is_folder_of_project(dirname))
        co_return answer("Error: wrong dirname.");
    auto const* const account = signed_in(request);
    if (!account) {
        co_await wait(wrong_key_delay);
        co_return answer("Error: Please sign in again.");
    }
    auto const user = account->user.id;
    auto filename = form.at("filename");
    auto content = std::move(form.at("content"));
    std::function<HttpResponse()> work = [this, user, dirname, filename = std::move(filename),
                                          content = std::move(content)] {
        auto const saved = files_.save(user, dirname, filename, content);
        if (saved)
            return answer("OK");
        return answer((saved.error() == errc::too_large ? "Error: Disk quota exceeded:<br>" : "Error: ") +
                      saved.error().message());
    };
    auto response = co_await on_disk(std::move(work));
    co_return response;
}

/// The disk may be slow; others are answered meanwhile.
asio::awaitable<HttpResponse> Website::on_disk(std::function<Response()> work) const
{
    auto job = run(std::move(work));
    auto response = co_await asio::co_spawn(disk_, std::move(job), asio::use_awaitable);
    co_return response;
}

} // namespace website_host
