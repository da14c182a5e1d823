// webots-website-host: an example of the website that starts simulations, the fourth actor of
// docs/protocol.md. Its page shows simulations and lets signed-in users change a controller; the simulation
// server fetches from it what they have changed.
#include "configuration.hpp"
#include "page.hpp"
#include "serve.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/secrets.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <optional>

using namespace website_host;
namespace fs = std::filesystem;
using webots_cloud::errc;
using webots_cloud::Failure;
using webots_cloud::result;

namespace {

constexpr auto name = "webots-website-host";
constexpr auto default_configuration = "config/website_host/local.json";
constexpr std::size_t max_key_file = 4096;
constexpr int exit_ok = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

constexpr auto help = "Usage: webots-website-host [OPTION...] [CONFIGURATION]\n"
                      "\n"
                      "An example of a website that starts simulations: it serves a page with a\n"
                      "simulation and an editor, and the scripts /ajax/download-project.php and\n"
                      "/ajax/upload-file.php. It ends on SIGTERM or SIGINT.\n"
                      "\n"
                      "CONFIGURATION is a file in JSON, config/website_host/local.json unless given.\n"
                      "Paths in it begin in the folder where this program is started.\n"
                      "examples/website_host/README.md describes its keys.\n"
                      "\n"
                      "  --check-config       read the configuration, say what is wrong with it, stop\n"
                      "  --move-ports=NUMBER  add this to \"port\", and to the port of \"sessionServer\"\n"
                      "                       where that is on this machine\n"
                      "  --help               show this text\n";

/// Without what would steer a terminal, whatever files and arguments are called.
std::string terminal_text(std::string sentence)
{
    std::replace_if(
        sentence.begin(), sentence.end(), [](unsigned char byte) { return byte < ' ' || byte == 0x7f; }, '?');
    return sentence;
}

int complain(std::string const& sentence)
{
    std::cerr << name << ": " << terminal_text(sentence) << std::endl;
    return exit_usage;
}

Failure file_failure(fs::path const& path, std::string const& why)
{
    return Failure(errc::invalid_config, path.string() + ": " + why);
}

/// The key that simulation servers know us by: the first line of the file, which is made with a new one if it
/// is not there.
result<std::string> read_or_make_key(fs::path const& path)
{
    std::error_code failed;
    fs::create_directories(path.parent_path(), failed);
    int const file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (file >= 0) {
        auto const line = webots_cloud::make_token() + "\n";
        bool const is_written = ::write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
        ::close(file);
        if (!is_written) {
            ::unlink(path.c_str());
            return file_failure(path, "the key can't be written.");
        }
    }
    auto const text = webots_cloud::read_regular_file(path, max_key_file);
    if (!text)
        return file_failure(path, "the key can't be read or made (" + text.error().message() + ").");
    auto key = text->substr(0, text->find_first_of("\r\n"));
    if (key.empty())
        return file_failure(path, "its first line is empty, but should be a key.");
    return key;
}

} // namespace

int main(int argc, char** argv)
{
    constexpr std::string_view move_option = "--move-ports=";
    bool only_check = false;
    int moved = 0;
    std::optional<fs::path> file;
    for (int i = 1; i < argc; ++i) {
        std::string_view const argument = argv[i];
        if (argument == "--help" || argument == "-h") {
            std::cout << help;
            return exit_ok;
        }
        if (argument == "--check-config")
            only_check = true;
        else if (argument.starts_with(move_option))
            moved = std::atoi(argv[i] + move_option.size());
        else if (argument.starts_with('-') || file)
            return complain("\"" + std::string(argument) + "\" was not expected: --help shows what is.");
        else
            file = argument;
    }
    auto configuration = read_configuration(file.value_or(default_configuration));
    if (!configuration)
        return complain(configuration.error().message());
    if (auto const done = move_ports(*configuration, moved); !done)
        return complain(done.error().message());
    auto page = Page::load(configuration->page_folder);
    if (!page)
        return complain(page.error().message());
    if (only_check) {
        std::cout << terminal_text(file.value_or(default_configuration).string()) << ": good" << std::endl;
        return exit_ok;
    }
    auto key = read_or_make_key(configuration->key_file);
    if (!key)
        return complain(key.error().message());
    auto const served = serve(*std::move(configuration), *std::move(page), *std::move(key));
    if (served)
        return exit_ok;
    complain(served.error().message());
    return exit_failed;
}
