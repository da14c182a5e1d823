#include "secret_file.hpp"

#include "adapters/files/regular_file.hpp"
#include "core/text.hpp"

#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t max_file = 4096;
constexpr std::size_t min_length =
    16; // characters: random ones of 4 bits each make 64 bits, too many to guess
constexpr std::size_t min_password = 8; // who guesses it is slowed down

Failure refusal(std::filesystem::path const& file, std::string_view what, std::string_view why)
{
    return Failure(errc::invalid_config, core::concat(what, " in ", file.string(), ": ", why));
}

/// Whether others may do anything with a file. A group may read what belongs to root where we are somebody
/// else: that is how root, or Kubernetes, hands a secret to one service, which can't own it.
bool is_shared(std::filesystem::path const& file)
{
    struct stat found;
    if (::stat(file.c_str(), &found) != 0)
        return true;
    mode_t const allowed = found.st_uid == 0 && ::geteuid() != 0 ? S_IRGRP : 0;
    return (found.st_mode & (S_IRWXG | S_IRWXO) & ~allowed) != 0;
}

/// The text of a file that is not shared, without blanks at its ends.
result<std::string> read_own(std::filesystem::path const& file, std::string_view what)
{
    auto const text = read_regular_file(file, max_file);
    if (!text)
        return refusal(file, what, text.error().message());
    if (is_shared(file))
        return refusal(file, what, "others may read it too. Run: chmod 600 on it, and take a new one");
    return std::string(core::trim(*text));
}

} // namespace

result<std::string> read_secret(std::filesystem::path const& file, std::string_view what)
{
    auto word = read_own(file, what);
    if (word && (word->size() < min_length || word->find_first_of(" \t\r\n") != std::string::npos))
        return refusal(file, what,
                       "expected one word of at least 16 characters, as openssl rand -hex 32 makes them");
    return word;
}

result<std::string> read_password(std::filesystem::path const& file)
{
    constexpr std::string_view what = "the teachers' password";
    auto password = read_own(file, what);
    if (password && (password->size() < min_password || !core::is_printable(*password)))
        return refusal(file, what, "expected one line of at least 8 characters");
    return password;
}

} // namespace webots_cloud::adapters
