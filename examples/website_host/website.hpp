// What the website host answers.
#pragma once

#include "configuration.hpp"
#include "form.hpp"
#include "page.hpp"
#include "user_files.hpp"

#include <webots_cloud/guess_limit.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/thread_pool.hpp>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace website_host {

/// The scripts of section 5 of the protocol, `/ajax/download-project.php` and `/ajax/upload-file.php`;
/// `/ajax/sign-in`, and the page with what it needs.
class Website final : public webots_cloud::Endpoint
{
public:
    /// `key`: what simulation servers have to send. `disk` is a pool of one thread, on which files are used.
    ///
    /// Lifetime: `disk` must outlive it.
    Website(Configuration configuration, Page page, std::string key, boost::asio::thread_pool& disk,
            webots_cloud::Logger log);

    webots_cloud::Answer respond(webots_cloud::IncomingRequest const& request) override;
    std::uint64_t max_body(webots_cloud::IncomingRequest const& request) override;
    boost::asio::awaitable<webots_cloud::HttpResponse>
    respond_to_body(webots_cloud::IncomingRequest const& request) override;
    boost::asio::awaitable<void> serve_websocket(webots_cloud::ChannelInfo info,
                                                 webots_cloud::Channel& channel) override;

private:
    using Request = webots_cloud::IncomingRequest;
    using Response = webots_cloud::HttpResponse;

    /// A user, and the word that stands for the password since this program was started.
    struct Account
    {
        User user;
        std::string token;
    };

    bool is_ours(Request const& request) const;
    bool comes_from_elsewhere(Request const& request) const;
    Account const* signed_in(Request const& request) const;
    Account const* account(std::string_view id, std::string_view token) const;
    bool is_folder_of_project(std::string_view dirname) const;
    Response site(Request const& request) const;
    boost::asio::awaitable<Response> sign_in(std::string client, Form form);
    boost::asio::awaitable<Response> download(std::string client, Form form);
    boost::asio::awaitable<Response> upload(Request const& request, Form form) const;
    boost::asio::awaitable<Response> on_disk(std::function<Response()> work) const;
    boost::asio::awaitable<Response> run_script(Request const& request, Form form);
    void note(Request const& request, Response const& response) const;

    Configuration configuration_;
    Page page_;
    std::string key_;
    std::vector<Account> accounts_;
    webots_cloud::GuessLimit guesses_;
    UserFiles files_;
    boost::asio::thread_pool& disk_;
    webots_cloud::Logger log_;
};

} // namespace website_host
