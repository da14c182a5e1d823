// The contract of ProjectSource, for each source. The git source fetches from a small server of the test;
// tests/integration/git_source_test.py uses real ones.
#include "unit_test.hpp"

#include "adapters/git/small_git_server.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/mpl/list.hpp>

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <set>
#include <sstream>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(project_source_contract)

namespace {

void write(fs::path const& path, std::string const& text)
{
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text;
}

std::string read(fs::path const& path)
{
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

// A kind of source: what it is made of, where its project is in the folder of all, what it promises of itself
// (as `ref_meaning` and `is_local`), and how it is asked for one.

/// `owner/robots` in a plain folder.
struct Directory
{
    static constexpr auto project = "owner/robots";
    static constexpr auto refs = RefMeaning::none;
    static constexpr bool is_local = true;

    std::unique_ptr<ProjectSource> make(asio::any_io_executor, fs::path const& projects)
    {
        return make_directory_source(projects);
    }

    void ask(FetchOrder& order, std::string const& repository, std::string const& world) const
    {
        order.project.owner = "owner";
        order.project.repository = repository;
        order.project.ref_and_folder = "main";
        order.project.world = world;
    }
};

/// The template `robots`, for a visitor.
struct Website
{
    static constexpr auto project = "robots";
    static constexpr auto refs = RefMeaning::unknown; // nobody asks
    static constexpr bool is_local = false;

    std::unique_ptr<ProjectSource> make(asio::any_io_executor, fs::path const& projects)
    {
        WebsiteSourceConfig config;
        config.projects = projects;
        return make_website_source(std::move(config), HttpClientConfig(), Logger());
    }

    void ask(FetchOrder& order, std::string const& project, std::string const& world) const
    {
        order.website.emplace();
        order.website->origin = "https://w.org";
        order.website->project = project;
        order.website->world = world;
    }
};

/// `owner/robots` on a git server.
struct Git
{
    static constexpr auto project = "robots";
    static constexpr auto refs = RefMeaning::git;
    static constexpr bool is_local = false;

    std::unique_ptr<ProjectSource> make(asio::any_io_executor executor, fs::path const& projects)
    {
        server.emplace(projects / project);
        GitFolders folders(projects.parent_path() / "cache");
        return make_git_source(std::move(executor), GitSourceConfig(), HttpClientConfig(), std::move(folders),
                               Logger());
    }

    void ask(FetchOrder& order, std::string const& repository, std::string const& world) const
    {
        order.project.forge = server->url();
        order.project.owner = "owner";
        order.project.repository = repository;
        order.project.ref_and_folder = "main";
        order.project.world = world;
    }

    std::optional<SmallGitServer> server;
};

template<class Kind>
struct Fixture
{
    /// `yml`: the name of a file with settings; null: there is none.
    explicit Fixture(char const* yml = nullptr)
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_source_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
        auto const project = folder / "projects" / Kind::project;
        write(project / "worlds" / "a.wbt", "#VRML_SIM R2025a utf8\nWorldInfo {}\n");
        write(project / "controllers" / "c" / "c.py", std::string(1000, 'x'));
        if (yml)
            write(project / yml, "labels: gpu\n");
        fs::create_symlink("/etc/passwd", project / "link");
        BOOST_TEST_REQUIRE(::mkfifo((project / "pipe").c_str(), 0600) == 0);
        source = kind.make(context.get_executor(), folder / "projects");
    }

    ~Fixture()
    {
        source.reset();
        fs::remove_all(folder);
    }

    FetchOrder order(std::string const& project = "robots", std::string const& world = "a.wbt") const
    {
        FetchOrder order;
        kind.ask(order, project, world);
        order.directory = folder / "instance";
        return order;
    }

    template<class T>
    T run(asio::awaitable<T> body)
    {
        std::optional<T> outcome;
        auto const keep = [&](std::exception_ptr failed, T value) {
            BOOST_TEST(!failed);
            outcome = std::move(value);
        };
        asio::co_spawn(context, std::move(body), asio::bind_cancellation_slot(signal.slot(), keep));
        context.restart();
        context.run();
        return std::move(*outcome);
    }

    result<FetchedProject> fetch(FetchOrder order) { return run(source->fetch(std::move(order))); }

    /// Fetches after having been cancelled.
    asio::awaitable<result<FetchedProject>> fetch_cancelled(FetchOrder order)
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        signal.emit(asio::cancellation_type::terminal);
        co_return co_await source->fetch(std::move(order));
    }

