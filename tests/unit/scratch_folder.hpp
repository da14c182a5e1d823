// A folder of a test's own.
#pragma once

#include "unit_test.hpp"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace webots_cloud {

/// Empty, and gone at the end with all that is in it. Fixtures derive from it: what they hold there goes
/// first.
struct ScratchFolder
{
    ScratchFolder()
    {
        auto name = (std::filesystem::temp_directory_path() / "webots_cloud_test_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
    }
    ScratchFolder(ScratchFolder const&) = delete;
    ScratchFolder& operator=(ScratchFolder const&) = delete;
    ~ScratchFolder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(folder, ignored);
    }

    std::filesystem::path folder;
};

} // namespace webots_cloud
