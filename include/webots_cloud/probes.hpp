// What `--doctor` asks of libraries: looks at files and other servers that change nothing there. All of these
// block: they are for threads that may wait.
#pragma once

#include <webots_cloud/certificate_facts.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/http.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

struct SmtpParams;

/// The first certificate of a PEM file; those after it are its chain. `host`: a name or a numeric address;
/// empty: any will do. `authorities`: as for `make_http_client`.
///
/// Errors: `invalid_config`, naming the file.
/// Thread-safety: any thread.
result<CertificateFacts> read_certificate(std::filesystem::path const& certificate, std::string const& host,
                                          std::filesystem::path const& authorities = {});

/// Connects to a mail server as for a mail, with STARTTLS and the login where there is a password, and says
/// goodbye. No mail is sent.
///
/// Errors: as of `Notifier::deliver`.
/// Thread-safety: any thread.
result<> try_mail_server(SmtpParams params);

/// Whether anybody answers at a URL to what fetches projects: by way of the proxy that the environment names,
/// if it does. The status of the answer, whatever it is.
///
/// Errors: `unreachable`, `timed_out`.
/// Thread-safety: any thread.
result<int> try_web_server(std::string const& url, Duration timeout);

/// A server of ours on this machine.
struct OwnServer
{
    OwnServer() = default;

    std::string address = "127.0.0.1"; ///< Numeric.
    std::uint16_t port = 0;
    bool tls = false; ///< Its certificate does not count: nobody is between us and this machine.
};

/// Its answer to `GET target`, whatever its status, in JSON where the server has that; at most a megabyte. It
/// is asked as `localhost`.
///
/// Errors: `unreachable`, `timed_out`, `protocol_error`; as of `find_watches`.
/// Thread-safety: any thread.
result<HttpResponse> ask_own_server(OwnServer const& server, std::string const& target, Duration limit);

/// Whether the kernel has watches of epoll left for the user of this program, which all
/// programs of a user share. To be asked before anything waits by Asio: without watches that waits for ever,
/// since Asio does not check that it could watch what wakes it.
///
/// Errors: `unavailable`, with what to do.
/// Thread-safety: any thread.
result<> find_watches();

/// How a program has ended.
struct ProgramEnd
{
    ProgramEnd() = default;

    int status = 0;     ///< Its exit status; of one that a signal has ended: 128 and the number of that.
    std::string output; ///< On both of its outputs, at most a megabyte.
};

/// Runs a program to its end; `command` begins with its path. It is killed after `limit`.
///
/// Errors: `start_failed`; `timed_out`.
/// Thread-safety: any thread.
result<ProgramEnd> run_program(std::vector<std::string> const& command, Duration limit);

/// What such a program prints.
///
/// Errors: `start_failed`, with what it printed, also where it exits with another status than 0; `timed_out`.
/// Thread-safety: any thread.
result<std::string> program_output(std::vector<std::string> const& command, Duration limit);

} // namespace webots_cloud