    asio::io_context context{1};
    asio::cancellation_signal signal;
    fs::path folder;
    Kind kind;
    std::unique_ptr<ProjectSource> source;
};

using Kinds = boost::mpl::list<Directory, Website, Git>;

} // namespace

BOOST_AUTO_TEST_CASE_TEMPLATE(a_project_arrives_with_the_first_line_of_its_world, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const order = fixture.order();
    auto const fetched = fixture.fetch(order);
    BOOST_TEST_REQUIRE(fetched.has_value());
    BOOST_TEST(fetched->world_header == "#VRML_SIM R2025a utf8");
    BOOST_TEST(!fetched->revision.empty());
    BOOST_TEST(read(fetched->root / "controllers" / "c" / "c.py") == std::string(1000, 'x'));
    BOOST_TEST(order.progress->bytes_received >= 1000u);
}

BOOST_AUTO_TEST_CASE_TEMPLATE(with_it_arrives_what_its_settings_ask_for, Kind, Kinds)
{
    for (auto const* name : {"webots.yml", "webots.yaml"}) {
        Fixture<Kind> fixture(name);
        auto const fetched = fixture.fetch(fixture.order());
        BOOST_TEST_REQUIRE(fetched.has_value());
        BOOST_TEST(fetched->webots_yml == "labels: gpu\n", name);
    }
    Fixture<Kind> none;
    BOOST_TEST(none.fetch(none.order())->webots_yml == "");
}

// "blockedRepositories" depends on the first; of folders of this machine somebody else finds the worlds.
BOOST_AUTO_TEST_CASE_TEMPLATE(a_source_says_what_refs_mean_to_it_and_whether_it_is_a_folder_here, Kind, Kinds)
{
    Fixture<Kind> fixture;
    BOOST_TEST((fixture.source->ref_meaning() == Kind::refs));
    BOOST_TEST(fixture.source->is_local() == Kind::is_local);
}

BOOST_AUTO_TEST_CASE(a_plain_folder_tells_that_it_has_changed_and_git_does_not_know)
{
    Fixture<Directory> fixture;
    auto const order = fixture.order();
    auto const now = [&] { return fixture.run(fixture.source->current_revision(order.project)).value(); };
    auto const fetched = fixture.fetch(order);
    BOOST_TEST_REQUIRE(fetched.has_value());
    BOOST_TEST(fetched->revision == now());
    auto const program = fixture.folder / "projects" / Directory::project / "controllers" / "c" / "c.py";
    auto const added = program.parent_path() / "more.py";
    std::set<std::string> revisions{now()};
    write(program, "y");
    revisions.insert(now());
    write(added, "z");
    revisions.insert(now());
    fs::remove(added);
    revisions.insert(now());
    write(program, std::string(1000, 'x')); // as it was, but later
    revisions.insert(now());
    BOOST_TEST(revisions.size() == 5u);
    BOOST_TEST(now() == now());

    fs::remove_all(program.parent_path().parent_path().parent_path());
    auto const gone = fixture.run(fixture.source->current_revision(order.project));
    BOOST_TEST((!gone && gone.error() == errc::unavailable));
    Fixture<Git> git;
    auto const unknown = git.run(git.source->current_revision(git.order().project));
    BOOST_TEST((!unknown && unknown.error() == errc::unavailable));
}

