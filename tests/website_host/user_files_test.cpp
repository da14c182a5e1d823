#include "unit_test.hpp"

#include "user_files.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>

using namespace website_host;
using webots_cloud::errc;
namespace fs = std::filesystem;

namespace {

fs::path make_folder()
{
    auto pattern = (fs::temp_directory_path() / "webots_cloud_users_XXXXXX").string();
    BOOST_TEST_REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    return pattern;
}

struct Folder
{
    Folder()
    {
        outside = top / "outside";
        fs::create_directory(outside);
        write(outside / "secret.py", "secret");
    }
    ~Folder() { fs::remove_all(top); }

    static void write(fs::path const& file, std::string const& text)
    {
        fs::create_directories(file.parent_path());
        std::ofstream(file) << text;
    }

    fs::path user(unsigned id) const { return top / "user" / std::to_string(id) / "projects"; }

    fs::path top = make_folder();
    fs::path outside;
    UserFiles files{top / "user"};
};

std::string read(fs::path const& file)
{
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// What another program finds in a zip file.
std::map<std::string, std::string> unpack(std::string const& zip)
{
    auto const close = [](archive* reader) { ::archive_read_free(reader); };
    std::unique_ptr<archive, decltype(close)> const reader(::archive_read_new(), close);
    ::archive_read_support_format_zip(reader.get());
    std::map<std::string, std::string> found;
    BOOST_TEST_REQUIRE(::archive_read_open_memory(reader.get(), zip.data(), zip.size()) == ARCHIVE_OK);
    archive_entry* entry = nullptr;
    while (::archive_read_next_header(reader.get(), &entry) == ARCHIVE_OK) {
        BOOST_TEST((::archive_entry_filetype(entry) == AE_IFREG));
        std::string content(static_cast<std::size_t>(::archive_entry_size(entry)), '\0');
        BOOST_TEST(::archive_read_data(reader.get(), content.data(), content.size()) ==
                   static_cast<la_ssize_t>(content.size()));
        found.emplace(::archive_entry_pathname(entry), content);
    }
    return found;
}

} // namespace

BOOST_AUTO_TEST_SUITE(user_files)

BOOST_AUTO_TEST_CASE(names_that_lead_elsewhere_are_not_plain)
{
    for (auto const* const good : {"robots", "avoid_walls.py", "a-b c.1", "Makefile"})
        BOOST_TEST(is_plain_name(good), good);
    for (auto const& bad :
         {std::string(), std::string("."), std::string(".."), std::string(".git"), std::string("a/b"),
          std::string("a\\b"), std::string("a\0b", 3), std::string("a\nb"), std::string(" a"),
          std::string("caf\xc3\xa9"), std::string("a:b"), std::string(101, 'a')})
        BOOST_TEST(!is_plain_name(bad), bad);
}

BOOST_AUTO_TEST_CASE(what_is_saved_is_in_the_zip_file_and_nobody_elses)
{
    Folder const folder;
    BOOST_TEST((folder.files.zip(1, "robots").error() == errc::not_found));
    std::string const binary("\0\xff\r\n", 4);
    BOOST_TEST(folder.files.save(1, "robots/controllers/drive", "drive.py", "CRUISE = 1\n").has_value());
    BOOST_TEST(folder.files.save(1, "robots/controllers/drive", "drive.py", "CRUISE = 2\n").has_value());
    BOOST_TEST(folder.files.save(1, "robots/controllers/drive", "table.bin", binary).has_value());
    BOOST_TEST(folder.files.save(2, "robots/controllers/drive", "other.py", "of another user").has_value());
    BOOST_TEST(
        folder.files.save(1, "patrol/controllers/drive", "other.py", "of another project").has_value());
    auto const found = unpack(folder.files.zip(1, "robots").value());
    BOOST_TEST(found.size() == 2u);
    BOOST_TEST(found.at("controllers/drive/drive.py") == "CRUISE = 2\n");
    BOOST_TEST(found.at("controllers/drive/table.bin") == binary);
    BOOST_TEST(std::distance(fs::directory_iterator(folder.user(1) / "robots/controllers/drive"), {}) == 2);
}

BOOST_AUTO_TEST_CASE(links_pipes_and_second_names_are_neither_packed_nor_written_through)
{
    Folder const folder;
    auto const project = folder.user(1) / "robots" / "controllers";
    Folder::write(project / "own.py", "own");
    Folder::write(project / ".hidden", "hidden");
    fs::create_symlink(folder.outside / "secret.py", project / "link.py");
    fs::create_symlink(folder.outside, project / "folder");
    fs::create_hard_link(folder.outside / "secret.py", project / "second.py");
    BOOST_TEST_REQUIRE(::mkfifo((project / "pipe.py").c_str(), 0600) == 0);
    auto const found = unpack(folder.files.zip(1, "robots").value());
    BOOST_TEST(found.size() == 1u);
    BOOST_TEST(found.at("controllers/own.py") == "own");

    BOOST_TEST(
        (folder.files.save(1, "robots/controllers/folder", "secret.py", "x").error() == errc::unavailable));
    for (auto const* const name : {"link.py", "second.py", "pipe.py"})
        BOOST_TEST(folder.files.save(1, "robots/controllers", name, "replaced").has_value(), name);
    BOOST_TEST(read(folder.outside / "secret.py") == "secret");
    BOOST_TEST(read(project / "link.py") == "replaced");

    fs::create_directories(folder.top / "user" / "3");
    fs::create_symlink(folder.outside, folder.top / "user" / "3" / "projects");
    BOOST_TEST(!folder.files.save(3, "robots", "secret.py", "x").has_value());
    fs::create_symlink(folder.outside, folder.top / "user" / "4");
    BOOST_TEST(!folder.files.save(4, "robots", "secret.py", "x").has_value());
    fs::create_symlink(folder.outside, folder.user(1) / "linked");
    BOOST_TEST((folder.files.zip(1, "linked").error() == errc::not_found));
    BOOST_TEST(std::distance(fs::directory_iterator(folder.outside), {}) == 1);
}

BOOST_AUTO_TEST_CASE(a_user_has_10_megabytes_in_all_projects_together)
{
    Folder const folder;
    std::string const much(2'500'000, 'x');
    for (auto const* const name : {"a", "b", "c"})
        BOOST_TEST(folder.files.save(1, "robots", name, much).has_value());
    BOOST_TEST(folder.files.save(1, "patrol", "d", much).has_value());
    auto const beyond = folder.files.save(1, "patrol", "e", "x").error();
    BOOST_TEST((beyond == errc::too_large));
    BOOST_TEST(beyond.message() == "You would use 10.1 MB in 5 files; 10 MB in 1000 files are allowed.");
    BOOST_TEST(!fs::exists(folder.user(1) / "patrol" / "e"));
    BOOST_TEST(folder.files.save(1, "robots", "a", "smaller").has_value(),
               "it takes the place of the larger one");
    BOOST_TEST(folder.files.save(1, "patrol", "e", "x").has_value());
    BOOST_TEST(folder.files.save(2, "robots", "a", much).has_value(), "another user");
}

BOOST_AUTO_TEST_CASE(a_user_has_1000_files)
{
    Folder const folder;
    for (std::size_t i = 0; i < max_files; ++i)
        Folder::write(folder.user(1) / "robots" / ("f" + std::to_string(i)), "");
    BOOST_TEST((folder.files.save(1, "robots", "one_more", "").error() == errc::too_large));
}

BOOST_AUTO_TEST_SUITE_END()
