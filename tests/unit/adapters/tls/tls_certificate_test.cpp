#include "unit_test.hpp"

#include "adapters/tls/tls_certificate.hpp"

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

using namespace webots_cloud;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(tls_certificate)

BOOST_AUTO_TEST_CASE(a_certificate_that_is_a_pipe_is_refused_in_words)
{
    std::string folder = (fs::temp_directory_path() / "webots_cloud_tls_XXXXXX").string();
    BOOST_TEST_REQUIRE(::mkdtemp(folder.data()) != nullptr);
    auto const name = fs::path(folder) / "pipe";
    BOOST_TEST_REQUIRE(::mkfifo(name.c_str(), 0600) == 0);
    auto const loaded = adapters::load_tls_context(name, name);
    fs::remove_all(folder);
    BOOST_TEST(loaded.error().message() ==
               "the certificate " + name.string() + " can't be used: it is no regular file");
}

BOOST_AUTO_TEST_SUITE_END()