BOOST_AUTO_TEST_CASE_TEMPLATE(what_is_neither_folder_nor_file_stays_out, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const fetched = fixture.fetch(fixture.order());
    BOOST_TEST_REQUIRE(fetched.has_value());
    for (auto const* name : {"link", "pipe"})
        BOOST_TEST(!fs::exists(fs::symlink_status(fetched->root / name)), name);
}

BOOST_AUTO_TEST_CASE_TEMPLATE(what_is_not_there_is_said, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const project = fixture.fetch(fixture.order("nothing"));
    BOOST_TEST_REQUIRE(project.has_error());
    BOOST_TEST((project.error() == errc::not_found));
    BOOST_TEST(project.error().message().find("nothing") != std::string::npos);
    auto const world = fixture.fetch(fixture.order("robots", "b.wbt"));
    BOOST_TEST_REQUIRE(world.has_error());
    BOOST_TEST((world.error() == errc::not_found));
    BOOST_TEST(world.error().message() == "b.wbt does not exist.");
}

BOOST_AUTO_TEST_CASE_TEMPLATE(limits_of_bytes_and_files_hold, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto bytes = fixture.order();
    bytes.limits.bytes = 900;
    BOOST_TEST((fixture.fetch(bytes).error() == errc::too_large));
    BOOST_TEST(fixture.run(fixture.source->discard(bytes.directory)).has_value());
    auto files = fixture.order();
    files.limits.files = 3;
    BOOST_TEST((fixture.fetch(files).error() == errc::too_large));
}

BOOST_AUTO_TEST_CASE_TEMPLATE(a_cancelled_fetch_ends_early_and_is_discarded_like_any_other, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const order = fixture.order();
    auto const fetched = fixture.run(fixture.fetch_cancelled(order));
    BOOST_TEST_REQUIRE(fetched.has_error());
    BOOST_TEST((fetched.error().code() == asio::error::operation_aborted));
    BOOST_TEST(fixture.run(fixture.source->discard(order.directory)).has_value());
    BOOST_TEST(!fs::exists(order.directory));
}

BOOST_AUTO_TEST_CASE(a_fetch_that_is_cancelled_before_it_begins_asks_no_git_server)
{
    Fixture<Git> fixture;
    (void)fixture.run(fixture.fetch_cancelled(fixture.order()));
    BOOST_TEST(fixture.kind.server->asked() == 0);
}

BOOST_AUTO_TEST_CASE_TEMPLATE(a_file_is_put_back_as_it_was, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const order = fixture.order();
    auto const fetched = fixture.fetch(order);
    BOOST_TEST_REQUIRE(fetched.has_value());
    RestoreOrder restore;
    restore.project = order.project;
    restore.website = order.website;
    if (restore.website)
        restore.website->user1_id = "42"; // a user, with changes of their own
    restore.directory = order.directory;
    restore.root = fetched->root;
    restore.file = "controllers/c/c.py";
    write(fetched->root / restore.file, "changed");
    BOOST_TEST(fixture.run(fixture.source->restore(restore)).has_value());
    BOOST_TEST(read(fetched->root / restore.file) == std::string(1000, 'x'));
    restore.file = "controllers/c/other.py";
    BOOST_TEST((fixture.run(fixture.source->restore(restore)).error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE_TEMPLATE(a_discarded_directory_is_gone_with_all_that_a_simulation_wrote, Kind, Kinds)
{
    Fixture<Kind> fixture;
    auto const order = fixture.order();
    auto const fetched = fixture.fetch(order);
    BOOST_TEST_REQUIRE(fetched.has_value());
    write(fetched->root / "new" / "file", "x");
    fs::create_symlink(fixture.folder / "projects", fetched->root / "new" / "link");
    BOOST_TEST(fixture.run(fixture.source->discard(order.directory)).has_value());
    BOOST_TEST(!fs::exists(order.directory));
    BOOST_TEST(fs::exists(fixture.folder / "projects" / Kind::project / "worlds" / "a.wbt"));
    BOOST_TEST(fixture.run(fixture.source->discard(order.directory)).has_value()); // nothing there: fine too
}

BOOST_AUTO_TEST_SUITE_END()
