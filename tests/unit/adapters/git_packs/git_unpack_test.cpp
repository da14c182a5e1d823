// From a layout to a folder of files.
#include "unit_test.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/git_packs/git_unpack.hpp"

#include <fcntl.h>
#include <stdlib.h>

#include <filesystem>

using namespace webots_cloud;
using namespace webots_cloud::adapters;

BOOST_AUTO_TEST_SUITE(git_unpack)

BOOST_AUTO_TEST_CASE(it_stops_at_any_file_when_it_is_told_to)
{
    char name[] = "/tmp/webots_cloud_unpack_XXXXXX";
    std::filesystem::path const place = ::mkdtemp(name);
    GitStaging const staging(-1);
    std::vector<core::GitLayoutItem> layout(3);
    for (std::size_t i = 0; i < layout.size(); ++i) {
        layout[i].kind = core::GitTreeEntry::Kind::folder;
        layout[i].path = std::string(1, static_cast<char>('a' + i));
    }
    for (std::size_t most = 0; most <= layout.size(); ++most) {
        std::size_t asked = 0;
        auto const interrupt = [&]() -> result<> {
            return asked++ < most ? result<>() : result<>(Failure(errc::timed_out));
        };
        auto const root = make_folder(AT_FDCWD, (place / std::to_string(most)).c_str());
        auto const unpacked = unpack_git_folder(layout, staging, {}, root->get(), interrupt);
        BOOST_TEST(unpacked.has_value() == (most == layout.size()));
        for (std::size_t i = 0; i < layout.size(); ++i)
            BOOST_TEST(std::filesystem::exists(place / std::to_string(most) / layout[i].path) == (i < most));
    }
    (void)remove_tree(place);
}

BOOST_AUTO_TEST_SUITE_END()
