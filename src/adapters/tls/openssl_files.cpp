#include "openssl_files.hpp"

#include "core/text.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <cerrno>
#include <sys/stat.h>
#include <system_error>

namespace webots_cloud::adapters {

using core::concat;

int no_passphrase(char*, int, int, void*)
{
    return -1;
}

std::string openssl_reason()
{
    auto const first = ERR_peek_error();
    ERR_clear_error();
    if (ERR_SYSTEM_ERROR(first))
        return std::system_category().message(static_cast<int>(ERR_GET_REASON(first)));
    char const* const reason = ERR_reason_error_string(first);
    return reason ? reason : "unknown reason";
}

std::string reading_reason(std::string_view wanted)
{
    return concat("expected ", wanted, ", found something else (", openssl_reason(), ")");
}

bool was_last_part()
{
    bool const was_last = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    if (was_last)
        ERR_clear_error();
    return was_last;
}

std::string file_stamp(std::filesystem::path const& file)
{
    struct stat found
    {};
    if (::stat(file.c_str(), &found) != 0)
        return concat("error ", std::to_string(errno));
    return concat(std::to_string(found.st_ino), " ", std::to_string(found.st_size), " ",
                  std::to_string(found.st_mtim.tv_sec), ".", std::to_string(found.st_mtim.tv_nsec));
}

} // namespace webots_cloud::adapters
