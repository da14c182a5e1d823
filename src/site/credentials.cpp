// Certificates are made by the program openssl, as people would do it by hand, in a folder of their own, and
// copied when they are whole. Nothing that exists is overwritten.
#include "credentials.hpp"

#include "adapters/process/program_output.hpp"
#include "app/daemon.hpp"
#include "app/environment.hpp"
#include "core/text.hpp"
#include "log_folder.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/secrets.hpp>

#include <array>
#include <cstdlib>
#include <iostream>

#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::string_view name_letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-";
constexpr Duration openssl_limit = std::chrono::seconds(60);
constexpr std::size_t max_pem = std::size_t{1} << 20;

bool is_there(fs::path const& path)
{
    struct stat found;
    return ::lstat(path.c_str(), &found) == 0;
}

bool is_inside(fs::path const& path)
{
    return path.is_relative() && path.native().find("..") == std::string::npos;
}

/// What other machines may call this one: the certificate of a simulation server is for the session server's
/// eyes.
std::string own_names()
{
    std::string names;
    std::array<char, 256> host{};
    if (::gethostname(host.data(), host.size() - 1) == 0 && host[0] != '\0' &&
        std::string_view(host.data()).find_first_not_of(name_letters) == std::string_view::npos)
        names += concat(",DNS:", host.data());
    for (auto const& each : own_ipv4_addresses())
        if (!each.starts_with("127."))
            names += concat(",IP:", each);
    for (auto const& each : own_ipv6_addresses())
        if (each != "::1" && !each.starts_with("fe80"))
            names += concat(",IP:", each);
    return names;
}

/// Writes `key` and `certificate` into a folder.
result<> run_openssl(std::string const& name, fs::path const& folder)
{
    auto const openssl = app::find_system_program("openssl");
    if (openssl.empty())
        return Failure(errc::not_found, "No certificate can be made without openssl: apt install openssl");
    auto const names = concat("subjectAltName=DNS:", name, ",DNS:localhost,IP:127.0.0.1,IP:::1", own_names());
    auto const end = adapters::run_program(
        {openssl.string(), "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
         "-nodes", "-days", "365", "-subj", "/CN=" + name, "-addext", names, "-keyout",
         (folder / "key").string(), "-out", (folder / "certificate").string()},
        openssl_limit);
    if (!end)
        return end.error();
    return end->status == 0 ? result<>()
                            : result<>(Failure(errc::start_failed, std::string(core::trim(end->output))));
}

result<> copy_pem(fs::path const& from, fs::path const& to, mode_t mode)
{
    auto const text = read_regular_file(from, max_pem);
    if (!text)
        return text.error();
    std::error_code failed;
    if (to.has_parent_path())
        fs::create_directories(to.parent_path(), failed);
    auto const written = write_new_file(to, *text, mode);
    return written ? written
                   : result<>(Failure(errc::unavailable,
                                      concat(to.string(), " can't be written: ", written.error().message())));
}

/// A file of ours with one word, unless it is there. `what` as in "password for teachers".
result<> make_word(std::string_view what, fs::path const& file, std::optional<std::string> (*make)())
{
    if (file.begin() == file.end() || *file.begin() != "log" || !is_inside(file))
        return {};
    if (auto const usable = set_aside_unless_file(file); !usable)
        return usable;
    struct stat found;
    if (::stat(file.c_str(), &found) == 0 && found.st_size > 0)
        return {};
    auto const word = make();
    if (!word)
        return Failure(errc::unavailable, concat("No ", what, " could be made."));
    if (auto const written = write_new_file(file, *word + "\n", 0600); !written)
        return Failure(errc::unavailable, concat("The ", what, " can't be written to ", file.string(),
                                                 ": is the disk full? (", written.error().message(), ")"));
    return {};
}

} // namespace

std::optional<std::string> certificate_name(std::string_view server)
{
    auto const name = server.substr(0, server.find(':'));
    auto const rest = server.substr(name.size());
    bool const has_good_port = rest.empty() || core::parse_port(rest.substr(1)) != 0;
    if (name.empty() || name.find_first_not_of(name_letters) != std::string_view::npos || !has_good_port)
        return std::nullopt;
    return std::string(name);
}

bool are_ours(fs::path const& certificate, fs::path const& key)
{
    return !certificate.empty() && !key.empty() && is_inside(certificate) && is_inside(key);
}

result<> make_certificate(Settings const& settings)
{
    if (!are_ours(settings.certificate, settings.key) || is_there(settings.certificate) ||
        is_there(settings.key))
        return {};
    auto const name = certificate_name(settings.address.host);
    if (!name)
        return Failure(errc::invalid_argument, concat("No certificate is made for \"", settings.address.host,
                                                      "\": put one into ", settings.certificate.string(),
                                                      ", and its key into ", settings.key.string(), "."));
    auto folder = (app::temporary_folder() / "webots_site_XXXXXX").string();
    if (!::mkdtemp(folder.data()))
        return Failure(errc::unavailable,
                       concat("No folder can be made in ", app::temporary_folder().string(),
                              " for a certificate: is the disk full?"));
    auto made = run_openssl(*name, folder);
    if (!made)
        made = Failure(errc::start_failed, concat(made.error().message(),
                                                  "\nopenssl could not make a certificate for ", *name, "."));
    if (made)
        made = copy_pem(fs::path(folder) / "key", settings.key, 0600);
    if (made)
        made = copy_pem(fs::path(folder) / "certificate", settings.certificate, 0644);
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    if (made)
        std::cout << app::terminal_text(concat(
                         "Made ", settings.certificate.string(), " for ", *name,
                         ", valid for a year. Nobody vouches for it, so browsers warn: replace it and ",
                         settings.key.string(), " by real ones."))
                  << std::endl;
    return made;
}

std::optional<std::string> password_from(std::string_view random_bytes)
{
    constexpr std::string_view letters = "abcdefghjkmnpqrstuvwxyz";
    constexpr std::size_t fair = 256 / letters.size() * letters.size(); // all letters are as likely
    constexpr std::size_t length = 12;
    constexpr std::size_t group = 4;
    std::string password;
    std::size_t count = 0;
    for (char const c : random_bytes) {
        auto const byte = static_cast<unsigned char>(c);
        if (byte >= fair || count == length)
            continue;
        if (count > 0 && count % group == 0)
            password += '-';
        password += letters[byte % letters.size()];
        ++count;
    }
    return count == length ? std::optional(std::move(password)) : std::nullopt;
}

result<> make_teacher_password(Settings const& settings)
{
    constexpr std::size_t enough = 100;
    return make_word("password for teachers", settings.teacher_password_file,
                     [] { return password_from(random_bytes(enough)); });
}

result<> make_operator_token(Settings const& settings)
{
    return make_word("token of the operator", settings.operator_token_file,
                     [] { return std::optional(make_token()); });
}

} // namespace webots_cloud::site
