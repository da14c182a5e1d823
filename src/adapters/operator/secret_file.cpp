#include "secret_file.hpp"

#include "adapters/files/regular_file.hpp"
#include "core/text.hpp"

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t max_file = 4096;
constexpr std::size_t min_length =
    16; // characters: random ones of 4 bits each make 64 bits, too many to guess

} // namespace

result<std::string> read_secret(std::filesystem::path const& file, std::string_view what)
{
    auto const refuse = [&](std::string_view why) {
        return Failure(errc::invalid_config, core::concat(what, " in ", file.string(), ": ", why));
    };
    std::error_code failed;
    auto const others = std::filesystem::perms::group_all | std::filesystem::perms::others_all;
    auto const text = read_regular_file(file, max_file);
    if (!text)
        return refuse(text.error().message());
    if ((std::filesystem::status(file, failed).permissions() & others) != std::filesystem::perms::none)
        return refuse("others may read it too. Run: chmod 600 on it, and take a new one");
    auto const word = core::trim(*text);
    if (word.size() < min_length || word.find_first_of(" \t\r\n") != std::string_view::npos)
        return refuse("expected one word of at least 16 characters, as openssl rand -hex 32 makes them");
    return std::string(word);
}

} // namespace webots_cloud::adapters
