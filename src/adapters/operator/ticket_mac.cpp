#include "adapters/files/file_descriptor.hpp"
#include "core/text.hpp"
#include "secret_file.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <unistd.h>

namespace webots_cloud {

namespace {

using Mac = std::function<std::string(std::string_view)>;

Mac mac_with(std::string secret)
{
    return [secret = std::move(secret)](std::string_view message) {
        std::array<unsigned char, EVP_MAX_MD_SIZE> code{};
        unsigned size = 0;
        HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
             reinterpret_cast<unsigned char const*>(message.data()), message.size(), code.data(), &size);
        return std::string(reinterpret_cast<char const*>(code.data()), size);
    };
}

/// A new file of one word, for its owner alone. 0, or an errno.
int write_word(std::filesystem::path const& file, std::string const& word)
{
    adapters::FileDescriptor const made(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    if (made.get() < 0)
        return errno;
    auto const line = word + "\n";
    return ::write(made.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size()) ? 0 : errno;
}

} // namespace

result<Mac> make_ticket_mac(std::filesystem::path const& file)
{
    auto secret = adapters::read_secret(file, "the secret of the session servers");
    if (!secret)
        return secret.error();
    return mac_with(std::move(*secret));
}

Mac make_own_mac(std::filesystem::path const& file, Logger const& log)
{
    constexpr std::string_view what = "the secret of this server";
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored)) {
        auto secret = adapters::read_secret(file, what);
        if (secret)
            return mac_with(std::move(*secret));
        log.warning(core::concat(secret.error().message(), "; a new one is made"));
        std::filesystem::remove(file, ignored);
    }
    auto const word = make_token();
    if (int const failed = write_word(file, word); failed != 0)
        log.warning(
            core::concat("Browsers that wait will lose their places when this server restarts, since ",
                         file.string(), " can't be written: ", std::generic_category().message(failed)));
    return mac_with(word);
}

} // namespace webots_cloud
